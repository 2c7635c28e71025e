"""Reversals of a motion: when the last one was, and how far the motion has gone since."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray, IntArray


def last_reversal(direction: FloatArray | BoolArray) -> IntArray:
    """Return the index of the sample at which the direction last changed, shape (n,); 0 before the first change.

    Parameters
    ----------
    direction
        Direction of the motion, such as the sign of the velocity, shape (n,).
    """
    turned = np.concatenate([[0], np.flatnonzero(direction[1:] != direction[:-1]) + 1])
    which = np.searchsorted(turned, np.arange(len(direction)), side="right") - 1
    return np.asarray(turned[which], dtype=np.int64)


def path_since_reversal(velocity: FloatArray, dt: float) -> FloatArray:
    """Return the path since the velocity last changed its sign, or since the first sample, shape (n,).

    Parameters
    ----------
    velocity
        Shape (n,), in a unit of length per second.
    dt
        Sampling interval [s].
    """
    path = np.cumsum(np.abs(velocity)) * dt
    return np.asarray(path - path[last_reversal(np.sign(velocity))])
