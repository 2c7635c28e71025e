"""Units at the border."""

from __future__ import annotations

import time

import pytest

from mrpipe.errors import UserError
from mrpipe.units import bracketed_units, conversion, same_dimension, to_si

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


@pytest.mark.property
@pytest.mark.parametrize(("unit", "quantity", "factor"), FACTORS)
def test_unit_that_people_write(unit: str, quantity: str, factor: float) -> None:
    assert conversion(unit, quantity=quantity) == pytest.approx(factor, rel=1e-12)
    assert to_si([2.0], unit, quantity=quantity)[0] == pytest.approx(2 * factor, rel=1e-12)


@pytest.mark.property
@pytest.mark.parametrize("unit", ["newtonish", "3 bananas", "N N )"])
def test_unknown_unit_is_told_with_its_place(unit: str) -> None:
    with pytest.raises(UserError, match=r"campaign.yaml: channels.force: .*is not a unit"):
        conversion(unit, where="campaign.yaml: channels.force", quantity="force")


@pytest.mark.property
def test_unit_of_another_quantity_is_refused() -> None:
    with pytest.raises(UserError, match="is not a unit of force; write one such as N"):
        conversion("mm", where="campaign.yaml", quantity="force")


@pytest.mark.property
def test_current_and_voltage_are_told_apart() -> None:
    assert same_dimension("mA", "current")
    assert not same_dimension("V", "current")


@pytest.mark.property
@pytest.mark.parametrize(
    "unit", ["9**9**9**9 N", "9^9", "1e9 N", "N**99", "x" * 79, "x" * 5000, "mm " * 26, "__import__('os')", "(" * 40]
)
def test_a_unit_is_never_evaluated_as_an_expression(unit: str) -> None:
    begun = time.monotonic()
    with pytest.raises(UserError, match="is not a unit"):
        conversion(unit, quantity="force")
    assert time.monotonic() - begun < 2.0


@pytest.mark.golden
@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("m/s2", 1.0),
        ("mm/s²", 1e-3),
        ("m s^-2", 1.0),
        ("kN*s/m/V", 1e3),
        ("N/m/A^3", 1.0),
        ("t*m^2", 1e3),
        ("N·m", 1.0),
        ("N/(m/s)", 1.0),
        ("1/m^2", 1.0),
        ("Newton", 1.0),
        ("µm", 1e-6),
    ],
)
def test_compound_units_as_people_write_them(unit: str, factor: float) -> None:
    assert conversion(unit) == pytest.approx(factor, rel=1e-12)


@pytest.mark.golden
@pytest.mark.parametrize(("unit", "meant"), [("kn", "kN"), ("KN", "kN"), ("mn", "MN")])
def test_a_unit_in_the_wrong_case_names_the_right_one(unit: str, meant: str) -> None:
    with pytest.raises(UserError, match=f"did you mean {meant}"):
        conversion(unit, quantity="force")


@pytest.mark.golden
def test_a_kilopond_is_the_weight_of_a_kilogram() -> None:
    assert conversion("kp", quantity="force") == pytest.approx(9.80665)


@pytest.mark.golden
@pytest.mark.parametrize(("unit", "meant"), [("kg", "kgf"), ("lbs", "lbf"), ("lb", "lbf"), ("t", "tf")])
def test_a_load_cell_that_counts_in_a_mass_is_offered_its_weight(unit: str, meant: str) -> None:
    with pytest.raises(UserError, match=rf"did you mean {meant}\?"):
        conversion(unit, quantity="force")
    assert same_dimension(meant, "force")


@pytest.mark.property
@pytest.mark.parametrize("unit", ["N/mm", "mm", "kNm", "s", "mA"])
def test_a_unit_that_is_offered_is_one_of_the_quantity(unit: str) -> None:
    with pytest.raises(UserError) as told:
        conversion(unit, quantity="force")
    offered = str(told.value).rpartition(" ")[2].strip("?")
    assert same_dimension(offered, "force")


@pytest.mark.property
@pytest.mark.parametrize(
    ("text", "units"),
    [
        ("force [kN]", ["kN"]),
        ("time (s), acceleration ( cm/s^2 )", ["s", "cm/s^2"]),
        ("damping {N/(m/s)} of <mm>", ["N/(m/s)", "mm"]),
        ("force [channel 3] (upper floor)", []),
        ("force [], force", []),
    ],
)
def test_units_in_brackets_are_found_and_remarks_are_not(text: str, units: list[str]) -> None:
    found = bracketed_units(text)
    assert [item.unit for item in found] == units
    assert all(text[item.start + 1 : item.end - 1].strip() == item.unit for item in found)


@pytest.mark.property
@pytest.mark.parametrize("unit", ["degC", "celsius", "degF"])
def test_scale_of_temperature_has_no_factor(unit: str) -> None:
    with pytest.raises(UserError, match="has no factor to SI"):
        conversion(unit)
    assert conversion("K") == 1.0
