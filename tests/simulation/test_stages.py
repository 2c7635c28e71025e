"""calibrate, simulate and export controller as stages: declared settings suffice, summaries hold what is promised."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from mrpipe.artifacts import (
    Artifact,
    ArtifactWriter,
    Provenance,
    config_directory,
    load_parameter_set,
    no_progress,
)
from mrpipe.artifacts.plain import plain
from mrpipe.config.model import config_model
from mrpipe.control import laws
from mrpipe.dampers.model import damper_from_parameter_set, write_damper, write_tested
from mrpipe.errors import StageSkipped, UserError
from mrpipe.networks.network import write_network
from mrpipe.pipeline.settings_view import SettingsView
from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.simulation.rig import amplitude_warning, drive_warning, record_warning
from mrpipe.stages import calibrate, export_controller, export_models, export_opensees, resonance
from mrpipe.stages.simulate import STAGES
from mrpipe.structures import frame_from_parameter_set, natural_modes, shear_frame, write_frame
from tests.control.conftest import random_network

SIMULATE = {stage.name: stage for stage in STAGES}
RESONANCE = {stage.name: stage for stage in resonance.STAGES}
CONTRACT = (
    "law rms_x1_m rms_x5_m rms_x_top_m rms_a1_m_s2 rms_a5_m_s2 peak_x1_m peak_x5_m peak_a1_m_s2 peak_a5_m_s2 "
    "damping_ratio force_tracking_nrmse residual_force_n real_time_factor"
)


SMALL = {"map_points": 5, "neural": {"starts": 1, "iterations": 30, "amplitudes": 3, "frequencies": 3}}


class Sink:
    def __init__(self) -> None:
        self.parts: list[str] = []

    def text(self, paragraph: str) -> None:
        self.parts.append(paragraph)

    def table(self, name: str, frame: Any, caption: str) -> None:
        self.parts.append(f"table {name} {len(frame)}")

    def figure(self, name: str, figure: Any, caption: str) -> None:
        self.parts.append(f"figure {name}")


Run = Callable[..., dict]


def _laid_over(settings: dict[str, Any], base: dict[str, Any] | None = None) -> dict[str, Any]:
    """Settings laid over those of the thesis; `neutral: True` leaves the thesis out."""
    if base is None:
        if settings.get("neutral"):
            return {name: value for name, value in settings.items() if name != "neutral"}
        content = yaml.safe_load((config_directory() / "thesis.yaml").read_text())
        base = {name: content[name] for name in ("calibrate", "simulate")}
    result = dict(base)
    for name, value in settings.items():
        inner = result.get(name)
        result[name] = _laid_over(value, inner) if isinstance(value, dict) and isinstance(inner, dict) else value
    return result


def runner(directory: Path) -> Run:
    """Return a function that runs a stage in a folder with the thesis' frame, set C and a network."""
    files = {
        "identify-frame": "frame.h5",
        "identify-damper": "damper.h5",
        "train-inverse": "inverse.h5",
        "calibrate": "control.h5",
        "close-loop": "close-loop.h5",
    }
    with ArtifactWriter.create(directory / "frame.h5", Provenance("test")) as artifact:
        write_frame(artifact, frame_from_parameter_set("thesis"))
    with ArtifactWriter.create(directory / "damper.h5", Provenance("test")) as artifact:
        write_damper(artifact, damper_from_parameter_set(load_parameter_set("dampers", "set-c")))
        write_tested(artifact, {"displacement": 5e-3, "velocity": 10.0})
    with ArtifactWriter.create(directory / "inverse.h5", Provenance("test")) as artifact:
        limits = {"feature_minimum": np.zeros(8), "feature_maximum": np.repeat([10.0, 60.0], 4)}
        network = replace(random_network(("velocity", "force"), "drive", 3, True), **limits)
        write_network(artifact, "network", network)

    def go(stage: Stage, settings: dict[str, Any] | None = None) -> dict:
        configuration = config_model().model_validate(_laid_over(settings or {}))
        inputs = list(stage.for_configuration(configuration).inputs)
        inputs += [name for name in stage.known_inputs if (directory / files[name]).exists()]
        context = StageContext(
            stage=stage.name,
            settings=SettingsView(configuration, stage.settings, stage.name),
            inputs={name: directory / files[name] for name in inputs},
            run_directory=directory,
            rng=np.random.default_rng(1),
            seed=1,
            jobs=1,
            progress=no_progress,
            report=Sink(),
            log=logging.getLogger("test"),
            provenance=Provenance(stage.name),
        )
        summary = plain(stage.run(context))
        json.dumps(summary, allow_nan=False)
        assert context.report.parts  # type: ignore[attr-defined]
        told = {"warnings": context.warnings, "directory": directory, "parts": context.report.parts}  # type: ignore[attr-defined]
        return {**summary, **told}

    return go


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    go = runner(tmp_path_factory.mktemp("run"))
    go(calibrate.STAGE, {"calibrate": SMALL})
    return go


