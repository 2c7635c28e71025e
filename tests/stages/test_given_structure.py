"""`identify-frame` and `calibrate` on a structure that the configuration gives, without a frame campaign."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from scipy.io import savemat

from mrpipe.artifacts import Artifact
from mrpipe.cli import run
from mrpipe.config.loader import load_config
from mrpipe.stages.registry import stages_for
from mrpipe.structures import natural_modes, read_frame, shear_frame

pytestmark = pytest.mark.property

MASSES = np.array([25.0, 20.0, 15.0])
STIFFNESSES = np.array([3.0e4, 2.0e4, 2.0e4])
RATIOS = np.array([0.005, 0.01, 0.01])
FRAME = shear_frame(MASSES, STIFFNESSES, RATIOS, name="truth", source="test")
STOREYS = [
    {"mass_kg": float(mass), "stiffness_n_m": float(stiffness)}
    for mass, stiffness in zip(MASSES, STIFFNESSES, strict=True)
]


def configured(folder: Path, **structure: Any) -> Path:
    path = folder / "rig.yaml"
    content = {
        "campaigns": {"bench": None, "frame": None, "closed_loop": None},
        "structure": {"damping_ratio": [0.005, 0.01], **structure},
        "calibrate": {"damper": "set-c", "expected_amplitude_m": 0.01},
    }
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def result_of(path: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    status = run(["identify-frame", "--config", str(path), "--run", str(path.parent / "run"), "--json", "--quiet"])
    shown = capsys.readouterr()
    assert status == 0, shown.err
    return json.loads(shown.out)  # type: ignore[no-any-return]


def error_of(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    status = run(["identify-frame", "--config", str(path), "--run", str(path.parent / "run"), "--quiet"])
    shown = capsys.readouterr()
    assert status == 2
    lines = [line for line in shown.err.splitlines() if line.strip()]
    assert len(lines) == 1, shown.err
    return lines[0]


def assert_is_the_frame(result: dict[str, Any], folder: Path) -> None:
    np.testing.assert_allclose(result["mass"], FRAME.mass, rtol=1e-12)
    np.testing.assert_allclose(result["stiffness"], FRAME.stiffness, rtol=1e-12)
    np.testing.assert_allclose(result["damping"], FRAME.damping, rtol=1e-9)
    np.testing.assert_allclose(result["frequencies_hz"], natural_modes(FRAME).frequencies_hz, rtol=1e-9)
    np.testing.assert_allclose(result["damping_ratios"], RATIOS, rtol=1e-9)
    np.testing.assert_allclose(result["mac"], 1.0, rtol=1e-9)
    np.testing.assert_allclose(np.abs(result["mode_shapes"]).max(axis=0), 1.0)
    stored = read_frame(Artifact(folder / "run" / "frame.h5"))
    np.testing.assert_allclose(stored.stiffness, FRAME.stiffness, rtol=1e-12)


def test_storey_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = result_of(configured(tmp_path, storeys=STOREYS), capsys)
    assert_is_the_frame(result, tmp_path)
    assert result["degrees_of_freedom"] == ["floor 1", "floor 2", "floor 3"]
    assert result["reduction_error"] == 0.0
    assert result["heights_m"] is None


def test_heights_of_storeys(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    storeys = [{**row, "height_m": height} for row, height in zip(STOREYS, (0.5, 0.3, 0.3), strict=True)]
    assert result_of(configured(tmp_path, storeys=storeys), capsys)["heights_m"] == pytest.approx([0.5, 0.8, 1.1])


def test_matrices_of_a_matlab_file_with_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    savemat(tmp_path / "model.mat", {"M": 1e-3 * FRAME.mass, "K": 1e-3 * FRAME.stiffness, "C": FRAME.damping})
    path = configured(
        tmp_path,
        file="model.mat",
        mass={"name": "M", "unit": "t"},
        stiffness={"name": "K", "unit": "kN/m"},
        damping={"name": "C"},
    )
    assert_is_the_frame(result_of(path, capsys), tmp_path)


def test_matrices_of_csv_files_without_header(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.savetxt(tmp_path / "mass.csv", FRAME.mass, delimiter=",", fmt="%.17g")
    np.savetxt(tmp_path / "stiffness.csv", FRAME.stiffness, delimiter=",", fmt="%.17g")
    path = configured(tmp_path, mass={"file": "mass.csv"}, stiffness={"file": "stiffness.csv"})
    assert_is_the_frame(result_of(path, capsys), tmp_path)


def test_matrices_of_hdf5_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with h5py.File(tmp_path / "model.h5", "w") as handle:
        handle["model/M"], handle["model/K"] = FRAME.mass, FRAME.stiffness
    path = configured(tmp_path, file="model.h5", mass={"name": "model/M"}, stiffness={"name": "model/K"})
    assert_is_the_frame(result_of(path, capsys), tmp_path)
    content = {"M": FRAME.mass.tolist(), "K": FRAME.stiffness.tolist()}
    (tmp_path / "model.json").write_text(json.dumps(content), encoding="utf-8")
    assert_is_the_frame(result_of(configured(tmp_path, file="model.json"), capsys), tmp_path)


def test_small_csv_of_whole_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mass.csv").write_text("2,0\n0,1\n", encoding="utf-8")
    (tmp_path / "stiffness.csv").write_text("300,-100\n-100,100\n", encoding="utf-8")
    result = result_of(configured(tmp_path, mass={"file": "mass.csv"}, stiffness={"file": "stiffness.csv"}), capsys)
    assert result["mass"] == [[2.0, 0.0], [0.0, 1.0]]
    assert result["stiffness"] == [[300.0, -100.0], [-100.0, 100.0]]


def test_an_edited_file_makes_the_result_stale(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for factor in (1.0, 4.0):
        savemat(tmp_path / "model.mat", {"M": FRAME.mass, "K": factor * FRAME.stiffness})
        result = result_of(configured(tmp_path, file="model.mat"), capsys)
        expected = np.sqrt(factor) * natural_modes(FRAME).frequencies_hz
        np.testing.assert_allclose(result["frequencies_hz"], expected, rtol=1e-9)


def test_reduction_states_its_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    storeys = [{"mass_kg": 5.0e3, "stiffness_n_m": 9.0e6, "repeat": 10}]
    reduction = {"method": "craig-bampton", "keep": ["1", "floor 10"], "modes": 3}
    result = result_of(configured(tmp_path, storeys=storeys, reduction=reduction), capsys)
    assert len(result["frequencies_hz"]) == 5
    assert result["full_degrees_of_freedom"] == 10
    assert result["degrees_of_freedom"][:2] == ["floor 1", "floor 10"]
    assert 0.0 < result["reduction_error"] < 0.05
    assert any("from 10 to 5 degrees of freedom" in line for line in result["warnings"])


@pytest.mark.parametrize(
    ("structure", "words"),
    [
        ({"file": "missing.mat"}, ("missing.mat", "not found", "`structure`")),
        ({"file": "model.mat", "mass": {"name": "Mass"}}, ("model.mat", "Mass", "it holds")),
        ({"file": "broken.mat"}, ("broken.mat", "damaged")),
        ({"file": "model.mat", "stiffness": {"name": "K", "unit": "kg"}}, ("structure.stiffness.unit", "kg")),
        ({"file": "model.mat", "storeys": STOREYS}, ("structure", "2 times")),
        ({"file": "model.mat", "stiffness": {"name": "free"}}, ("structure", "positive definite")),
        ({"storeys": STOREYS, "reduction": {"method": "guyan"}}, ("structure.reduction", "keep")),
        ({"storeys": STOREYS, "reduction": {"method": "guyan", "keep": ["roof"]}}, ("roof", "degree of freedom")),
        (
            {"storeys": STOREYS, "reduction": {"method": "lanczos", "keep": ["1"]}},
            ("method", "craig-bampton", "balanced"),
        ),
    ],
)
def test_a_wrong_structure_is_one_line(
    structure: dict[str, Any], words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    free = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    savemat(tmp_path / "model.mat", {"M": FRAME.mass, "K": FRAME.stiffness, "free": 1e4 * free})
    (tmp_path / "broken.mat").write_bytes(b"no matlab file")
    line = error_of(configured(tmp_path, **structure), capsys)
    for word in words:
        assert word in line
    assert not (tmp_path / "run" / "frame.h5").exists()


def test_the_stages_of_the_example_need_no_campaign() -> None:
    configuration = load_config(Path("structure-example")).config
    stages = {name: stage.for_configuration(configuration) for name, stage in stages_for(configuration).items()}
    assert stages["identify-frame"].inputs == ()
    assert stages["calibrate"].inputs == ("identify-frame",)


def test_the_example_is_valid(capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["check", "structure-example"])
    shown = capsys.readouterr()
    assert status == 0, shown.err
    assert "will be skipped" not in shown.out


def test_a_campaign_on_the_command_line_is_identified() -> None:
    configuration = load_config(Path("structure-example")).config
    assert stages_for(configuration, "frame")["identify-frame"].inputs == ("campaign:frame",)


def test_calibrate_needs_the_bench_where_the_amplitude_or_the_damper_comes_from_it() -> None:
    for override in ("calibrate.expected_amplitude_m=null", "calibrate.damper=identified"):
        configuration = load_config(Path("structure-example"), [override]).config
        stage = stages_for(configuration)["calibrate"].for_configuration(configuration)
        assert stage.inputs == ("identify-frame", "identify-damper")
    both = ["calibrate.expected_amplitude_m=null", "calibrate.damper=identified"]
    configuration = load_config(Path("structure-example"), both).config
    stage = stages_for(configuration)["calibrate"].for_configuration(configuration)
    assert stage.inputs.count("identify-damper") == 1


def test_calibrate_runs_on_a_given_structure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = configured(tmp_path, storeys=STOREYS)
    status = run(["calibrate", "--config", str(path), "--run", str(tmp_path / "run"), "--json", "--quiet"])
    shown = capsys.readouterr()
    assert status == 0, shown.err
    assert json.loads(shown.out)["laws"]


@pytest.mark.property
def test_the_amplitude_along_a_direction_is_that_of_its_own_top(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Equal structures in x and y, coupled by nothing: motion along y with the damper in y is motion along x."""
    storeys = [[2.0, -1.0], [-1.0, 1.0]]
    np.savetxt(tmp_path / "M.csv", 25.0 * np.eye(4), delimiter=",")
    np.savetxt(tmp_path / "K.csv", 3e4 * np.kron(np.diag([1.0, 1.1]), storeys), delimiter=",")
    content = {
        "campaigns": {"bench": None, "frame": None, "closed_loop": None},
        "structure": {
            "mass": {"file": "M.csv", "name": ""},
            "stiffness": {"file": "K.csv", "name": ""},
            "influence": [1, 1, 0, 0],
            "influence_y": [0, 0, 1, 1],
        },
        "calibrate": {"damper": "set-c", "expected_amplitude_m": 0.01, "damper_floor": 3, "target_mode": 2},
        "simulate": {
            "damper": "set-c",
            "controller": {"inverse": "model"},
            "excitation": {"direction_deg": 90.0, "cycles": 20, "settling_cycles": 10, "decay_s": 0.0},
        },
    }
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    common = ["--config", str(tmp_path / "rig.yaml"), "--run", str(tmp_path / "run"), "--json", "--quiet"]
    assert run(["simulate", "--law", "vd", *common]) == 0
    found = json.loads(capsys.readouterr().out)
    shape = np.linalg.eigh(np.array(storeys))[1][:, 0]
    assert found["rms_x_top_m"] == pytest.approx(0.01 * shape[1] / shape[0] / np.sqrt(2.0), rel=0.01)
    assert found["excitation"]["direction_deg"] == 90.0


