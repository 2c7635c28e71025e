"""Control laws: one file per law. Every file of this folder is a law.

A file `my_law.py` defines `LAW`, a :class:`~mrpipe.control.law.Law`, whose name is `my-law`. Nothing else has to be
changed: command line, settings, calibration, simulation, export, recalibration and report read this list. Further
folders with laws can be appended to `__path__`.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from typing import TYPE_CHECKING

from mrpipe.errors import UserError

if TYPE_CHECKING:
    from mrpipe.control.law import Law

LOADS_FROM = ("mrpipe.control.laws",)

_FIRST = ("vd", "vdps", "vdns", "fdns", "nnc", "lqg", "passive-off", "passive-on")
"""Laws that tables show first, in this order; the others follow in alphabetical order."""


def law_names() -> tuple[str, ...]:
    """Return the names of all laws in the order of tables, without importing them."""
    modules = (item.name for item in pkgutil.iter_modules(__path__))
    # a leading underscore marks a module that several laws share
    found = {name.replace("_", "-") for name in modules if not name.startswith("_")}
    return (*(name for name in _FIRST if name in found), *sorted(found.difference(_FIRST)))


def known_law(name: str) -> str:
    """Return the name of a law.

    Raises
    ------
    ValueError
        If there is no such law.
    """
    if name not in law_names():
        raise ValueError(f"no such control law; one of {', '.join(law_names())}")
    return name


def law_named(name: str) -> Law:
    """Return a law.

    Raises
    ------
    UserError
        If there is no such law.
    """
    if name not in law_names():
        raise UserError("control law", name, "is not a control law", f"one of {', '.join(law_names())}")
    return _load(name)


def is_linear(name: str) -> bool:
    """Return whether a law with this name exists and is linear in the motion of the damper, apart from clipping."""
    return name in law_names() and law_named(name).linear


def all_laws() -> dict[str, Law]:
    """Return name -> law in the order of tables."""
    return {name: law_named(name) for name in law_names()}


@cache
def _load(name: str) -> Law:
    module = importlib.import_module(f"{__name__}.{name.replace('-', '_')}")
    law: Law = module.LAW
    if law.name != name:
        raise ImportError(f"{module.__file__} must define the law {name}, but its LAW is named {law.name}")
    return law
