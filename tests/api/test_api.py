"""The interface for notebooks: from files to a traced damper and a simulated loop."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrpipe
from mrpipe.api.loop import _rig
from mrpipe.artifacts import ArtifactWriter, Provenance, load_parameter_set
from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named
from mrpipe.control.laws._regulator import regulator_assessment
from mrpipe.control.lqg import frame_regulator_gain
from mrpipe.dampers.model import damper_from_parameter_set, write_damper
from mrpipe.effects.library import damper_effects
from mrpipe.errors import UserError
from mrpipe.simulation.storage import write_response
from mrpipe.structures import frame_from_parameter_set, shear_frame, write_frame
from tests.campaigns.builders import campaign, motion
from tests.control.conftest import random_network
from tests.effects.test_damper import added


@pytest.fixture(scope="module")
def tests(tmp_path_factory: pytest.TempPathFactory) -> mrpipe.api.PreparedTests:
    folder = campaign(tmp_path_factory.mktemp("rig") / "rig", motion(8.0, drive=1.0))
    return mrpipe.prepare(mrpipe.load_campaign(folder), cutoff_hz=50.0)


@pytest.mark.property
def test_prepared_tests_are_a_sequence_and_a_table(tests: mrpipe.api.PreparedTests) -> None:
    assert [test.name for test in tests] == ["one", "two"]
    assert "2 tests, 1 for training and 1 for validation" in str(tests)
    table = tests.to_frame()
    assert len(table) == sum(len(test.time_s) for test in tests)
    figure = tests.plot()
    assert figure.axes[0].get_xlabel() == "displacement [mm]"
    # a notebook asks for this where pyplot was never imported
    assert figure._repr_png_().startswith(b"\x89PNG")


@pytest.mark.planted
def test_a_damper_is_fitted_with_the_settings_of_its_stage(tests: mrpipe.api.PreparedTests) -> None:
    fit = mrpipe.fit_damper(tests, form="bingham", compare=("bingham",))
    assert fit.damper.form == "bingham"
    # the planted damper is tanh(v/v0) with a viscous part, which is this form
    assert fit.chosen.training.nrmse < 0.05
    assert "bingham" in str(fit)
    assert list(fit.to_frame()["form"]) == ["bingham"]
    with pytest.raises(UserError):
        mrpipe.fit_damper(tests, form="bouc-when")


@pytest.mark.property
def test_the_top_of_the_table_is_that_of_the_indices() -> None:
    """The last degree of freedom may be a rotation, which has no displacement in metres."""
    frame = replace(shear_frame([20.0, 20.0, 1.0], [3e4, 3e4, 1e5], 0.01), influence=np.array([1.0, 1.0, 0.0]))
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    loop = mrpipe.simulate(frame, damper, law="vd", gains=Gains(300.0))
    assert np.array_equal(loop.to_frame()["top_displacement_m"], loop.response.displacement[:, 1])


@pytest.mark.literature
def test_a_loop_from_objects_in_memory() -> None:
    frame = frame_from_parameter_set("thesis")
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    loop = mrpipe.simulate(frame, damper, law="vd", base_amplitude_m_s2=0.79, frequency_rad_s=8.0)
    # 538 N s/m gives the largest damping; the thesis used 650, with which the top moves by 24.3 mm here
    assert loop.gains.c_n_s_m == pytest.approx(538.0, rel=0.02)
    assert 0.022 < loop.indices["rms_x_top_m"] < 0.028
    assert len(loop.to_frame()) == len(loop.response.time_s)
    assert "vd: rms x_top" in str(loop)
    off = mrpipe.simulate(frame, damper, law="passive-off", base_amplitude_m_s2=0.79, frequency_rad_s=8.0)
    assert off.indices["rms_x_top_m"] > 2.0 * loop.indices["rms_x_top_m"]
    with pytest.raises(UserError, match="network"):
        mrpipe.simulate(frame, damper, law="nnc")


@pytest.mark.property
def test_the_regulator_suits_the_structure():
    """Default weights had been out of proportion for every structure but a small one."""
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    damping = []
    for size in (1.0, 1e3):
        rig, plant = _rig(
            shear_frame([25.0 * size] * 3, [3e4 * size] * 3, 0.01), damper, 1, (law_named("lqg"),), None, {}
        )
        weights = rig.controllers.calibrated.weights
        assert weights == plant.weights and weights.force_noise_n > 0.0
        found = regulator_assessment(plant, frame_regulator_gain(plant.frame, plant.position, weights))
        damping.append(found.damping_ratio_exact)
    assert damping[0] == pytest.approx(damping[1], rel=5e-3)


@pytest.mark.property
def test_a_run_is_opened_by_its_directory(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="not a run directory"):
        mrpipe.open_run(tmp_path / "nothing")
    run = mrpipe.open_run(tmp_path)
    assert "no artifacts" in str(run)
    with pytest.raises(UserError, match=r"damper\.h5"):
        _ = run.damper
    (tmp_path / "a.csv").write_text("1,2\n")
    with pytest.raises(UserError, match="no manifests of stages and no artifacts"):
        mrpipe.open_run(tmp_path)


@pytest.mark.property
def test_tests_without_a_role_are_refused() -> None:
    """An empty list had ended with `list index out of range`."""
    for call in (mrpipe.fit_damper, mrpipe.trace):
        with pytest.raises(UserError, match="no training test"):
            call([])  # type: ignore[operator]


@pytest.mark.property
def test_a_run_opens_its_traced_damper_with_the_effects(tmp_path: Path) -> None:
    inertia = added("inertia", damper_effects()["inertia"].forms[0].name, mass=1.5)
    traced = replace(damper_from_parameter_set(load_parameter_set("dampers", "set-c")), effects=(inertia,))
    with ArtifactWriter.create(tmp_path / "damper-traced.h5", Provenance("close-loop")) as artifact:
        write_damper(artifact, traced)
    found = mrpipe.open_run(tmp_path).damper_traced
    assert [item.name for item in found.effects] == ["inertia"] and found == traced


@pytest.mark.property
def test_a_run_opens_its_frame_response_and_verdict(tmp_path: Path) -> None:
    frame = frame_from_parameter_set("thesis")
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    loop = mrpipe.simulate(frame, damper, law="fdns", base_amplitude_m_s2=0.79, frequency_rad_s=8.0)
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, frame)
    with ArtifactWriter.create(tmp_path / "response-fdns.h5", Provenance("simulate")) as artifact:
        write_response(artifact, loop.response, damper.drive_unit)
    run = mrpipe.open_run(tmp_path)
    np.testing.assert_array_equal(run.frame.stiffness, frame.stiffness)
    table = run.response("fdns")
    np.testing.assert_array_equal(table["time"], loop.response.time_s)
    np.testing.assert_array_equal(table[f"displacement_{frame.floors}"], loop.response.displacement[:, -1])
    with pytest.raises(UserError, match="run mrpipe close-loop first"):
        _ = run.verdict
    (tmp_path / "close-loop.json").write_text('{"verdict": "noise"}', encoding="utf-8")
    assert run.verdict["verdict"] == "noise"


@pytest.mark.oracle
def test_an_artifact_of_a_run_is_a_dataset(tmp_path: Path) -> None:
    pytest.importorskip("xarray", reason="needs the extra xarray")
    frame = frame_from_parameter_set("thesis")
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, frame)
    found = mrpipe.open_run(tmp_path).dataset("frame", "frame")
    assert found["mass"].dims == ("floor", "floor_of_cause") and found["mass"].attrs["unit"] == "kg"
    np.testing.assert_array_equal(found["stiffness"].values, frame.stiffness)


@pytest.mark.property
def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, mrpipe; print([name for name in ('numba', 'scipy', 'pandas', 'h5py') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    with pytest.raises(AttributeError):
        _ = mrpipe.no_such_name


@pytest.mark.oracle
def test_models_are_exported_by_kind(tmp_path: Path) -> None:
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    frame = frame_from_parameter_set("thesis")
    files = mrpipe.export(damper, tmp_path / "damper", formats=["c"])
    assert {file.name for file in files} == {"damper.c", "damper.h", "self_test.c", "vectors.csv", "README.md"}
    assert all(file.is_file() for file in files)
    files = mrpipe.export(frame, tmp_path / "frame", formats=["json"], floor=2)
    assert [file.name for file in files] == ["frame.json", "vectors.csv", "README.md"]


@pytest.mark.property
def test_an_exported_network_names_no_unit_of_the_drive_that_was_not_given(tmp_path: Path) -> None:
    network = random_network(("velocity", "force"), "drive", 3, True)
    for unit, heading in (("", "drive [drive]"), ("V", "drive [V]")):
        mrpipe.export(network, tmp_path, formats=["json"], drive_unit=unit)
        assert heading in (tmp_path / "vectors.csv").read_text(encoding="utf-8")
    with pytest.raises(UserError, match="give A or V"):
        mrpipe.export(network, tmp_path, drive_unit="mA")


@pytest.mark.planted
def test_an_unknown_declared_effect_is_refused_before_the_tracing(tests: mrpipe.api.PreparedTests) -> None:
    declared = replace(tests.campaign, declared_effects=("heating", "backlsh"))
    with pytest.raises(UserError, match=r"declared_effects\[1\]: unknown effect 'backlsh'; did you mean backlash"):
        mrpipe.trace(replace(tests, campaign=declared))


@pytest.mark.property
def test_every_name_offered_exists() -> None:
    for name in mrpipe.api.__all__:
        assert callable(getattr(mrpipe, name))
