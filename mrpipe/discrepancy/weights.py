"""Weights of samples: what the sensors' noise makes of the force, and the floor that repeats show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.discrepancy.engine import Fit, chain_of
from mrpipe.discrepancy.kernel import CURRENT_AT, HYSTERESIS_AT, run_recordings
from mrpipe.discrepancy.recordings import Recordings

LEAST_SHARE = 0.002
"""No sample is trusted better than this share of the force RMS: model error below it is of no interest."""


def sensor_deviation(found: Fit, recordings: Recordings) -> FloatArray:
    """Return the standard deviation of the force that the sensors' noise explains [N], shape (n,).

    sigma^2 = sigma_F^2 + (dF/dx sigma_x)^2 + (dF/dv sigma_v)^2: at a reversal the force rises by hundreds of newtons
    for each millimetre, and micrometres of displacement noise become newtons.
    """
    problem = found.problem
    wires = run_recordings(chain_of(problem, found.theta)[0], recordings)
    yield_force, viscosity = found.polynomials
    u = wires[CURRENT_AT]
    values = found.base_values
    share = values.get("gamma_share", problem.base.gamma_share)
    y = np.sign(recordings.velocity) * wires[HYSTERESIS_AT]
    fall = np.where(y >= 0.0, np.abs(y) ** 2, (1.0 - 2.0 * share) * np.abs(y) ** 2)
    slope = np.polynomial.polynomial.polyval(u, yield_force) * (1.0 - fall) / values["yield_displacement"]
    drag = np.polynomial.polynomial.polyval(u, viscosity)
    test = recordings.test
    variance = (
        recordings.force_noise[test] ** 2
        + (slope * recordings.displacement_noise[test]) ** 2
        + (drag * recordings.velocity_noise[test]) ** 2
    )
    return np.asarray(np.sqrt(variance), dtype=np.float64)


def force_deviation(found: Fit, recordings: Recordings, model_error_share: float = 0.0) -> FloatArray:
    """Return the deviation that weights go by [N], shape (n,): of the sensors and of what a model cannot follow.

    Parameters
    ----------
    model_error_share
        Model error to reckon with, as a share of the force RMS.
    """
    floor = max(LEAST_SHARE, model_error_share) * recordings.force_rms
    return np.asarray(np.hypot(sensor_deviation(found, recordings), floor), dtype=np.float64)


def repeated_pairs(recordings: Recordings) -> list[tuple[int, int]]:
    """Return pairs of tests whose motion and drive are the same but for what the machine cannot repeat."""
    pairs = []
    starts = recordings.starts
    drive_scale = max(float(np.max(np.abs(recordings.drive))), 1e-12)
    for first in range(recordings.tests):
        for second in range(first + 1, recordings.tests):
            if starts[first + 1] - starts[first] != starts[second + 1] - starts[second]:
                continue
            a, b = slice(starts[first], starts[first + 1]), slice(starts[second], starts[second + 1])
            x, y = recordings.displacement[a], recordings.displacement[b]
            same = np.std(x - y) < 0.04 * np.std(x)
            alike = np.sqrt(np.mean((recordings.drive[a] - recordings.drive[b]) ** 2)) < 0.02 * drive_scale
            if same and alike and np.std(x) > 0.0:
                pairs.append((first, second))
    return pairs


def noise_of_repeats(
    residual: FloatArray, recordings: Recordings, pairs: Sequence[tuple[int, int]]
) -> tuple[float, int]:
    """Return half the mean square of the difference of the residuals of repeated tests, and how many samples tell it.

    A model's error is the same function of the motion in both, so it cancels; noise does not.
    """
    total, count = 0.0, 0
    starts = recordings.starts
    for first, second in pairs:
        a = residual[starts[first] : starts[first + 1]]
        b = residual[starts[second] : starts[second + 1]]
        both = (a != 0.0) & (b != 0.0)
        # a slow difference is what the machine did not repeat, the model follows it: only the rest is noise of sensors
        total += float(np.sum((a[both] - b[both]) ** 2)) / 2.0
        count += int(np.count_nonzero(both))
    return (total / count if count else 0.0), count