@pytest.mark.literature
def test_calibrate_tells_what_the_contract_says(run):
    summary = run(calibrate.STAGE, {"calibrate": SMALL})
    assert summary["omega_0"] == pytest.approx(8.0, rel=1e-3)
    assert summary["nu"] == pytest.approx(1.5404e-4, rel=2e-3)
    assert {"omega_inf", "u_0"} <= summary.keys()
    for law in ("vd", "vdps", "vdns", "fdns", "nnc", "lqg"):
        assert {"damping_ratio_estimate", "damping_ratio_exact"} <= summary["laws"][law].keys()
    assert summary["laws"]["vd"]["c_n_s_m"] == 650.0
    assert summary["laws"]["vd"]["damping_ratio_exact"] == pytest.approx(0.154, abs=5e-4)
    assert summary["laws"]["vd"]["candidates"]["closed-form"]["c_n_s_m"] == pytest.approx(811.0, rel=5e-3)
    assert summary["laws"]["nnc"]["architecture"] == "12-6-6-1"
    assert any("static limit" in line for line in summary["warnings"])


@pytest.mark.golden
def test_gains_of_the_users_own_and_the_floor(run):
    own = {"calibrate": {**SMALL, "gains": "exact", "vd": {"c_n_s_m": 700.0}}}
    summary = run(calibrate.STAGE, own)
    assert summary["laws"]["vd"]["c_n_s_m"] == 700.0
    assert summary["laws"]["fdns"]["alpha_n_m"] == pytest.approx(3128.0, rel=5e-3)
    with pytest.raises(UserError, match="the frame has 5 floors"):
        run(calibrate.STAGE, {"calibrate": {"damper_floor": 6}})
    run(calibrate.STAGE, {"calibrate": SMALL})


@pytest.mark.golden
@pytest.mark.parametrize("law", ["vd", "fdns", "nnc", "lqg", "passive-off"])
def test_simulate_tells_what_the_contract_says(run, law):
    settings = {"simulate": {"controller": {"inverse": "model"}, "excitation": {"cycles": 20, "settling_cycles": 10}}}
    summary = run(SIMULATE[f"simulate-{law}"], settings)
    assert set(CONTRACT.split()) <= summary.keys()
    assert summary["law"] == law
    assert summary["energy_balance_error"] < 5e-3
    if law == "vd":
        assert summary["rms_x_top_m"] == pytest.approx(0.0243, rel=0.02)
    artifact = Artifact(summary["directory"] / f"response-{law}.h5")
    assert artifact.unit("displacement") == "m" and artifact.unit("drive") == "A"
    assert artifact.array("displacement").shape[1] == 5


@pytest.mark.planted
def test_a_loop_that_leaves_what_was_learned_and_tested_says_so(run):
    """A network that knows 60 N and a damper that was tested at 5 mm, under a law that asks for more of both."""
    excitation = {"base_amplitude_m_s2": 0.78, "cycles": 12, "settling_cycles": 6, "decay_s": 1.0}
    summary = run(SIMULATE["simulate-vd"], {"simulate": {"excitation": excitation}})
    network, damper = (summary["training_range"][name] for name in ("inverse_network", "damper_model"))
    assert network["inputs"]["force"]["outside_share"] == network["outside_share"] > 0.01
    assert network["inputs"]["force"]["largest_n"] > 60.0 == network["inputs"]["force"]["known_largest_n"]
    assert network["inputs"]["velocity"]["outside_share"] == 0.0
    assert damper["inputs"]["displacement"]["outside_share"] > 0.1
    told = [line for line in summary["warnings"] if "extrapolates" in line]
    assert ["inverse network" in told[0], "damper model" in told[1]] == [True, True] and len(told) == 2
    assert "force up to" in told[0] and "(known to 60)" in told[0] and "velocity" not in told[0]
    assert "table training-range 4" in summary["parts"]
    # with a perfect damper neither is asked anything
    perfect = run(SIMULATE["simulate-vd"], {"simulate": {"tracking": "ideal", "excitation": excitation}})
    assert perfect["training_range"] == {} and not any("extrapolates" in line for line in perfect["warnings"])


