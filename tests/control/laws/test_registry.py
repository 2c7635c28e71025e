"""A law is one file: added in a folder of its own, it is listed, calibrated, simulated and exported."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import numpy as np
import pytest

from mrpipe.control import laws
from mrpipe.control.gains import Gains
from mrpipe.control.laws import all_laws, law_names
from mrpipe.errors import UserError
from tests.control.stepped import commands_of
from tests.exports.test_controller import in_c, recorded_signal
from tests.simulation.test_stages import SMALL, run  # noqa: F401

NEW_LAW = '''
"""Force that grows with the square of the velocity."""

from numba import njit

from mrpipe.control.gains import Gains
from mrpipe.control.kernel import AT_LAW, GAIN_C, LAW_SIGNATURE, S_V
from mrpipe.control.law import Assessment, GainRange, Law
from mrpipe.control.limits import optimal_viscosity


@njit(LAW_SIGNATURE)
def quadratic(numbers, layout, state, measured):
    return numbers[layout[AT_LAW]] * abs(state[S_V]) * state[S_V]


def numbers(gains, position, dt):
    import numpy as np

    return np.array([gains["drag_n_s2_m2"]])


LAW = Law(
    name="drag-law",
    summary="force that grows with the square of the velocity",
    source="a test",
    force=quadratic,
    c_body="    return numbers[layout[AT_LAW]] * fabs(state[S_V]) * state[S_V];\\n",
    gains=(GainRange("drag_n_s2_m2", "drag", lambda plant: (1.0, 1e5)),),
    signs={"drag_n_s2_m2": 1.0},
    candidates=lambda plant: {"exact": Gains(drag_n_s2_m2=10.0 * optimal_viscosity(plant.modes))},
    assess=lambda plant, gains: Assessment(damping_ratio_estimate=0.1),
    numbers=numbers,
)
'''


@pytest.fixture
def new_law(tmp_path, monkeypatch):
    """Add a folder with the new law to the folders that are searched for laws."""
    folder = tmp_path / "laws"
    folder.mkdir()
    (folder / "drag_law.py").write_text(NEW_LAW)
    monkeypatch.setattr(laws, "__path__", [*laws.__path__, str(folder)])
    importlib.invalidate_caches()
    yield "drag-law"
    laws._load.cache_clear()


@pytest.mark.property
def test_every_law_is_complete():
    for name, law in all_laws().items():
        assert law.name == name and law.summary and law.source and "return" in law.c_body, name
        assert set(law.signs) <= set(law.gain_names), name
        assert not law.tuned_gain or law.tuned_gain in law.gain_names, name
        assert law.output == "force" or law.harmonic_force is None, name


@pytest.mark.property
def test_unknown_laws_and_gains_are_refused():
    with pytest.raises(UserError, match="is not a control law"):
        laws.law_named("vdd")
    with pytest.raises(UserError, match=r"calibrate\.vd: k_n_m: law vd has no such gain; it has: c_n_s_m"):
        laws.law_named("vd").check(Gains(650.0, 100.0))
    with pytest.raises(UserError, match="law vdns needs a negative k_n_m"):
        laws.law_named("vdns").check(Gains(250.0, 4500.0))


@pytest.mark.property
def test_gains_compare_and_change_like_values():
    assert Gains(650.0) == Gains(c_n_s_m=650.0) != Gains(650.0, 1.0)
    assert Gains(650.0, weight_1_n2=2.0)["weight_1_n2"] == 2.0
    assert Gains(650.0).changed(k_n_m=-3.0) == Gains(650.0, -3.0)


@pytest.mark.planted
def test_a_law_in_a_folder_of_its_own_runs_through_the_program(new_law, run):  # noqa: F811
    from mrpipe.config import model
    from mrpipe.config.sections import calibrate as section
    from mrpipe.stages import calibrate, export_controller, registry
    from mrpipe.stages.simulate import simulate_stage

    assert new_law in law_names()
    importlib.reload(section)
    model.forget()
    try:
        summary = run(calibrate.STAGE, {"calibrate": {**SMALL, "drag_law": {"drag_n_s2_m2": 5000.0}}})
        entry = summary["laws"][new_law]
        assert entry["drag_n_s2_m2"] == 5000.0 and entry["candidates"]["exact"]["drag_n_s2_m2"] > 100.0
        excitation = {"base_amplitude_m_s2": 0.5, "cycles": 10, "settling_cycles": 5}
        settings = {"controller": {"inverse": "model"}, "excitation": excitation}
        simulated = run(simulate_stage(new_law), {"simulate": settings})
        assert simulated["law"] == new_law and simulated["rms_x_top_m"] > 1e-4
        exported = run(export_controller.STAGE, {"export": {"law": new_law}, "simulate": settings})
        content = json.loads((Path(exported["directory"]) / "controller" / "controller.json").read_text())
        assert content["gains"]["drag_n_s2_m2"] == 5000.0
        registry.forget()
        importlib.reload(importlib.import_module("mrpipe.stages.simulate"))
        assert f"simulate-{new_law}" in registry.all_stages()
    finally:
        laws.__path__ = laws.__path__[:-1]
        importlib.reload(section)
        importlib.reload(importlib.import_module("mrpipe.stages.simulate"))
        model.forget()
        registry.forget()


@pytest.mark.oracle
def test_the_c_code_of_a_new_law_does_the_same(new_law, tmp_path, set_c):
    from mrpipe.control import ControllerOptions, build_controller, inverse_table

    options = ControllerOptions(drive_limit=4.0)
    controller = build_controller(new_law, Gains(drag_n_s2_m2=10000.0), options, inverse=inverse_table(set_c))
    signal = recorded_signal(controller.measured_size, 200.0)
    python, c = commands_of(controller, signal), in_c(controller, signal, tmp_path)
    assert np.ptp(python[:, 0]) > 0.1
    np.testing.assert_allclose(c, python, rtol=1e-11, atol=1e-12)
