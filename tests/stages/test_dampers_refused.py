"""Settings of a structure and its dampers that are wrong: named with file and line before anything is built."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from mrpipe.cli import run

pytestmark = pytest.mark.planted

STOREYS = {"storeys": [{"mass_kg": 1000.0, "stiffness_n_m": 2.0e6, "repeat": 3}]}
DAMPERS = [
    {"name": "base", "between": [1, "ground"], "law": "vd"},
    {"name": "second", "between": [2, 1], "law": "vdps", "gains": {"k_n_m": 2.0e6}},
]
MISTAKES: dict[str, tuple[int, dict[str, Any], str]] = {
    "law": (1, {"law": "vdd"}, "structure.dampers[1].law: 'vdd' is not a control law; did you mean vd?"),
    "network": (0, {"law": "nnc"}, "structure.dampers[0].law: law nnc needs a network"),
    "gain": (
        1,
        {"gains": {"c_n_m": 1.0}},
        "structure.dampers[1].gains.c_n_m: law vdps has no such gain; it has: c_n_s_m, k",
    ),
    "model": (
        0,
        {"damper": "set-d"},
        "structure.dampers[0].damper: no such damper 'set-d'; identified, a file, or one",
    ),
    "place": (
        1,
        {"between": [2, "roof"]},
        "structure.dampers[1].between: 'roof' is not a degree of freedom; 1 to 3, or one of floor 1, floor 2, floor 3",
    ),
    "same place": (0, {"between": [1, "floor 1"]}, "structure.dampers[0].between, 1 to floor 1: connects a degree of"),
    "artifact": (0, {"damper": "no.h5"}, "structure.dampers[0].damper: no such artifact no.h5; name an existing file"),
}


def _refused(folder: Path, content: dict[str, Any], command: str, capsys: pytest.CaptureFixture[str]) -> str:
    config = folder / "own.yaml"
    config.write_text(yaml.safe_dump(content, sort_keys=False))
    assert run([command, "--config", str(config), "--run", str(folder / "run")]) == 2
    assert not (folder / "run").exists()
    return capsys.readouterr().err


def _content(**structure: Any) -> dict[str, Any]:
    return {
        "stages": ["identify-frame", "calibrate"],
        "campaigns": {"bench": None, "frame": None, "closed_loop": None},
        "structure": structure,
        "calibrate": {"damper": "set-c", "expected_amplitude_m": 0.01},
    }


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_damper_is_named_with_its_line(
    mistake: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place, change, said = MISTAKES[mistake]
    dampers = [{**entry, **(change if place == index else {})} for index, entry in enumerate(DAMPERS)]
    content = _content(**STOREYS, dampers=dampers)
    lines = yaml.safe_dump(content, sort_keys=False).splitlines()
    key = next(iter(change))
    first = next(number for number, line in enumerate(lines, 1) if line.endswith(f"name: {DAMPERS[place]['name']}"))
    key = next(iter(change["gains"])) if key == "gains" else key
    wanted = next(number for number, line in enumerate(lines, 1) if number > first and line.strip().startswith(key))
    for command in ("check", "calibrate", "simulate", "design"):
        error = _refused(tmp_path, content, command, capsys)
        assert f"line {wanted}, {said}" in error


@pytest.mark.parametrize("dampers", [[], DAMPERS])
def test_an_unknown_damper_of_calibrate_is_named_with_its_line(
    dampers: list[Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = _content(**STOREYS, dampers=dampers)
    content["calibrate"]["damper"] = "set-d"
    error = _refused(tmp_path, content, "check", capsys)
    assert "calibrate.damper: no such damper 'set-d'; identified, a file, or one of the known sets" in error
    assert f"line {len(yaml.safe_dump(content).splitlines()) - 1}" in error


@pytest.mark.parametrize(
    "part", [{"mass": {"name": "M", "unit": "t"}}, {"damping_ratio": [0.02]}, {"influence": [1.0]}]
)
def test_a_described_structure_without_its_matrices_is_not_replaced_by_an_identified_one(
    part: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = _content(**part)
    # the virtual laboratory would otherwise give the frame
    content["campaigns"]["frame"] = "laboratory"
    for command in ("check", "identify-frame"):
        error = _refused(tmp_path, content, command, capsys)
        assert "line 8, structure: describes a structure, but no file, parameter set, storeys or modes; give" in error


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ({"weights": {"rms_x9_m": 1.0}}, "line 4, design.weights.rms_x9_m: is not a quantity; one of rms_x_top_m"),
        ({"fixed_gains": {"vdd": {}}}, "line 4, design.fixed_gains.vdd: is not a control law; one of vd"),
        (
            {"fixed_gains": {"vd": {"k_n_m": 1.0}}},
            "design.fixed_gains.vd.k_n_m: law vd has no such gain; it has: c_n_s_m",
        ),
        ({"band_rad_s": [9.0, 7.0]}, "line 3, design.band_rad_s: is 9 to 7; give a positive rising band"),
    ],
)
@pytest.mark.parametrize("dampers", [[], DAMPERS])
def test_wrong_settings_of_the_design_are_named_before_anything_is_built(
    dampers: list[Any], setting: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rest = _content(**STOREYS, dampers=dampers)
    rest |= {"stages": ["design"], "simulate": {"damper": "set-c", "controller": {"inverse": "model"}}}
    content = {"name": "own", "design": setting, **rest}
    for command in ("check", "run", "design"):
        assert said in _refused(tmp_path, content, command, capsys)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ({"damper": "set-d"}, "line 2, simulate.damper: no such damper 'set-d'; identified, traced, a file, or one of"),
        ({"damper": "no.h5"}, "line 2, simulate.damper: no such artifact no.h5; name an existing file, or identified"),
        ({"frame": "tower"}, "line 2, simulate.frame: no such frame 'tower'; identified, a YAML file, or one of"),
    ],
)
def test_an_unknown_damper_or_frame_of_the_loop_is_named_before_anything_is_built(
    setting: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rest = _content(**STOREYS) | {"stages": ["identify-frame", "calibrate", "simulate-vd", "resonance-vd", "design"]}
    content = {"simulate": {"damper": "set-c", **setting, "controller": {"inverse": "model"}}, **rest}
    commands = [["check"], ["run"], ["simulate", "--law", "vd"], ["simulate", "--law", "vd", "--resonance"], ["design"]]
    if "damper" in setting:
        commands += [["export", "damper"], ["export", "controller"], ["export", "controller", "--law", "vd"]]
    config = tmp_path / "own.yaml"
    # the changed key is in the second line of the file
    lines = yaml.safe_dump({"simulate": setting}, sort_keys=False)
    content["simulate"] = {key: value for key, value in content["simulate"].items() if key not in setting}
    rest_of_loop = "".join(f"  {line}\n" for line in yaml.safe_dump(content.pop("simulate")).splitlines())
    config.write_text(lines + rest_of_loop + yaml.safe_dump(content, sort_keys=False))
    for command in commands:
        assert run([*command, "--config", str(config), "--run", str(tmp_path / "run")]) == 2
        assert said in capsys.readouterr().err, command
        assert not (tmp_path / "run").exists()
