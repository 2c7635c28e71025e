"""Degrees of freedom that settings name are checked before the matrices of the structure are computed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.structures.named import require_places
from mrpipe.structures.options import StructureSettings

pytestmark = pytest.mark.property

STOREYS = [{"mass_kg": 1.0, "stiffness_n_m": 100.0, "repeat": 3}]
FLOORS = ("floor 1", "floor 2", "floor 3")


def read(_: Path, name: str) -> Any:
    """Return a matrix of three degrees of freedom, or a column of three storeys."""
    return np.ones(3) if name == "mass" else np.eye(3)


@pytest.mark.parametrize(
    "given",
    [
        {"storeys": STOREYS},
        {"storey_table": {"mass": {"values": [1.0, 1.0, 1.0]}}},
        {"storey_table": {"file": "table.csv"}},
        {"file": "model.mat"},
        {"mass": {"file": "m.csv", "name": ""}},
        {"mode_shapes": np.eye(3).tolist()},
    ],
)
def test_names_of_every_kind_of_structure(given: dict[str, Any]) -> None:
    assert require_places(StructureSettings(**given), read) == FLOORS
    named = StructureSettings(**given, degrees_of_freedom=("a", "b", "c"))
    assert require_places(named, read) == ("a", "b", "c")


def test_a_parameter_set_has_its_floors_and_a_script_is_not_run() -> None:
    assert len(require_places(StructureSettings(frame="thesis"), read)) == 5
    assert require_places(StructureSettings(file="model.py"), read) == ()
    assert require_places(StructureSettings(file="model.py", dampers=({"between": ("x", "y")},)), read) == ()


@pytest.mark.parametrize(
    ("part", "where", "said"),
    [
        ({"dampers": [{"between": [1, "ground"]}, {"between": ["floor 4", 1]}]}, "structure.dampers[1].between",
         "'floor 4' is not a degree of freedom; 1 to 3, or one of floor 1, floor 2, floor 3"),
        ({"dampers": [{"between": [2, "floor 2"]}]}, "structure.dampers[0].between", "to itself"),
        ({"dampers": [{"between": [4, 3]}]}, "structure.dampers[0].between", "'4' is not a degree of freedom"),
        ({"accelerometers": [1, "roof"]}, "structure.accelerometers[1]", "'roof' is not a degree of freedom"),
        ({"reduction": {"method": "guyan", "keep": ["deck"]}}, "structure.reduction.keep[0]", "'deck' is not a degree"),
        ({"reduction": {"method": "modal"}}, "structure.reduction", "keep: is empty"),
        ({"degrees_of_freedom": ["a", "b"]}, "structure",
         "degrees_of_freedom: has 2 entries; the structure has 3 degrees of freedom"),
        ({"influence": [1.0]}, "structure", "influence: has 1 entry; the structure has 3 degrees of freedom"),
        ({"reduction": {"method": "guyan", "keep": [1, 3]}, "dampers": [{"between": ["floor 2", 1]}]},
         "structure.dampers[0].between", "'floor 2' is not a degree of freedom; 1 to 2, or one of floor 1, floor 3"),
    ],
)  # fmt: skip
def test_a_place_that_does_not_exist_is_named_with_its_setting(part: dict[str, Any], where: str, said: str) -> None:
    with pytest.raises(UserError) as refused:
        require_places(StructureSettings(storeys=STOREYS, **part), read)
    assert refused.value.source == where and said in str(refused.value)


def test_places_after_a_reduction() -> None:
    reduction = {"method": "craig-bampton", "keep": [3, 1], "modes": 1}
    settings = StructureSettings(storeys=STOREYS, reduction=reduction, dampers=({"between": (2, "ground")},))
    assert require_places(settings, read) == ("floor 1", "floor 3", "mode 1")
    balanced = StructureSettings(storeys=STOREYS, reduction={"method": "balanced", "keep": [1], "modes": 2})
    assert require_places(balanced, read) == ("floor 1", "mode 1")


def test_an_unknown_parameter_set_is_named_with_its_setting() -> None:
    with pytest.raises(UserError, match=r"structure.frame: no such frame 'nix'; a YAML file, or one of the known sets"):
        require_places(StructureSettings(frame="nix"), read)
