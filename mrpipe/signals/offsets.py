"""Static offsets of sensors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray


def balanced_extremes(values: FloatArray, cycles: IntArray) -> float:
    """Return the offset that makes the positive and negative maxima of the steady cycles equal (thesis 2.3.1).

    Parameters
    ----------
    values
        Low-passed channel, shape (n,).
    cycles
        Start indices of the steady cycles and the end of the last one; the median over cycles is taken.
    """
    middles = [
        0.5 * (float(np.max(values[begin:end])) + float(np.min(values[begin:end]))) for begin, end in pairwise(cycles)
    ]
    return float(np.median(middles))


def mean_over_cycles(values: FloatArray, cycles: IntArray) -> float:
    """Return the mean over whole cycles: the offset of an acceleration, whose extremes are distorted by knocks."""
    return float(np.mean(values[cycles[0] : cycles[-1]]))


def force_intercept(displacement: FloatArray, velocity: FloatArray, drive: FloatArray, force: FloatArray) -> float:
    """Return the offset of a force under random motion, whose mean and extremes are not symmetric.

    It is the constant of a least-squares fit of the force by displacement and by odd functions of velocity (linear and
    saturating), each multiplied by powers 0, 1, 2 of the drive. The mean of the force would contain the mean of these
    terms.

    Parameters
    ----------
    displacement, velocity, drive, force
        Shape (n,).
    """
    speed = float(np.sqrt(np.mean(velocity**2))) or 1.0
    stroke = float(np.std(displacement)) or 1.0
    level = drive / (float(np.max(np.abs(drive))) or 1.0)
    odd = [velocity / speed, np.tanh(5.0 * velocity / speed), (displacement - displacement.mean()) / stroke]
    powers = [np.ones_like(level)] if np.ptp(level) < 1e-3 else [np.ones_like(level), level, level**2]
    columns = [np.ones_like(force), *(term * power for term in odd for power in powers)]
    solution = np.linalg.lstsq(np.column_stack(columns), force, rcond=None)[0]
    return float(solution[0])


def drive_favours_a_side(drive: FloatArray, cycles: IntArray) -> bool:
    """Return whether the drive differs between the two halves of a cycle, which unbalances the extremes of the force.

    Parameters
    ----------
    drive
        Shape (n,).
    cycles
        Start indices of the steady cycles and the end of the last one.
    """
    half = round(float(np.mean(np.diff(cycles))) / 2.0)
    early = drive[cycles[0] : cycles[-1] - half]
    late = drive[cycles[0] + half : cycles[-1]]
    return float(np.sqrt(np.mean((early - late) ** 2))) > 0.05 * float(np.max(np.abs(drive)))
