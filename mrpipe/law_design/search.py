"""Search of the gains of one law: bounded, derivative free, on the logarithms of the gains."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from mrpipe.artifacts import FloatArray
from mrpipe.control.gains import Gains
from mrpipe.law_design.options import DesignSettings

STARTS = 2
"""Number of best points of the coarse grid from which the search of several gains starts."""

NEAR = 0.3
"""Largest distance of gains in the second search from the first result, in logarithms."""

NEAR_STEP = 0.12
"""First step of the simplex of the second search, in logarithms."""

NEAR_EVALUATIONS = 7
"""Largest number of evaluations of the second search per free gain."""

Value = Callable[[Gains], float]
AtPoint = Callable[[FloatArray], float]


@dataclass(frozen=True)
class FreeGain:
    """A gain that is searched.

    Attributes
    ----------
    name
        Name of the gain, with its unit.
    low, high
        Bounds of the same sign, neither of them 0.
    """

    name: str
    low: float
    high: float

    @property
    def sign(self) -> float:
        """Sign of the gain."""
        return 1.0 if self.high > 0.0 else -1.0

    @property
    def logarithms(self) -> tuple[float, float]:
        """Bounds of the logarithm of the absolute value."""
        low, high = sorted((abs(self.low), abs(self.high)))
        return float(np.log(low)), float(np.log(high))


_SETTINGS = DesignSettings()
"""The defaults that the options share with the settings."""


@dataclass(frozen=True)
class SearchOptions:
    """Options of the search of gains.

    Attributes
    ----------
    grid
        Values of a single gain, or starting points of several, before the local search.
    evaluations
        Most evaluations of the local search per free gain.
    tolerance
        Relative accuracy of a gain at which the search ends.
    """

    grid: int = _SETTINGS.grid
    evaluations: int = _SETTINGS.evaluations
    tolerance: float = 0.02


def search(value: Value, free: Sequence[FreeGain], fixed: Mapping[str, float], options: SearchOptions) -> Gains:
    """Return the gains with the smallest value that was found.

    A coarse grid over the whole range of each gain finds the region of the minimum, because the response of a clipped
    law can have several minima. A bounded local search then refines it: Brent's method for one gain, Nelder-Mead for
    several.

    Parameters
    ----------
    value
        Objective of a set of gains; the same gains are not evaluated twice.
    free, fixed
        Gains to search, and the others.
    options
        Size of the search.
    """
    at = _at_points(value, free, fixed)
    if not free:
        return Gains(**fixed)
    if len(free) == 1:
        return _search_one(at, free, fixed, options)
    return _search_several(at, free, fixed, options)


def refine(value: Value, free: Sequence[FreeGain], start: Gains, options: SearchOptions) -> Gains:
    """Return the best gains near a point, by a local search with values that are more accurate than those before.

    The minimum of a largest response is flat, so that a search with coarse values misses it by more than the
    accuracy that it reports.

    Parameters
    ----------
    value
        Accurate objective of a set of gains.
    free
        Gains to search; the others keep their values.
    start
        Result of the first search.
    options
        Accuracy of the gains.
    """
    if not free:
        return start
    fixed = {name: item for name, item in start.items() if name not in {gain.name for gain in free}}
    centre = np.log([abs(start[gain.name]) for gain in free])
    bounds = [
        (max(low, middle - NEAR), min(high, middle + NEAR))
        for (low, high), middle in zip((gain.logarithms for gain in free), centre, strict=True)
    ]

    at = _at_points(value, free, fixed)
    most = NEAR_EVALUATIONS * len(free)
    if len(free) == 1:
        found, point = _bounded(at, bounds[0], options.tolerance, most)
    else:
        # the simplex opens towards the inside of the bounds
        steps = np.where(centre + NEAR_STEP <= [high for _, high in bounds], NEAR_STEP, -NEAR_STEP)
        found, point = simplex_search(at, centre, steps, bounds, options.tolerance, most)
    return _gains(free, fixed, point) if found < at(centre) else start


def _at_points(value: Value, free: Sequence[FreeGain], fixed: Mapping[str, float]) -> AtPoint:
    """Return the value over logarithms of the free gains; the same point is not evaluated twice."""
    known: dict[tuple[float, ...], float] = {}

    def at(point: FloatArray) -> float:
        key = tuple(np.round(point, 6).tolist())
        if key not in known:
            known[key] = value(_gains(free, fixed, point))
        return known[key]

    return at


def _gains(free: Sequence[FreeGain], fixed: Mapping[str, float], point: FloatArray) -> Gains:
    found = {gain.name: gain.sign * float(np.exp(part)) for gain, part in zip(free, point, strict=True)}
    return Gains(**{**fixed, **found})


def _search_one(at: AtPoint, free: Sequence[FreeGain], fixed: Mapping[str, float], options: SearchOptions) -> Gains:
    low, high = free[0].logarithms
    grid = np.linspace(low, high, options.grid)
    values = [at(np.array([point])) for point in grid]
    best = int(np.argmin(values))
    bounds = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    found, point = _bounded(at, bounds, options.tolerance, options.evaluations)
    points = [(values[best], float(grid[best])), (found, float(point[0]))]
    return _gains(free, fixed, np.array([min(points)[1]]))


def _search_several(at: AtPoint, free: Sequence[FreeGain], fixed: Mapping[str, float], options: SearchOptions) -> Gains:
    """Search from several points, because the largest response has kinks at which a simplex may stop."""
    bounds = [gain.logarithms for gain in free]
    inside = 4 if len(free) == 2 else 3
    axes = [np.linspace(low, high, inside + 2)[1:-1] for low, high in bounds]
    starts = np.array(np.meshgrid(*axes)).reshape(len(free), -1).T
    values = np.array([at(start) for start in starts])
    sizes = np.array([0.25 * (high - low) / 2.0 for low, high in bounds])
    middles = np.array([0.5 * (low + high) for low, high in bounds])
    most = options.evaluations * len(free)
    ends = []
    for place in np.argsort(values, kind="stable")[:STARTS]:
        start = starts[place]
        # the simplex opens towards the middle of the range
        steps = np.where(start < middles, sizes, -sizes)
        ends.append(simplex_search(at, start, steps, bounds, options.tolerance, most))
    _, point = min([*ends, (float(values.min()), starts[int(np.argmin(values))])], key=lambda item: item[0])
    return _gains(free, fixed, point)


def _bounded(at: AtPoint, bounds: tuple[float, float], tolerance: float, most: int) -> tuple[float, FloatArray]:
    """Return the smallest value that Brent's bounded method finds for one gain, and its place."""
    found = minimize_scalar(
        lambda part: at(np.array([part])),
        bounds=bounds,
        method="bounded",
        options={"xatol": tolerance, "maxiter": most},
    )
    return float(found.fun), np.array([found.x])


def simplex_search(
    at: AtPoint,
    start: FloatArray,
    steps: FloatArray,
    bounds: Sequence[tuple[float, float]],
    tolerance: float,
    most: int,
) -> tuple[float, FloatArray]:
    """Return the smallest value that the simplex of Nelder and Mead reaches from a point, and its place.

    Parameters
    ----------
    at
        Objective.
    start, steps
        First corner of the simplex, and the step to each of the others, shape (r,), in logarithms.
    bounds
        Bounds of each logarithm.
    tolerance
        Accuracy of a logarithm at which the search ends.
    most
        Largest number of evaluations.
    """
    simplex = np.vstack([start, start + np.diag(steps)])
    found = minimize(
        at,
        start,
        method="Nelder-Mead",
        bounds=bounds,
        options={
            "initial_simplex": np.clip(simplex, [low for low, _ in bounds], [high for _, high in bounds]),
            "xatol": tolerance,
            "fatol": 1e-3,
            "maxfev": most,
        },
    )
    return float(found.fun), np.asarray(found.x)