@pytest.mark.golden
@pytest.mark.parametrize("kind", ["sweep", "recorded", "free-decay", "harmonic"])
def test_other_excitations_and_settings(run, kind, tmp_path):
    record = tmp_path / "record.txt"
    t = np.arange(0.0, 6.0, 0.02)
    np.savetxt(record, np.column_stack([t, np.sin(8.0 * t)]))
    settings = {
        "simulate": {
            "tracking": "ideal" if kind == "harmonic" else "damper",
            "frame": "thesis",
            "damper": "set-c",
            "excitation": {
                "kind": kind,
                "base_amplitude_m_s2": 0.5,
                "sweep_s": 10.0,
                "frequency_rad_s": None,
                "cycles": 10,
                "settling_cycles": 5,
                "file": str(record),
            },
        }
    }
    summary = run(SIMULATE["simulate-vd"], settings)
    assert summary["rms_x_top_m"] > 1e-4
    assert (summary["damping_ratio"] is None) == (kind in {"sweep", "recorded"})


@pytest.mark.golden
def test_frame_of_other_floors_is_told(run, tmp_path):
    path = tmp_path / "three.yaml"
    path.write_text(
        "name: three\nmodel: shear-frame\nsource: test\nparameters:\n"
        "  floor_masses: {value: [6, 6, 6], unit: kg}\n"
        "  storey_stiffnesses: {value: [5000, 5000, 5000], unit: N/m}\n"
        "  damping_ratios: {value: [0.01, 0.01, 0.01], unit: '1'}\n"
    )
    with pytest.raises(UserError, match="has 3 floors; calibrated for 5"):
        run(SIMULATE["simulate-vd"], {"simulate": {"frame": str(path)}})


@pytest.mark.golden
def test_a_law_without_calibration_is_told(run):
    directory = run(calibrate.STAGE, {"calibrate": SMALL})["directory"]
    import h5py

    with h5py.File(directory / "control.h5", "a") as handle:
        del handle["laws/vdps"]
    try:
        with pytest.raises(UserError, match="laws/vdps: this law is not calibrated; calibrated: vd, vdns"):
            run(SIMULATE["simulate-vdps"])
        with pytest.raises(UserError, match="laws/vdps: this law is not calibrated"):
            run(RESONANCE["resonance-vdps"])
    finally:
        run(calibrate.STAGE, {"calibrate": SMALL})


@pytest.mark.golden
def test_export_writes_a_folder(run):
    summary = run(export_controller.STAGE, {"export": {"law": "vdns", "prefix": "rig"}})
    folder = summary["directory"] / "controller"
    assert {"controller.c", "controller.h", "controller.json", "README.md"} <= {item.name for item in folder.iterdir()}
    content = json.loads((folder / "controller.json").read_text())
    assert content["gains"]["k_n_m"] == content["parameters"]["k_n_m"]["value"] == -4500.0
    assert (folder / "vectors.csv").read_text().startswith("displacement [m],acceleration [m/s^2]")


@pytest.mark.golden
def test_the_export_of_one_law_leaves_that_of_another_in_place(run):
    stages = {stage.name: stage for stage in export_controller.STAGES}
    summaries = {law: run(stages[f"export-controller-{law}"], {"export": {"prefix": "rig"}}) for law in ("vd", "vdns")}
    for law, summary in summaries.items():
        folder = summary["directory"] / "controller" / law
        assert summary["law"] == law and summary["folder"] == str(folder)
        assert set(summary["files"]) == {item.name for item in folder.iterdir()}
        assert json.loads((folder / "controller.json").read_text())["law"] == law


@pytest.mark.golden
@pytest.mark.parametrize("name", ["damper", "frame"])
def test_export_of_a_model_writes_a_folder_with_the_formats_asked_for(run, name):
    stage = {item.name: item for item in export_models.STAGES}[f"export-{name}"]
    summary = run(stage, {"export": {"formats": ["json", "c"]}})
    files = {item.name for item in (summary["directory"] / "export" / name).iterdir()}
    assert files == {*summary["files"]} == {f"{name}.{end}" for end in ("c", "h", "json")} | {
        "self_test.c", "vectors.csv", "README.md",
    }  # fmt: skip


