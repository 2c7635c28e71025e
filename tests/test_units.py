"""Units at the border."""

from __future__ import annotations

import pytest

from mrpipe.errors import UserError
from mrpipe.units import conversion, same_dimension, to_si

FACTORS = [
    ("mm", "displacement", 1e-3),
    ("cm", "displacement", 1e-2),
    ("um", "displacement", 1e-6),
    ("g", "acceleration", 9.80665),
    ("cm/s^2", "acceleration", 1e-2),
    ("kN", "force", 1e3),
    ("mA", "current", 1e-3),
    ("ms", "time", 1e-3),
    ("mm/s", "velocity", 1e-3),
]


@pytest.mark.parametrize(("unit", "quantity", "factor"), FACTORS)
def test_unit_that_people_write(unit: str, quantity: str, factor: float) -> None:
    assert conversion(unit, quantity=quantity) == pytest.approx(factor, rel=1e-12)
    assert to_si([2.0], unit, quantity=quantity)[0] == pytest.approx(2 * factor, rel=1e-12)


@pytest.mark.parametrize("unit", ["newtonish", "3 bananas", "N N )"])
def test_unknown_unit_is_told_with_its_place(unit: str) -> None:
    with pytest.raises(UserError, match=r"campaign.yaml: channels.force: .*is not a unit"):
        conversion(unit, where="campaign.yaml: channels.force", quantity="force")


def test_unit_of_another_quantity_is_refused() -> None:
    with pytest.raises(UserError, match="is no unit of force; write one such as N"):
        conversion("mm", where="campaign.yaml", quantity="force")


def test_current_and_voltage_are_told_apart() -> None:
    assert same_dimension("mA", "current")
    assert not same_dimension("V", "current")
