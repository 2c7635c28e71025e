"""Definition of an effect of a structure: the contract that every file of this package (and of a user) fulfils.

A file defines `EFFECT = StructuralEffect(...)`; no other module has to be changed. Its forms contain, depending on the
place where it acts:

- `storey`, `floor`: a *step*, a small compiled function that computes unit forces from the history of a drift (or of
  the displacement of a floor relative to the ground); the forces are proportional to amplitudes, which are solved for
  exactly.
- `base`: the rotation of the base, as columns of motion per unit storey height.
- `damper-rod`, `command`: declared here with its parameters, found in the closed loop by
  :mod:`mrpipe.tracing.structure.damper` and :mod:`mrpipe.tracing.structure.delay`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from numba import float64, void

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Described, Parameter, Separation, Values

STEP_SIGNATURE = void(float64, float64, float64[::1], float64[::1], float64, float64[::1])
"""`step(position [m], rate [m/s], state, parameters, dt [s], out)`: writes one unit force for each amplitude."""

Place = Literal["storey", "floor", "base", "damper-rod", "command"]


@dataclass(frozen=True)
class StructuralForm:
    """One functional shape of an effect.

    Attributes
    ----------
    name, summary
        Key within the effect; the law in one line.
    searched
        Parameters that a fit searches, in the order in which the step reads them. Scales are those of the place: stroke
        and speed of drift or floor, RMS shear force of the storey.
    amplitudes
        Factors of the unit forces, which the fit solves for; a lower bound of 0 excludes negative values.
    step
        Compiled with :data:`STEP_SIGNATURE`; None for `base`, `damper-rod` and `command`.
    state_size
        Length of the memory of the step, which is 0 at the start.
    columns
        `base` only: (reference rotation (m,), dt, values) -> columns (m, k) of the rotation of the base.
    constants
        Numbers that the step reads after the searched ones, such as side or kind.
    """

    name: str
    summary: str
    searched: tuple[Parameter, ...]
    amplitudes: tuple[Parameter, ...]
    step: Any = None
    state_size: int = 0
    columns: Callable[[FloatArray, float, Values], FloatArray] | None = None
    constants: tuple[float, ...] = ()


@dataclass(frozen=True)
class StructuralEffect(Described):
    """A physical effect of a structure that a linear frame lacks.

    Attributes
    ----------
    acts_on
        Place where the effect acts.
    forms
        One or several functional shapes.
    places
        `all`: every storey has a separate amplitude; `one`: one place is searched.
    separated_by
        Other effect -> test that separates the two.
    """

    acts_on: Place
    forms: tuple[StructuralForm, ...]
    places: Literal["all", "one"] = "all"
    separated_by: Mapping[str, Separation] = field(default_factory=dict)
