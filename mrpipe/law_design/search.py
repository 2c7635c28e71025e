"""Search of the gains of one law: bounded, derivative free, on the logarithms of the gains."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from mrpipe.artifacts import FloatArray
from mrpipe.control.gains import Gains
from mrpipe.law_design.options import DesignSettings

Value = Callable[[Gains], float]


@dataclass(frozen=True)
class FreeGain:
    """A gain that is searched.

    Attributes
    ----------
    name
        Of the gain, with its unit.
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
    """How gains are searched.

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

    A coarse grid over the whole range of each gain finds the valley, because the response of a clipped law can have
    several. A bounded local search then refines it: Brent's method for one gain, Nelder-Mead for several.

    Parameters
    ----------
    value
        Objective of a set of gains; the same gains are not asked for twice.
    free, fixed
        Gains to search, and the others.
    options
        Size of the search.
    """
    known: dict[tuple[float, ...], float] = {}

    def at(point: FloatArray) -> float:
        key = tuple(np.round(point, 6).tolist())
        if key not in known:
            known[key] = value(_gains(free, fixed, point))
        return known[key]

    if not free:
        return Gains(**fixed)
    if len(free) == 1:
        return _search_one(at, free, fixed, options)
    return _search_several(at, free, fixed, options)


def _gains(free: Sequence[FreeGain], fixed: Mapping[str, float], point: FloatArray) -> Gains:
    found = {gain.name: gain.sign * float(np.exp(part)) for gain, part in zip(free, point, strict=True)}
    return Gains(**{**fixed, **found})


def _search_one(
    at: Callable[[FloatArray], float], free: Sequence[FreeGain], fixed: Mapping[str, float], options: SearchOptions
) -> Gains:
    low, high = free[0].logarithms
    grid = np.linspace(low, high, options.grid)
    values = [at(np.array([point])) for point in grid]
    best = int(np.argmin(values))
    bounds = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    found = minimize_scalar(
        lambda part: at(np.array([part])),
        bounds=bounds,
        method="bounded",
        options={"xatol": options.tolerance, "maxiter": options.evaluations},
    )
    points = [(values[best], float(grid[best])), (float(found.fun), float(found.x))]
    return _gains(free, fixed, np.array([min(points)[1]]))


def _search_several(
    at: Callable[[FloatArray], float], free: Sequence[FreeGain], fixed: Mapping[str, float], options: SearchOptions
) -> Gains:
    bounds = [gain.logarithms for gain in free]
    # three values of each gain away from its bounds: the valley of two gains is a broad diagonal one
    axes = [np.linspace(low, high, 5)[1:4] for low, high in bounds]
    starts = np.array(np.meshgrid(*axes)).reshape(len(free), -1).T
    values = [at(start) for start in starts]
    best = starts[int(np.argmin(values))]
    steps = np.array([0.25 * (high - low) / 2.0 for low, high in bounds])
    simplex = np.vstack([best, *(best + step * unit for step, unit in zip(steps, np.eye(len(free)), strict=True))])
    found = minimize(
        at,
        best,
        method="Nelder-Mead",
        bounds=bounds,
        options={
            "initial_simplex": np.clip(simplex, [low for low, _ in bounds], [high for _, high in bounds]),
            "xatol": options.tolerance,
            "fatol": 1e-3,
            "maxfev": options.evaluations * len(free),
        },
    )
    point = found.x if found.fun <= min(values) else best
    return _gains(free, fixed, point)
