"""Units are converted here, at the border, and nowhere else; inside, everything is SI.

The arithmetic of units is pint's; this module adds the words the field uses and one-line errors. A unit comes from a
user's file, so only words with small powers are passed on to pint; an expression of numbers is never evaluated.
"""

from __future__ import annotations

import difflib
import re
from functools import cache
from typing import Any, NamedTuple

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
    '"': "inch",
    "t": "metric_ton",
    "kp": "kilogram_force",
}

_USUAL = ("mm", "cm", "m", "um", "in", "N", "kN", "MN", "lbf", "kip", "kgf", "A", "mA", "V", "mV", "s", "ms", "us", "g")
_MASSES_AS_FORCES = {"kg": "kgf", "lb": "lbf", "lbs": "lbf", "pound": "lbf", "pounds": "lbf", "t": "tf", "g": "gf"}
"""Unit of mass -> the unit of force that a load cell which counts in it means."""

_USUAL_RATES = ("m/s", "mm/s", "cm/s", "m/s^2", "mm/s^2", "cm/s^2", "in/s", "kg", "Hz")

_WORD = r"(?:[A-Za-zµμ°Ω%_]{1,40}|1)"
_POWER = r"(?:\s*(?:\^|\*\*)\s*(?:[-+]?\d(?:\.\d{1,3})?|\([-+]?\d(?:\.\d{1,3})?\))|[²³]|[-+]?[23](?![0-9A-Za-z]))?"
_TERM = rf"\(*{_WORD}{_POWER}(?:\){_POWER})*"
_UNIT = re.compile(rf"^{_TERM}(?:(?:\s*(?:\*|/|·|⋅)\s*|\s+){_TERM}){{0,9}}$")
_PLAIN_POWER = re.compile(r"(?<=[A-Za-zµμΩ])([-+]?[23])(?![0-9A-Za-z])")
_LONGEST = 80
_BRACKETS = re.compile(r"[\[({<]([^\[\](){}<>]*(?:\([^()]*\))?[^\[\](){}<>]*)[\])}>]")
"""Text in brackets of any kind, which may hold one pair of round brackets, such as [N/(m/s)]."""


class BracketedUnit(NamedTuple):
    """A unit in brackets within a text.

    Attributes
    ----------
    unit
        The unit as written, without the brackets.
    start, end
        Places in the text of the first character of the brackets and of the first character after them.
    """

    unit: str
    start: int
    end: int


@cache
def _registry() -> Any:
    # pint takes 0.2 s to import, so it is loaded when the first unit is met
    import pint

    registry = pint.UnitRegistry(cache_folder=None)
    registry.define("share = 1")
    return registry


def _nearest(unit: str, quantity: str | None = None) -> str:
    """Return a remedy that names the usual unit, of the quantity if given, that was probably meant, if there is one."""
    usual = [item for item in (*_USUAL, *_USUAL_RATES) if quantity is None or same_dimension(item, quantity)]
    folded = {item.casefold(): item for item in usual}
    close = difflib.get_close_matches(unit, usual, n=1, cutoff=0.6)
    meant = folded.get(unit.casefold()) or (close[0] if close else "")
    return f"did you mean {meant}?" if meant and meant != unit else ""


def _of_quantity(unit: str, quantity: str) -> str:
    """Return a remedy that names a unit of the quantity that was probably meant, where there is one."""
    if quantity == "force" and unit in _MASSES_AS_FORCES:
        return f"did you mean {_MASSES_AS_FORCES[unit]}?"
    return _nearest(unit, quantity)


def _parse(unit: str, where: str) -> Any:
    registry = _registry()
    text = str(unit).strip()
    word = _WORDS.get(text, text)
    word = word.lower() if word.isalpha() and word.istitle() and len(word) > 3 else word  # Newton, Volt
    try:
        if len(word) > _LONGEST or not _UNIT.match(word):
            raise ValueError("no unit words")
        return registry.parse_units(_PLAIN_POWER.sub(r"^\1", word.replace("·", "*").replace("⋅", "*")))
    except Exception as error:
        remedy = _nearest(text) or "write one such as mm, m/s^2, kN, A, V"
        shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
        raise UserError(where or "unit", f"unit {shown!r}", "is not a unit", remedy) from error


def conversion(unit: str, *, where: str = "", quantity: str | None = None) -> float:
    """Return the factor that turns a number in `unit` into SI.

    Parameters
    ----------
    unit
        As a person writes it: `mm`, `cm/s^2`, `m/s2`, `g` (gravity, for accelerations), `kN`.
    where
        File and key, for the message.
    quantity
        If given, the unit must be of this quantity (a key of :data:`SI_UNITS`).

    Raises
    ------
    UserError
        If the unit is unknown, of another quantity, or has no factor (temperatures).
    """
    parsed = _parse(unit, where)
    registry = _registry()
    if quantity is not None:
        wanted = SI_UNITS[quantity]
        if parsed.dimensionality != registry.parse_units(wanted).dimensionality:
            remedy = _of_quantity(str(unit).strip(), quantity) or f"write one such as {wanted}"
            raise UserError(where or "unit", f"unit {unit!r}", f"is not a unit of {quantity}", remedy)
    try:
        if registry.Quantity(0.0, parsed).to_base_units().magnitude != 0.0:
            raise ValueError("its zero is not that of the SI unit")
        return float((1.0 * parsed).to_base_units().magnitude)
    except Exception as error:
        raise UserError(where or "unit", f"unit {unit!r}", "has no factor to SI", "use another unit") from error


def to_si(values: ArrayLike, unit: str, *, where: str = "", quantity: str | None = None) -> NDArray[np.float64]:
    """Return `values` in SI (see :func:`conversion`)."""
    return np.asarray(values, dtype=np.float64) * conversion(unit, where=where, quantity=quantity)


def bracketed_units(text: str) -> list[BracketedUnit]:
    """Return the units in brackets of a header, such as kN in `force [kN]`, in their order; remarks are left out."""
    found = []
    for place in _BRACKETS.finditer(text):
        unit = place[1].strip()
        try:
            known = bool(unit) and conversion(unit) > 0.0
        except UserError:
            continue
        if known:
            found.append(BracketedUnit(unit, place.start(), place.end()))
    return found


def same_dimension(unit: str, quantity: str, *, where: str = "") -> bool:
    """Return whether `unit` measures `quantity`; `where` is file and key for the message on an unknown unit."""
    return bool(_parse(unit, where).dimensionality == _registry().parse_units(SI_UNITS[quantity]).dimensionality)


def same_unit_dimension(unit: str, other: str, *, where: str = "") -> bool:
    """Return whether two units measure the same kind of quantity, such as kN/m and N/m."""
    return bool(_parse(unit, where).dimensionality == _parse(other, where).dimensionality)