@pytest.mark.golden
@pytest.mark.parametrize("name", ["frame", "opensees"])
def test_the_export_of_a_frame_names_what_it_leaves_out(tmp_path, name):
    stages = {item.name: item for item in (*export_models.STAGES, export_opensees.STAGE)}
    run = runner(tmp_path)
    assert run(stages[f"export-{name}"])["warnings"] == []
    found = [
        {"name": "joint-friction", "place": "storey 2", "corrected_in": "structure", "parameters": {"force": 2.0}},
        {"name": "remanence", "corrected_in": "plant"},
    ]
    with ArtifactWriter.create(tmp_path / "close-loop.h5", Provenance("test")) as artifact:
        artifact.put_json("summary", {"effects": found})
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("test")) as artifact:
        frame = frame_from_parameter_set("thesis")
        write_frame(artifact, frame)
        laws = {"angular_frequency": natural_modes(frame).angular_frequencies, "damping_ratio": np.full(5, 0.01)}
        laws |= {"softening_exponent": np.full(5, 0.1), "damping_exponent": np.full(5, 0.3)}
        for column, values in {**laws, "reference": np.full(5, 1e-3), "largest": np.full(5, 0.01)}.items():
            artifact.put(f"amplitude/{column}", values, unit="1", dims=("mode",))
    effects, amplitude = run(stages[f"export-{name}"])["warnings"]
    assert effects.startswith("close-loop found joint-friction (storey 2), which this export does not contain")
    assert "set simulate.frame_amplitude_m" in amplitude
    at_amplitude = run(stages[f"export-{name}"], {"simulate": {"frame_amplitude_m": 0.01}})
    assert at_amplitude["warnings"] == [effects]
    if name == "frame":
        folder = tmp_path / "export" / "frame"
        content = json.loads((folder / "frame.json").read_text())
        assert content["left_out"] == [effects] and content["amplitude_m"] == 0.01
        (friction,) = content["traced_effects"]
        assert friction == {"name": "joint-friction", "place": "storey 2", "parameters": {"force": 2.0}}
        # softer by the factor (1 + A/A_0)^-a of the law
        assert content["model"]["frequencies_hz"] == pytest.approx(natural_modes(frame).frequencies_hz * 11.0**-0.1)
        assert "joint-friction" in (folder / "README.md").read_text()


@pytest.mark.golden
def test_the_export_of_the_identified_damper_names_the_effects_of_the_traced_one(tmp_path):
    run = runner(tmp_path)
    with ArtifactWriter.create(tmp_path / "close-loop.h5", Provenance("test")) as artifact:
        artifact.put_json("summary", {"effects": [{"name": "remanence", "corrected_in": "plant"}]})
    stage = {item.name: item for item in export_models.STAGES}["export-damper"]
    (warning,) = run(stage, {"export": {"formats": ["json"]}})["warnings"]
    assert warning.startswith("close-loop found remanence") and warning.endswith("--damper traced")


def _write_other_rig(path: Path) -> None:
    """A stiff frame of three floors and a damper thirty times as strong as the thesis', in place of its rig."""
    frame = shear_frame([900.0, 800.0, 700.0], [2.0e6, 1.6e6, 1.2e6], [0.01, 0.01, 0.01])
    set_c = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    strong = {
        name: 30.0 * value if name.startswith(("yield_force", "viscosity")) else value
        for name, value in set_c.parameters.items()
    }
    with ArtifactWriter.create(path / "frame.h5", Provenance("test")) as artifact:
        write_frame(artifact, frame)
    with ArtifactWriter.create(path / "damper.h5", Provenance("test")) as artifact:
        write_damper(artifact, replace(set_c, parameters=strong))
        write_tested(artifact, {"displacement": 0.02, "velocity": 0.5})


