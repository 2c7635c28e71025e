"""An eigenvalue that is followed while a device increases from zero."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Eigenvalues = Callable[[float], NDArray[np.complex128]]
"""Function from the share of the device, 0 to 1, to eigenvalues, shape (m,) [rad/s]."""

STEPS = 24
"""Number of steps from zero to the whole device."""
MOST_HALVINGS = 10
"""A step after which two eigenvalues could be the followed one is halved this often at most."""
ROUNDING = 1e-9
"""Relative distance below which an eigenvalue equals the expected value, however near the next one is, and below which
two eigenvalues are equal."""
CLEARLY_NEARER = 0.3
"""An eigenvalue is the followed one if its distance from the expected value is below this share of that of the next."""


@dataclass(frozen=True)
class _Followed:
    pole: complex
    slope: complex
    share: float


def followed_pole(eigenvalues: Eigenvalues, start: complex, slope: complex) -> complex:
    """Follow an eigenvalue while the share of a device increases from 0 to 1, and return it at 1.

    The next value is expected on the straight line through the last two. The slope at the start decides between modes
    of the same frequency, of which the device moves only one. Steps after which two eigenvalues could be the followed
    one are divided, because they may otherwise be exchanged where they come near to each other.

    Parameters
    ----------
    eigenvalues
        Eigenvalues at a share, among which the followed one is.
    start
        The eigenvalue at share 0 [rad/s].
    slope
        Its derivative by the share at share 0 [rad/s].
    """
    poles = eigenvalues(0.0)
    followed = _Followed(complex(poles[np.argmin(np.abs(poles - start))]), slope, 0.0)
    for _, share in itertools.pairwise(np.linspace(0.0, 1.0, STEPS + 1)):
        followed = _step(eigenvalues, followed, float(share), 0)
    return followed.pole


def _step(eigenvalues: Eigenvalues, last: _Followed, share: float, halvings: int) -> _Followed:
    poles = eigenvalues(share)
    distances = np.abs(poles - (last.pole + last.slope * (share - last.share)))
    nearest = int(np.argmin(distances))
    rounding = ROUNDING * np.abs(poles[nearest])
    # of equal eigenvalues, as those of a square building in its two directions, it does not matter which one is taken
    others = distances[np.abs(poles - poles[nearest]) > rounding]
    is_expected = distances[nearest] <= rounding
    if not is_expected and halvings < MOST_HALVINGS and np.any(CLEARLY_NEARER * others < distances[nearest]):
        middle = _step(eigenvalues, last, 0.5 * (last.share + share), halvings + 1)
        return _step(eigenvalues, middle, share, halvings + 1)
    pole = complex(poles[nearest])
    return _Followed(pole, (pole - last.pole) / (share - last.share), share)