def test_a_damper_of_a_parameter_set_is_exported_without_a_bench_campaign(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ["--config", str(configured(tmp_path, storeys=STOREYS)), "--run", str(tmp_path / "run")]
    given = ["--set", "simulate.damper=set-c", "--format", "json", "--json", "--quiet"]
    assert run(["export", "damper", *common, *given]) == 0
    capsys.readouterr()
    assert (tmp_path / "run" / "export" / "damper" / "damper.json").is_file()


def test_everything_is_exported_for_which_there_are_data(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a bench campaign there are no networks; the command had ended with an error after writing the rest."""
    common = ["--config", str(configured(tmp_path, storeys=STOREYS)), "--run", str(tmp_path / "run")]
    given = ["--set", "simulate.damper=set-c", "--set", "simulate.controller.inverse=model", "--format", "json"]
    assert run(["export", "all", *common, *given, "--json", "--quiet"]) == 0
    printed = capsys.readouterr()
    assert {"export-damper", "export-frame", "export-controller"} <= set(json.loads(printed.out))
    assert "export-forward is left out: " in printed.err and "export-inverse is left out: " in printed.err
    assert run(["export", "forward", *common, *given, "--quiet"]) == 2
    assert "campaigns.bench: is null, and export-forward reads a bench campaign; " in capsys.readouterr().err