@pytest.mark.planted
def test_defaults_suit_another_rig(tmp_path):
    """No number of the thesis' rig is left: gains, frequency, amplitude and switch follow from this rig."""
    run = runner(tmp_path)
    _write_other_rig(tmp_path)
    summary = run(calibrate.STAGE, {"neutral": True, "calibrate": SMALL})
    assert summary["expected_amplitude_m"] == pytest.approx(0.01)
    limit = summary["static_stiffness_n_m"]
    assert summary["laws"]["vdns"]["k_n_m"] == pytest.approx(-0.8 * limit)
    assert summary["laws"]["vdps"]["k_n_m"] == pytest.approx(0.5 * limit)
    for law, gain in (("vd", "c_n_s_m"), ("vdns", "c_n_s_m"), ("fdns", "alpha_n_m")):
        entry = summary["laws"][law]
        assert "published" not in entry["candidates"]
        assert entry[gain] == entry["candidates"]["exact"][gain] > 0.0
    # the regulator damps the target mode twice as much as viscous damping; about 1 % of inherent damping adds to both
    ratios = {law: summary["laws"][law]["damping_ratio_exact"] - 0.01 for law in ("vd", "lqg")}
    assert ratios["lqg"] == pytest.approx(2.0 * ratios["vd"], rel=0.05)
    settings = {"neutral": True, "simulate": {"controller": {"inverse": "model"}}}
    simulated = run(SIMULATE["simulate-vd"], settings)
    assert simulated["excitation"]["frequency_rad_s"] == pytest.approx(summary["omega_0"])
    moved = simulated["rms_damper_displacement_m"] * np.sqrt(2.0)
    assert 0.5 * 0.01 < moved < 2.0 * 0.01
    assert not {"rms_x5_m", "rms_a5_m_s2", "peak_x5_m"} & simulated.keys()
    assert {"rms_x1_m", "rms_x_top_m", "rms_a_top_m_s2", "peak_x_top_m", "rms_a1_absolute_m_s2"} <= simulated.keys()
    assert not [line for line in simulated["warnings"] if "base amplitude" in line]
    decay = {"neutral": True, "simulate": {"controller": {"inverse": "model"}, "excitation": {"kind": "free-decay"}}}
    assert 0.003 < run(SIMULATE["simulate-fdns"], decay)["peak_x_top_m"] < 0.2


@pytest.mark.planted
def test_a_law_that_cannot_be_calibrated_is_skipped_with_its_reason(run, monkeypatch):
    def fails(plant):
        raise UserError("calibrate", "vdps", "has no optimum here", "choose another law")

    broken = replace(laws.law_named("vdps"), candidates=fails)
    known = laws.law_named
    monkeypatch.setattr(laws, "law_named", lambda name: broken if name == "vdps" else known(name))
    try:
        summary = run(calibrate.STAGE, {"calibrate": SMALL})
        assert "has no optimum here" in summary["skipped"]["vdps"] and "vdps" not in summary["laws"]
        assert any("law vdps was skipped" in line for line in summary["warnings"])
        with pytest.raises(StageSkipped, match=r"law vdps could not be calibrated: .*has no optimum here"):
            run(SIMULATE["simulate-vdps"])
        with pytest.raises(StageSkipped, match="law vdps could not be calibrated"):
            run(RESONANCE["resonance-vdps"])
    finally:
        monkeypatch.undo()
        run(calibrate.STAGE, {"calibrate": SMALL})


@pytest.mark.property
@pytest.mark.parametrize("stage", [SIMULATE["simulate-passive-on"], RESONANCE["resonance-passive-on"]])
def test_a_law_without_a_force_is_skipped_with_a_perfect_damper(run, stage):
    with pytest.raises(StageSkipped, match=r"law passive-on commands the drive, so that a perfect damper"):
        run(stage, {"simulate": {"tracking": "ideal"}})


@pytest.mark.property
def test_an_implausible_base_amplitude_is_reported() -> None:
    assert amplitude_warning(0.8) == ""
    said = amplitude_warning(18.0)
    assert "an amplitude of 18 m/s², more than 9.81 m/s²" in said
    assert "simulate.excitation.base_amplitude_m_s2" in said


@pytest.mark.property
def test_a_record_in_the_wrong_unit_is_reported() -> None:
    """A record in cm/s^2 without a header, read as m/s^2, has peaks of tens of g."""
    assert record_warning({"kind": "recorded", "peak_m_s2": 12.0}) == record_warning({"peak_n": 3.0e4}) == ""
    said = record_warning({"kind": "recorded", "peak_m_s2": 152.0})
    assert "has a peak of 152 m/s², more than 29.4 m/s² (3 g)" in said
    assert "simulate.excitation.file_unit" in said


@pytest.mark.property
def test_a_drive_beyond_the_model_of_the_damper_is_reported() -> None:
    set_c = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    assert drive_warning(set_c, None) == drive_warning(set_c, 4.0) == ""
    assert "drive_limit is 8 A, and the model of the damper is valid up to 4 A" in drive_warning(set_c, 8.0)
