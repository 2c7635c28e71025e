"""A unit that the user does not state is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.structures.given import structure_from_settings
from mrpipe.structures.given_units import input_units, unit_of_column
from mrpipe.structures.options import StoreyColumn, StructureSettings

pytestmark = pytest.mark.property

MATRICES = {"M": 2.0 * np.eye(2), "K": np.array([[300.0, -100.0], [-100.0, 100.0]]), "C": 0.1 * np.eye(2)}
TABLE = {"m": np.array([2.0, 2.0]), "k [kN/mm]": np.array([3.0, 3.0]), "h": np.array([3.0, 3.0])}


def read(_: Path, name: str) -> Any:
    return {**MATRICES, **TABLE}[name]


def warnings_of(**given: Any) -> list[str]:
    found: list[str] = []
    structure_from_settings(StructureSettings(**given), read, warn=found.append)
    return found


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "the mass is taken in kg and the stiffness is taken in N/m, because structure.mass.unit and "
             "structure.stiffness.unit are not given"),
        ({"mass": {"name": "M", "unit": "kg"}},
         "the stiffness is taken in N/m, because structure.stiffness.unit is not given"),
        ({"mass": {"name": "M", "unit": "t"}, "stiffness": {"name": "K", "unit": "kN/m"}, "damping": {"name": "C"}},
         "the damping is taken in N*s/m, because structure.damping.unit is not given"),
    ],
)  # fmt: skip
def test_matrices_without_a_unit_are_named(given: dict[str, Any], said: str) -> None:
    assert warnings_of(file="model.mat", **given) == [said]


def test_stated_units_give_no_warning() -> None:
    units = {"mass": {"name": "M", "unit": "t"}, "stiffness": {"name": "K", "unit": "kN/m"}}
    assert warnings_of(file="model.mat", **units) == []
    assert input_units(StructureSettings(file="model.mat", **units)) == {
        "mass": {"unit": "t", "assumed": False},
        "stiffness": {"unit": "kN/m", "assumed": False},
    }
    storeys = ({"mass_kg": 1.0, "stiffness_n_m": 100.0},)
    assert warnings_of(storeys=storeys) == [] and input_units(StructureSettings(storeys=storeys)) == {}


def test_a_column_may_state_its_unit_in_its_name() -> None:
    table = {"file": "t.csv", "mass": {"name": "m"}, "stiffness": {"name": "k [kN/mm]"}, "height": {"name": "h"}}
    assert warnings_of(storey_table=table) == [
        "the mass is taken in kg and the height is taken in m, because structure.storey_table.mass.unit and "
        "structure.storey_table.height.unit are not given"
    ]
    with pytest.raises(UserError, match="is N/m, and the column is called"):
        unit_of_column(StoreyColumn(name="k [kN/mm]", unit="N/m"), "structure.storey_table.stiffness")
