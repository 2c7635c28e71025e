"""Factors on the gains of several dampers that give the target modes the largest damping together."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize

from mrpipe.artifacts import FloatArray
from mrpipe.control import exact

LARGEST_FACTOR = 8.0
"""Largest factor on a gain, and inverse of the smallest factor."""

RESTARTS = 8
"""Largest number of searches that begin at the result of the one before."""

IMPROVEMENT = 1e-4
"""Share by which a search that begins at the result of the one before must improve it, so that another one follows."""


def least_improvement(ratios: FloatArray, reference: FloatArray) -> float:
    """Return the smallest quotient of effective damping ratio and reference over the modes not critically damped.

    A critically damped mode has the largest effective damping ratio that exists, which is 1. It is left out, because it
    would hide that other modes improve. Of two results, the larger one therefore belongs to the design that is better
    by its smallest quotient or, if a critically damped mode has this quotient in both, by the next smallest one. If all
    modes are critically damped, the result is the largest quotient that exists.

    Parameters
    ----------
    ratios, reference
        Effective damping ratios of the modes, shape (k,), and those to which they are compared
        (:attr:`mrpipe.control.together.TogetherDamping.effective_ratios`).
    """
    lacking = ratios < exact.CRITICAL
    return float(np.min((ratios / reference)[lacking])) if np.any(lacking) else float(np.max(1.0 / reference))


def best_factors(ratios: Callable[[FloatArray], FloatArray], reference: FloatArray, largest: FloatArray) -> FloatArray:
    """Return the factors, shape (m,), of the largest damping by :func:`least_improvement`.

    If all target modes can be overdamped, these are the smallest factors, in the ratio that was found, that damp all of
    them critically, as for a single damper.

    Parameters
    ----------
    ratios
        Function from factors, shape (m,), to the effective damping ratios of the target modes, shape (k,).
    reference
        Effective damping ratios to which these are compared, shape (k,).
    largest
        Largest factors, shape (m,); the smallest ones are 1/LARGEST_FACTOR.
    """
    low, high = -math.log(LARGEST_FACTOR), np.log(largest)

    def loss(logarithms: FloatArray) -> float:
        return -least_improvement(ratios(np.exp(logarithms)), reference)

    best, least = _searched(loss, np.zeros(largest.size), 0.4, low, high)
    for place in range(RESTARTS):
        reached = ratios(np.exp(best)) >= exact.CRITICAL
        if not np.any(reached) or np.all(reached):
            break
        # at the limit of critical damping the objective jumps, so that a simplex can shrink to a point that is no
        # maximum; the next one has the other orientation
        following, value = _searched(loss, best, -0.4 if place % 2 == 0 else 0.4, low, high)
        improved = value < least - IMPROVEMENT * abs(least)
        if value < least:
            best, least = following, value
        if place % 2 == 1 and not improved:
            break
    factors = np.asarray(np.exp(best))
    if float(np.min(ratios(factors))) < exact.CRITICAL:
        return factors
    return factors * exact.first_critical(lambda share: float(np.min(ratios(share * factors))), 0.0, 1.0)


def _searched(
    loss: Callable[[FloatArray], float], start: FloatArray, step: float, low: float, high: FloatArray
) -> tuple[FloatArray, float]:
    """Return the logarithms of the factors of the smallest loss and this loss, by the simplex of Nelder and Mead."""
    count = start.size
    simplex = np.vstack([start, start + step * np.eye(count)])
    outside = (simplex > high) | (simplex < low)
    simplex = np.where(outside, 2.0 * start - simplex, simplex)
    found = minimize(
        loss,
        start,
        method="Nelder-Mead",
        bounds=[(low, float(item)) for item in high],
        options={"initial_simplex": simplex, "xatol": 1e-5, "fatol": 1e-9, "maxfev": 150 * count},
    )
    return np.asarray(found.x), float(found.fun)
