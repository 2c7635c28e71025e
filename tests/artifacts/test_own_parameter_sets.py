"""A parameter set of the user that is wrong is refused in one line with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.artifacts import load_parameter_set, require_parameter_set
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

GOOD = "name: own\nmodel: bingham\nsource: me\nparameters:\n  drive_limit: {value: 4, unit: A}\n"
MISTAKES = {
    "empty": ("", "is empty; write `key: value` lines"),
    "list": ("- a\n", "line 1: is not a mapping"),
    "tab": (GOOD.replace("  drive", "\tdrive"), "line 5: not valid YAML (a tab)"),
    "no model": (GOOD.replace("model: bingham\n", ""), "model: is missing; write model: ... as the sets of configs/"),
    "no source": (GOOD.replace("source: me\n", "source:\n"), "source: is missing"),
    "no parameters": (GOOD.split("parameters")[0], "parameters: is missing"),
    "list of parameters": (GOOD.split("  drive")[0] + "  - a\n", "line 4, parameters: is not a mapping"),
    "no unit": (GOOD.replace(", unit: A", ""), "line 5, parameters.drive_limit: has no value or no unit"),
    "text": (GOOD.replace("value: 4", "value: four"), "line 5, parameters.drive_limit.value: is 'four'; a number"),
    "comma": (GOOD.replace("value: 4", "value: '4,5'"), "line 5, parameters.drive_limit.value: is '4,5'; a number"),
    "uneven": (GOOD.replace("value: 4", "value: [[1], [1, 2]]"), "parameters.drive_limit.value: is [[1], [1, 2]]"),
    "infinite": (GOOD.replace("value: 4", "value: .inf"), "line 5, parameters.drive_limit.value: is not finite"),
    "unknown unit": (GOOD.replace("unit: A", "unit: AA"), "line 5, parameters.drive_limit.unit"),
    "latin": (GOOD.replace("me", "Müller").encode("latin-1"), "is not UTF-8 text"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_set_is_refused(mistake: str, tmp_path: Path) -> None:
    content, said = MISTAKES[mistake]
    path = tmp_path / "own.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(UserError) as refused:
        load_parameter_set("dampers", path)
    assert said in str(refused.value) and "own.yaml" in str(refused.value)


def test_several_values_for_a_parameter_of_a_damper_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "own.yaml"
    path.write_text(GOOD.replace("value: 4", "value: [4, 5]"), encoding="utf-8")
    with pytest.raises(UserError, match=r"parameters.drive_limit: has 2 values; give one number"):
        damper_from_parameter_set(load_parameter_set("dampers", path))


def test_a_set_that_is_not_there_is_named_with_its_setting(tmp_path: Path) -> None:
    require_parameter_set("frames", "thesis", "simulate.frame")
    with pytest.raises(UserError, match=r"^simulate.frame: no such frame 'x'; identified, a YAML file, or one of the "):
        require_parameter_set("frames", "x", "simulate.frame", "identified")
