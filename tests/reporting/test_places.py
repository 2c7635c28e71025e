"""Floors and directions from the names of degrees of freedom."""

from __future__ import annotations

import pytest

from mrpipe.reporting.places import by_direction, is_chain, size_in_words

pytestmark = pytest.mark.property

TORSION = [f"floor {floor} {axis}" for floor in (1, 2) for axis in ("x", "y", "rotation")]


def test_floors_in_one_direction_are_a_chain() -> None:
    assert by_direction(["floor 1", "floor 2"]) == {"": {1: 0, 2: 1}}
    assert is_chain(["floor 1", "floor 2"]) and size_in_words(["floor 1", "floor 2"]) == "2 floors"
    assert size_in_words(["floor 1"]) == "1 floor"


def test_rotations_are_no_floors() -> None:
    found = by_direction(TORSION)
    assert found == {"x": {1: 0, 2: 3}, "y": {1: 1, 2: 4}, "rotation": {1: 2, 2: 5}}
    assert not is_chain(TORSION)
    assert size_in_words(TORSION) == "2 floors with 6 degrees of freedom"


def test_amplitudes_of_modes_are_at_no_place() -> None:
    reduced = ["floor 3", "floor 12", "mode 1"]
    assert by_direction(reduced) == {"": {3: 0, 12: 1}}
    assert not is_chain(reduced) and size_in_words(reduced) == "3 degrees of freedom"


@pytest.mark.parametrize("names", [["deck x", "pier"], ["floor 1", "roof"], ["floor 1", "floor 1"]])
def test_other_names_tell_no_place(names: list[str]) -> None:
    assert by_direction(names) is None and not is_chain(names)
    assert size_in_words(names) == "2 degrees of freedom"
