"""Sensors whose floors were exchanged, recognised by the shapes of a chain of floors.

Mode r of a chain of springs changes its sign r - 1 times from the ground to the top (Gantmacher and Krein 1941, on
oscillation matrices; the same holds for a beam in bending). Exchanged sensors give shapes with other numbers of sign
changes. Such shapes can be orthogonal and predict the response well, because they are those of a structure whose
springs connect the floors in another order. Another order of the floors is therefore reported if it gives each mode the
right number of sign changes, and if springs between neighbouring floors describe the modes significantly better in it.
In the first mode of a chain of springs each floor also moves more than the floors below it. This condition excludes a
wrong order of a wall in bending: a wall is not a chain of springs, and its reversed order resembles one more closely.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, permutations

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray
from mrpipe.modal.matrices.tridiagonal import storey_misfit
from mrpipe.modal.search.checks import SURE_ERRORS, SURE_SHARE, possible_sign_changes
from mrpipe.words import listed

_LEVEL = 1e-3
"""Probability of an exchange that does not exist, over all orders that are tried."""
_NAMING_LEVEL = 0.05
"""Probability that another order than the best one is the true one, from which on no order is named."""
_MOST_PERMUTED = 6
"""Largest number of floors for which all orders are tried; for more floors up to two exchanges are tried."""
_MOST_FITTED = 24
"""Largest number of orders to which a storey model is fitted, those with the fewest moved floors."""


def exchanged_floors(
    masses: FloatArray, shapes: FloatArray, errors: FloatArray, angular_frequencies: FloatArray
) -> tuple[int, ...]:
    """Return the floor (from 1) at which each sensor probably is, lowest sensor first; empty where the order is right.

    Zeros where the order is wrong and several others describe the modes equally well.

    Parameters
    ----------
    masses
        Shape (n,) [kg].
    shapes, errors
        All modes of a chain at all floors, and their standard errors, shape (n, n).
    angular_frequencies
        Shape (n,) [rad/s], rising.
    """
    declared = tuple(range(masses.size))
    if _is_possible(declared, shapes, errors):
        # reversed floors have the same numbers of sign changes, and only the storey model distinguishes them
        tried = possible = [declared[::-1]]
    else:
        tried = _orders(masses.size)
        possible = [order for order in tried if _is_possible(order, shapes, errors)]
    possible = [order for order in possible if _grows(order, shapes[:, 0], errors[:, 0])]
    if not possible:
        return ()
    possible.sort(key=_moved)
    costs = [storey_misfit(masses, shapes[list(order)], angular_frequencies) for order in possible[:_MOST_FITTED]]
    before = storey_misfit(masses, shapes, angular_frequencies)
    best = max(min(costs), shapes.size * np.finfo(float).eps)
    if before <= best * float(stats.f.ppf(1.0 - _LEVEL / len(tried), shapes.size, shapes.size)):
        return ()
    rivals = sum(cost <= best * float(stats.f.ppf(1.0 - _NAMING_LEVEL, shapes.size, shapes.size)) for cost in costs)
    if rivals > 1:
        return (0,) * masses.size
    chosen = possible[int(np.argmin(costs))]
    # the motion of floor i is row `chosen[i]`, so that the sensor of this row is at floor i
    return tuple(int(place) + 1 for place in np.argsort(chosen))


def _orders(floors: int) -> list[tuple[int, ...]]:
    """Return the orders of the floors that are tried, without the declared one."""
    declared = tuple(range(floors))
    if floors <= _MOST_PERMUTED:
        return [order for order in permutations(declared) if order != declared]
    pairs = list(combinations(range(floors), 2))
    once = [_swapped(declared, pair) for pair in pairs]
    found = [declared[::-1], *once, *(_swapped(order, pair) for order in once for pair in pairs)]
    return [order for order in dict.fromkeys(found) if order != declared]


def _moved(order: tuple[int, ...]) -> int:
    return sum(place != row for place, row in enumerate(order))


def _is_possible(order: tuple[int, ...], shapes: FloatArray, errors: FloatArray) -> bool:
    """Return whether each mode may have one sign change less than its number, if row `order[i]` is floor i."""
    rows = list(order)
    for mode, (shape, error) in enumerate(zip(shapes[rows].T, errors[rows].T, strict=True)):
        # cross-talk and gains change small elements by more than their noise
        unsure = 0.5 * np.maximum(SURE_ERRORS * error, SURE_SHARE * np.abs(shape).max())
        fewest, most = possible_sign_changes(shape, unsure)
        if not fewest <= mode <= most:
            return False
    return True


def _grows(order: tuple[int, ...], shape: FloatArray, error: FloatArray) -> bool:
    """Return whether the top may move more than the lowest floor in the first mode, if row `order[i]` is floor i."""
    low, high = order[0], order[-1]
    unsure = SURE_ERRORS * float(np.hypot(error[low], error[high]))
    return bool(np.abs(shape[high]) + unsure > np.abs(shape[low]))


def _swapped(rows: tuple[int, ...], pair: tuple[int, int]) -> tuple[int, ...]:
    changed = list(rows)
    first, second = pair
    changed[first], changed[second] = changed[second], changed[first]
    return tuple(changed)


def exchanged_finding(places: Sequence[int]) -> str:
    """Return a sentence on exchanged sensors; `places`: result of :func:`exchanged_floors`."""
    if not all(places):
        return (
            "the sensors may be in another order than declared: springs between neighbouring floors do not allow the "
            "sign changes of the mode shapes, and describe the modes in several other orders"
        )
    moved = [(floor, place) for floor, place in enumerate(places, start=1) if floor != place]
    who = listed([str(floor) for floor, _ in moved])
    if tuple(places) == tuple(range(len(places), 0, -1)):
        return (
            "the floors may be numbered from the top to the ground: springs between neighbouring floors and the ground "
            "describe the modes only in this order"
        )
    reason = (
        "springs between neighbouring floors do not allow the sign changes of the mode shapes as declared, and "
        "describe the modes"
    )
    if len(moved) == 2:
        return f"the sensors of floors {who} may be exchanged: {reason} with these two exchanged"
    order = ", ".join(f"{floor} at floor {place}" for floor, place in moved)
    return f"the sensors of floors {who} may be in another order ({order}): {reason} in this order"
