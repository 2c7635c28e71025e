"""Fit of effects to the residual of a linear frame: histories, columns, search of shape parameters and places."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import float64, int64, njit, types, void
from scipy import optimize

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.effects.contract import EffectScales, Parameter
from mrpipe.effects.structural.contract import STEP_SIGNATURE, StructuralEffect, StructuralForm
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.fit import Columns, Design, Solved, solve
from mrpipe.tracing.structure.spectra import Spectra


@njit(
    void(
        types.FunctionType(STEP_SIGNATURE), float64[::1], float64[::1], float64[::1], float64, int64, float64[:, ::1]
    ),
    cache=True,
)  # fmt: skip
def _run_step(
    step: Any,
    position: FloatArray,
    rate: FloatArray,
    parameters: FloatArray,
    dt: float,
    state_size: int,
    out: FloatArray,
) -> None:
    state = np.zeros(state_size + 1)
    for k in range(position.shape[0]):
        step(position[k], rate[k], state, parameters, dt, out[k])


def unit_forces(
    form: StructuralForm, position: FloatArray, rate: FloatArray, dt: float, numbers: FloatArray
) -> FloatArray:
    """Return the unit forces of a form along a history, shape (m, amplitudes)."""
    out = np.zeros((len(position), len(form.amplitudes)))
    parameters = np.array([*numbers, *form.constants, 0.0], dtype=np.float64)
    _run_step(
        form.step, np.ascontiguousarray(position), np.ascontiguousarray(rate), parameters, dt, form.state_size, out
    )
    return out


@dataclass(frozen=True)
class Placed:
    """A form of an effect at a place.

    Attributes
    ----------
    effect, form
        The effect, and the form of it.
    floor
        Floor on which it acts, from 1; 0 for an effect that acts on storeys or on the base.
    storeys
        Storeys on which an effect of storeys acts, from 1; empty if it may act on all of them.
    """

    effect: StructuralEffect
    form: StructuralForm
    floor: int = 0
    storeys: tuple[int, ...] = ()


@dataclass(frozen=True)
class Fitted:
    """A placed form with values of its searched parameters; the amplitudes follow from least squares.

    Attributes
    ----------
    placed
        The form and its place.
    numbers
        Values of the searched parameters, in SI.
    at_bound
        Names of the parameters that end at a bound of the search.
    """

    placed: Placed
    numbers: FloatArray
    at_bound: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.placed.effect.name


@dataclass(frozen=True)
class Surroundings:
    """Data that a search needs in addition to the records.

    Attributes
    ----------
    storey_stiffness
        Stiffness of the storeys, shape (n,) [N/m]; the rotation of a base is distributed over the storeys by it.
    rules
        Decision thresholds.
    """

    storey_stiffness: FloatArray
    rules: FrameRules = field(default_factory=FrameRules)


@dataclass(frozen=True)
class Histories:
    """Forces of an effect over time, for amplitudes of 1.

    Attributes
    ----------
    force
        The h different histories of m samples, shape (m, h).
    which
        Column of `force` that each of the k amplitudes multiplies, shape (k,).
    on_storey
        Factor of this column in the shear force of each storey, shape (k, n).
    """

    force: FloatArray
    which: IntArray
    on_storey: FloatArray


def histories_of(fitted: Fitted, spectra: Spectra, about: Surroundings) -> Histories:
    """Return the unit forces of an effect along a record, storey after storey, with all amplitudes of each storey."""
    effect, form = fitted.placed.effect, fitted.placed.form
    motion, dt, n = spectra.motion, spectra.record.dt, spectra.record.floors
    kinds = len(form.amplitudes)
    if effect.acts_on == "floor":
        place = fitted.placed.floor - 1
        position, rate = motion.state_displacement[:, place], motion.state_velocity[:, place]
        # all storeys below a floor carry a force on it
        below = np.where(np.arange(n) <= place, -1.0, 0.0)
        return Histories(
            unit_forces(form, position, rate, dt, fitted.numbers), np.arange(kinds), np.tile(below, (kinds, 1))
        )
    if effect.acts_on == "base" and form.columns is not None:
        weight = about.storey_stiffness / np.sum(about.storey_stiffness)
        names = [item.name for item in form.searched]
        turn = np.diff(motion.displacement, axis=1, prepend=0.0) @ weight
        turns = form.columns(turn, dt, dict(zip(names, fitted.numbers, strict=True)))
        # storeys of equal height: the rotation of the base changes the drift of each by the same amount
        return Histories(turns, np.arange(kinds), np.tile(about.storey_stiffness, (kinds, 1)))
    drift, drift_rate = motion.drift, motion.drift_rate
    acting = [storey - 1 for storey in fitted.placed.storeys] or list(range(n))
    forces = [unit_forces(form, drift[storey], drift_rate[storey], dt, fitted.numbers) for storey in acting]
    # each storey has its amplitudes, also those on which the effect does not act
    which, on_storey = np.zeros((n, kinds), dtype=np.int64), np.zeros((n, kinds, n))
    which[acting] = np.arange(kinds * len(acting)).reshape(-1, kinds)
    on_storey[acting, :, acting] = -1.0
    return Histories(np.concatenate(forces, axis=1), which.ravel(), on_storey.reshape(-1, n))


def columns_of(fitted: Fitted, spectra: Spectra, about: Surroundings) -> Columns:
    """Return the spectral lines of the unit forces of an effect in a record."""
    found = histories_of(fitted, spectra, about)
    lines = spectra.lines_of(found.force)
    return Columns(spectra.in_equations(found.on_storey[:, :, None] * lines[found.which][:, None, :]))


@dataclass(frozen=True)
class Outcome:
    """Result of the search of a candidate."""

    fitted: Fitted
    solved: Solved


def scales_of(spectra: Sequence[Spectra], place: Placed) -> EffectScales:
    """Return the scales at a place; bounds and starts are multiples of them."""
    drifts, rates, forces, length = [], [], [], 0.0
    for item in spectra:
        x, v = item.motion.drift, item.motion.drift_rate
        if place.floor:
            x, v = item.motion.state_displacement[:, place.floor - 1], item.motion.state_velocity[:, place.floor - 1]
        drifts.append(float(np.quantile(np.abs(x), 0.9995)))
        rates.append(float(np.quantile(np.abs(v), 0.9995)))
        forces.append(float(np.std(item.motion.acceleration)))
        length = max(length, len(x) * item.record.dt)
    return EffectScales(max(drifts), max(rates), 1.0, 1.0, max(forces), length)


def search(
    placed: Placed,
    design: Design,
    before: FloatArray | None,
    about: Surroundings,
    *,
    evaluations: int = 30,
    screen_only: bool = False,
) -> Outcome:
    """Search the shape parameters of a form: every combination of starts, then a local search from the best one.

    Parameters
    ----------
    placed
        Form of an effect at its place.
    design
        Linear frame that is fitted to the records.
    before
        Projected columns of the effects chosen before, shape (k, n, 2 b).
    about
        Scales of the structure and decision thresholds.
    evaluations
        Largest number of evaluations.
    screen_only
        Return after the coarse grid.
    """
    scales = scales_of(design.spectra, placed)
    bounds = [item.bounds(scales) for item in placed.form.searched]

    def outcome(numbers: FloatArray) -> Outcome:
        fitted = Fitted(placed, numbers, _at_bound(placed.form.searched, numbers, bounds, about.rules.at_bound))
        own = design.project([columns_of(fitted, item, about) for item in design.spectra])
        return Outcome(fitted, solve(design, own if before is None else np.concatenate([before, own])))

    starts = [np.zeros(0)]
    for item in placed.form.searched:
        starts = [np.append(start, value) for start in starts for value in item.start_values(scales)]
    tried = sorted((outcome(start) for start in starts), key=_chi_square)
    best = tried[0]
    if screen_only or not placed.form.searched:
        return best
    return _downhill(outcome, best, bounds, evaluations)


def _downhill(
    outcome: Callable[[FloatArray], Outcome], best: Outcome, bounds: Sequence[tuple[float, float]], evaluations: int
) -> Outcome:
    kept = [best]
    low, high = np.log([low for low, _ in bounds]), np.log([high for _, high in bounds])

    def cost(position: FloatArray) -> float:
        found = outcome(np.exp(np.clip(position, low, high)))
        if found.solved.chi_square < kept[0].solved.chi_square:
            kept[0] = found
        return found.solved.chi_square

    start = np.log(best.fitted.numbers)
    simplex = np.vstack([start, *(start + 0.25 * unit for unit in np.eye(len(start)))])
    optimize.minimize(
        cost, start, method="Nelder-Mead",
        options={"maxfev": evaluations, "xatol": 0.01, "fatol": 1e-7, "initial_simplex": simplex},
    )  # fmt: skip
    return kept[0]


def _chi_square(item: Outcome) -> float:
    return item.solved.chi_square


def _at_bound(
    parameters: Sequence[Parameter], numbers: FloatArray, bounds: Sequence[tuple[float, float]], share: float
) -> tuple[str, ...]:
    return tuple(
        item.name
        for item, value, (low, high) in zip(parameters, numbers, bounds, strict=True)
        if value < (1.0 + share) * low or value > (1.0 - share) * high
    )
