"""Numbers and names as the report writes them."""

from __future__ import annotations

import math

from mrpipe.words import in_percent, number

PREFIXES = ((1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
_SCALED = {"m", "N", "s", "N/m", "N*s/m", "N s/m", "m/s", "kg/s", "N*s^2/m^2"}


def percent(value: float | None, digits: int = 2) -> str:
    """Return a ratio as a percentage with some significant digits; `-` where it is not known."""
    return in_percent(value, digits=digits)


def readable_unit(unit: str) -> str:
    """Return a unit as people write it: `N per A` for `N/A`, which is read as missing."""
    text = unit.replace("*", " ").replace("^2", "²").replace("^3", "³")
    for drive in ("A", "V"):
        text = text.replace(f"/{drive}", f" per {drive}")
    return "" if text == "1" else text


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with its unit: `9.10 kN/m`, `5.2 mm`."""
    if unit in _SCALED and value:
        factor, prefix = 1.0, ""
        for step, name in PREFIXES:
            if abs(value) >= step:
                factor, prefix = step, name
        if abs(value) < PREFIXES[0][0]:
            factor, prefix = PREFIXES[0]
        return f"{number(value / factor, digits)} {prefix}{readable_unit(unit)}"
    return f"{number(value, digits)} {readable_unit(unit)}".strip()


def with_interval(value: float, low: float, high: float, unit: str) -> str:
    """Return a number with its interval in one unit: `9.10 kN/m (9.04 to 9.16)`."""
    factor = 1.0
    prefix = ""
    if unit in _SCALED and value:
        for step, name in PREFIXES:
            if abs(value) >= step:
                factor, prefix = step, name
    spread = max(abs(high - low), 1e-12 * abs(value), 1e-300)
    places = max(1 - math.floor(math.log10(spread / factor)), 0)
    places = min(places, 6)
    shown = [f"{item / factor:.{places}f}" for item in (value, low, high)]
    name = f"{prefix}{readable_unit(unit)}"
    return f"{shown[0]}{' ' + name if name else ''} ({shown[1]} to {shown[2]})"


def plain(name: str) -> str:
    """Return an identifier as words."""
    return name.replace("_", " ").replace("-", " ")
