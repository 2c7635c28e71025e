"""Several dampers from the configuration: calibration, simulation, design, and a case study written by hand."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from mrpipe.artifacts import Artifact, config_directory
from mrpipe.case_studies.gains import exact_viscous, lowest_damping, two_component
from mrpipe.case_studies.model import modal_model
from mrpipe.case_studies.run import Controller, simulate
from mrpipe.case_studies.ten_storey.structure import ten_storey
from mrpipe.cli import run
from mrpipe.control.storage import read_calibrated
from mrpipe.errors import UserError
from mrpipe.structures import storey_position

INTERVAL = 0.02
TIME = np.arange(0.0, 6.0 + INTERVAL / 2, INTERVAL)
GROUND = np.random.default_rng(7).standard_normal(TIME.size) * np.exp(-(((TIME - 2.0) / 1.5) ** 2))


def result_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    status = run([*arguments, "--json", "--quiet"])
    shown = capsys.readouterr()
    assert status == 0, shown.err
    return json.loads(shown.out)  # type: ignore[no-any-return]


def error_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    status = run([*arguments, "--quiet"])
    shown = capsys.readouterr()
    assert status == 2
    lines = [line for line in shown.err.splitlines() if line.strip()]
    assert len(lines) == 1, shown.err
    return lines[0]


@pytest.mark.oracle
def test_the_bundled_configuration_is_the_case_study_written_by_hand(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ten storeys from a .mat file with two dampers: gains, damping and response within 1e-6 of the case study.

    Both loops are of second order with different errors, so that the step is short here: 2.4e-6 remain at 8 kHz.
    """
    record = tmp_path / "ground.csv"
    np.savetxt(record, np.column_stack([TIME, GROUND]), delimiter=",", header="t,a", comments="")
    settings = {
        "simulate.tracking": "unclipped",
        "simulate.plant_rate_hz": 20000,
        "simulate.record_rate_hz": 50,
        "simulate.excitation.kind": "recorded",
        "simulate.excitation.file": record,
        "calibrate.together": "false",
    }
    common = ["--config", "two-dampers", "--run", str(tmp_path / "run")]
    common += [part for key, value in settings.items() for part in ("--set", f"{key}={value}")]
    calibrated = result_of(["calibrate", *common], capsys)
    result_of(["simulate", *common], capsys)
    c, k = ([row["gains"].get(gain, 0.0) for row in calibrated["dampers"]] for gain in ("c_n_s_m", "k_n_m"))

    # by hand: matrices, places and modal damping of the case study
    model = ten_storey("ten-storey-heavy")
    places = np.column_stack([storey_position(10, 1), storey_position(10, 5)])
    free = modal_model(model)
    for column in (0, 1):
        alone = modal_model(model.with_devices(places[:, [column]]))
        limits = two_component(alone)
        row = calibrated["dampers"][column]
        assert row["omega_0"] == pytest.approx(limits.omega_0, rel=1e-6)
        assert row["omega_inf"] == pytest.approx(limits.omega_inf, rel=1e-6)
        by_hand = exact_viscous(alone, k[column], limits.viscous(k[column]))
        expected = lowest_damping(alone, by_hand, k[column])
        assert lowest_damping(alone, c[column], k[column]) == pytest.approx(expected, rel=1e-6)
    shapes, omega = free.shapes, free.angular_frequencies
    damping = model.mass @ shapes @ np.diag(2.0 * 0.01 * omega) @ shapes.T @ model.mass
    damped = replace(model, frame=replace(model.frame, damping=damping), devices=places)
    controller = Controller("kelvin", "active", viscous=tuple(c), stiffness=tuple(k))
    by_hand_response = simulate(modal_model(damped), GROUND[:, None], INTERVAL, controller, ratio=400, save_every=400)
    artifact = Artifact(tmp_path / "run" / "response-dampers.h5")
    ours, expected_response = artifact.array("displacement"), by_hand_response.displacement()
    assert np.abs(ours - expected_response).max() < 1e-6 * np.abs(expected_response).max()
    strokes = np.column_stack([artifact.array(f"dampers/{place}/damper_displacement") for place in (1, 2)])
    assert np.abs(strokes - by_hand_response.stroke()).max() < 1e-6 * np.abs(expected_response).max()


