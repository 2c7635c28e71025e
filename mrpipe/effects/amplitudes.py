"""The force that the amplitude of an effect multiplies."""

from __future__ import annotations

from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, YIELD_FORCE

OF_YIELD_FORCE, OF_ONE, OF_DRIVE = 0.0, 1.0, 2.0
"""Kinds of amplitudes: a share of the yield force [1], a force [N], a force for each unit of the drive [N/drive]."""


@njit(float64(float64[::1], float64), cache=True)
def multiplied(wire: FloatArray, kind: float) -> float:
    """Return what an amplitude of a kind multiplies: the yield force [N], one, or the drive [A or V]."""
    force = wire[YIELD_FORCE]
    if kind == OF_ONE:
        force = 1.0
    elif kind == OF_DRIVE:
        force = wire[CURRENT]
    return force
