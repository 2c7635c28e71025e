"""Units are converted here, at the border, and nowhere else; inside, everything is SI.

The arithmetic of units is pint's; this module adds the words the field uses and one-line errors.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrpipe.errors import UserError

SI_UNITS: dict[str, str] = {
    "time": "s",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "force": "N",
    "current": "A",
    "voltage": "V",
    "mass": "kg",
    "frequency": "Hz",
}
"""The SI unit of each quantity that a channel can carry."""

_WORDS = {
    "": "dimensionless",
    "1": "dimensionless",
    "-": "dimensionless",
    "g": "standard_gravity",
    "gal": "cm/s^2",
    "Gal": "cm/s^2",
}


@cache
def _registry() -> Any:
    # pint takes 0.2 s to import, so it is loaded when the first unit is met
    import pint

    registry = pint.UnitRegistry(cache_folder=None)
    registry.define("share = 1")
    return registry


def _parse(unit: str, where: str) -> Any:
    registry = _registry()
    text = str(unit).strip()
    try:
        return registry.parse_units(_WORDS.get(text, text))
    except Exception as error:
        raise UserError(
            where or "unit", f"unit {unit!r}", "is not a unit", "write one such as mm, m/s^2, kN, A, V"
        ) from error


def conversion(unit: str, *, where: str = "", quantity: str | None = None) -> float:
    """Return the factor that turns a number in `unit` into SI.

    Parameters
    ----------
    unit
        As a person writes it: `mm`, `cm/s^2`, `g` (gravity, for accelerations), `kN`.
    where
        File and key, for the message.
    quantity
        If given, the unit must be of this quantity (a key of :data:`SI_UNITS`).

    Raises
    ------
    UserError
        If the unit is unknown or of another quantity.
    """
    parsed = _parse(unit, where)
    registry = _registry()
    if quantity is not None:
        wanted = SI_UNITS[quantity]
        if parsed.dimensionality != registry.parse_units(wanted).dimensionality:
            raise UserError(
                where or "unit", f"unit {unit!r}", f"is no unit of {quantity}", f"write one such as {wanted}"
            )
    return float((1.0 * parsed).to_base_units().magnitude)


def to_si(values: ArrayLike, unit: str, *, where: str = "", quantity: str | None = None) -> NDArray[np.float64]:
    """Return `values` in SI (see :func:`conversion`)."""
    return np.asarray(values, dtype=np.float64) * conversion(unit, where=where, quantity=quantity)


def same_dimension(unit: str, quantity: str) -> bool:
    """Return whether `unit` measures `quantity`."""
    return bool(_parse(unit, "").dimensionality == _registry().parse_units(SI_UNITS[quantity]).dimensionality)


def same_unit_dimension(unit: str, other: str, *, where: str = "") -> bool:
    """Return whether two units measure the same kind of quantity, such as kN/m and N/m."""
    return bool(_parse(unit, where).dimensionality == _parse(other, where).dimensionality)