def two_storeys(folder: Path, dampers: list[dict[str, Any]], count: int = 2, **more: Any) -> Path:
    path = folder / "rig.yaml"
    content = {
        "campaigns": {"bench": None, "frame": None, "closed_loop": None},
        "structure": {"storeys": [{"mass_kg": 25.0, "stiffness_n_m": 3.0e4, "repeat": count}], "dampers": dampers},
        "calibrate": {"damper": "set-c", "expected_amplitude_m": 0.01},
        **more,
    }
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


@pytest.mark.property
@pytest.mark.parametrize("what", ["controller", "damper", "frame"])
def test_exports_of_one_damper_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], what: str) -> None:
    path = two_storeys(tmp_path, [{"between": [1, "ground"], "law": "vd"}])
    common = ["--config", str(path), "--run", str(tmp_path / "run")]
    refused = error_of(["export", what, *common], capsys)
    assert "is not supported with structure.dampers" in refused and "calibrate.damper_floor" in refused
    assert not (tmp_path / "run").exists()


@pytest.mark.property
def test_the_opensees_script_says_that_the_dampers_are_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = two_storeys(tmp_path, [{"name": "base", "between": [1, "ground"], "law": "vd"}])
    found = result_of(["export", "opensees", "--config", str(path), "--run", str(tmp_path / "run")], capsys)
    (sentence,) = found["left_out"]
    assert "base (1 to ground, law vd)" in sentence
    assert f"# {sentence}\n" in Path(found["file"]).read_text(encoding="utf-8")


@pytest.mark.property
def test_a_design_under_a_force_says_that_it_needs_ground_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shaker = {"kind": "harmonic", "force_at": {"floor 2": 1.0}, "force_amplitude_n": 30.0}
    path = two_storeys(tmp_path, [{"between": [1, "ground"], "law": "vd"}], simulate={"excitation": shaker})
    common = ["--config", str(path), "--run", str(tmp_path / "run")]
    assert "force_at: a design is measured under motion of the ground" in error_of(["design", *common], capsys)
    path = two_storeys(tmp_path, [{"between": [1, "ground"]}], simulate={"excitation": {"force_amplitude_n": 30.0}})
    assert "but no degree of freedom on which the force acts" in error_of(["simulate", *common], capsys)


@pytest.mark.oracle
def test_design_of_two_dampers_of_which_one_has_a_brace(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With linear devices, gains and damping are those of the eigenvalues, and peaks those of the frequency response.

    The dashpot behind its brace is a state of its own here: k_b (x_2 - x_1 - y) = c y'.
    """
    brace = 4.0e4
    path = two_storeys(
        tmp_path,
        [
            {"between": [1, "ground"], "law": "vd"},
            {"between": ["floor 2", "floor 1"], "law": "vd", "brace_stiffness_n_m": brace},
        ],
        simulate={"tracking": "continuous", "plant_rate_hz": 500, "controller": {"rate_hz": 500}},
        design={"amplitude_factors": [1.0], "evaluations": 3},
        count=3,
    )
    common = ["--config", str(path), "--run", str(tmp_path / "run")]
    found = result_of(["design", *common], capsys)
    assert found["best"]["objective"] <= found["calibrated"]["objective"]
    assert set(found["dampers"]) == {"damper 1", "damper 2"}
    calibrated = result_of(["calibrate", *common], capsys)
    M, below, drift = 25.0 * np.eye(3), np.array([1.0, 0.0, 0.0]), np.array([-1.0, 1.0, 0.0])
    K = 3.0e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    values, vectors = np.linalg.eigh(K / 25.0)
    inherent = vectors @ np.diag(2.0 * 0.01 * np.sqrt(values) * 25.0) @ vectors.T

    def damping_ratios(c: list[float], damped: float) -> np.ndarray:
        A = np.zeros((7, 7))
        A[:3, 3:6] = np.eye(3)
        A[3:6, :3] = -(K + brace * np.outer(drift, drift)) / 25.0
        A[3:6, 3:6] = -(damped * inherent + c[0] * np.outer(below, below)) / 25.0
        A[3:6, 6], A[6, :3], A[6, 6] = brace * drift / 25.0, brace * drift / c[1], -brace / c[1]
        poles = np.linalg.eigvals(A)
        poles = poles[poles.imag > 1e-9]
        return np.asarray(-poles.real / np.abs(poles))[np.argsort(np.abs(poles))]

    c = [row["gains"]["c_n_s_m"] for row in calibrated["dampers"]]
    np.testing.assert_allclose(calibrated["together"]["damping_ratios"], damping_ratios(c, 1.0), rtol=1e-9)
    largest = damping_ratios(c, 0.0)[0]
    assert 0.2 < largest < 0.9
    for place, factor in ((0, 0.98), (0, 1.02), (1, 0.98), (1, 1.02)):
        moved = [item * (factor if k == place else 1.0) for k, item in enumerate(c)]
        assert damping_ratios(moved, 0.0)[0] <= largest * (1.0 + 1e-9)
    amplitude = result_of(["simulate", *common], capsys)["excitation"]["base_amplitude_m_s2"]
    best = [row["gains"]["c_n_s_m"] for row in found["dampers"].values()]
    for gains, response in ((c, found["calibrated"]), (best, found["best"])):
        omega = response["resonance_rad_s"]
        behind = 1.0 / (1.0 / brace + 1.0 / (1j * omega * gains[1]))
        dynamic = K - omega**2 * M + 1j * omega * (inherent + gains[0] * np.outer(below, below))
        x = np.linalg.solve(dynamic + behind * np.outer(drift, drift), -M @ np.ones(3))
        assert response["peak_rms_x_top_m"] == pytest.approx(amplitude * abs(x[2]) / np.sqrt(2.0), rel=1e-3)
    assert not found["starts"]["differ"]
    result_of(["report", *common], capsys)
    report = (tmp_path / "run" / "report.md").read_text(encoding="utf-8")
    assert "The gains of damper 1 (vd) and damper 2 (vd) were searched together" in report


@pytest.mark.property
@pytest.mark.parametrize(
    ("damper", "words"),
    [
        ({"between": [1, 1]}, "connects a degree of freedom to itself"),
        ({"between": ["roof", "ground"]}, "is not a degree of freedom"),
        ({"between": [1, "ground"], "law": "magic"}, "is not a control law"),
        ({"between": [1, "ground"], "law": "nnc"}, "trained for one damper"),
        ({"between": [1, "ground"], "sensors": ["acceleration"]}, "lack the displacement"),
        ({"between": [1, "ground"], "gains": {"alpha_n_m": 5.0}}, "has no such gain"),
    ],
)
def test_mistakes_are_one_line(
    damper: dict[str, Any], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = two_storeys(tmp_path, [damper])
    assert words in error_of(["calibrate", "--config", str(path), "--run", str(tmp_path / "run")], capsys)


@pytest.mark.property
def test_commands_for_one_damper_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = two_storeys(tmp_path, [{"between": [1, "ground"]}])
    common = ["--config", str(path), "--run", str(tmp_path / "run")]
    assert "each damper" in error_of(["simulate", "--law", "vd", *common], capsys)
    # whoever needs the calibration of a single damper says so
    result_of(["calibrate", *common], capsys)
    with pytest.raises(UserError, match="several dampers"):
        read_calibrated(Artifact(tmp_path / "run" / "control.h5"))


@pytest.mark.property
def test_the_matrices_of_the_bundled_file_are_those_of_the_case_study() -> None:
    from scipy.io import loadmat

    held = loadmat(config_directory() / "structures" / "ten-storey-heavy.mat")
    model = ten_storey("ten-storey-heavy")
    np.testing.assert_allclose(1e3 * held["M"], model.mass, rtol=1e-12)
    np.testing.assert_allclose(1e3 * held["K"], model.stiffness, rtol=1e-12)
