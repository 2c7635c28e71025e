"""Weights of samples: what the sensors' noise makes of the force, and the floor that repeats show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import build_chain
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.kernel import FORCE_AT, run_recordings
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.filters import butterworth_lowpass

LEAST_SHARE = 0.002
"""No sample is trusted better than this share of the force RMS: model error below it is of no interest."""

AVERAGED_S = 0.02
"""Time over which simulated effects of noise are averaged."""


def sensor_deviation(found: Fit, recordings: Recordings, *, draws: int = 3, seed: int = 0) -> FloatArray:
    """Return the standard deviation of the force that the sensors' noise explains [N], shape (n,).

    sigma^2 = sigma_F^2 + (F(x + noise) - F(x))^2, the latter from simulations and averaged over a short while. At a
    reversal the force rises by hundreds of newtons for each millimetre, and micrometres of displacement noise become
    newtons; where the rod rests or creeps they turn the hysteresis back and forth, and what it then makes of the next
    motion is as uncertain: no formula in the present slope sees that.

    Parameters
    ----------
    draws, seed
        Number of noise records simulated, and what they are drawn from.
    """
    chain = build_chain(found.problem.base.steps(found.base_values, *found.laws))
    rng = np.random.default_rng(seed)
    calm = run_recordings(chain, recordings)[FORCE_AT]
    spread = np.zeros(len(calm))
    for _ in range(draws):
        displacement, velocity = _noisy_motion(recordings, rng)
        noisy = run_recordings(chain, replace(recordings, displacement=displacement, velocity=velocity))[FORCE_AT]
        spread += np.square(noisy - calm)
    averaged = _locally_averaged(spread / draws, recordings)
    return np.asarray(np.sqrt(recordings.force_noise[recordings.test] ** 2 + averaged), dtype=np.float64)


def _noisy_motion(recordings: Recordings, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    displacement, velocity = recordings.displacement.copy(), recordings.velocity.copy()
    for test in range(recordings.tests):
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        dt = recordings.dt[test]
        white = rng.standard_normal(piece.stop - piece.start)
        filtered = butterworth_lowpass(white, recordings.noise_band_hz[test], 1.0 / dt)
        noise = recordings.displacement_noise[test] * filtered / max(float(np.std(filtered)), 1e-12)
        displacement[piece] += noise
        velocity[piece] += np.gradient(noise, dt)
    return displacement, velocity


def _locally_averaged(values: FloatArray, recordings: Recordings) -> FloatArray:
    result = np.empty_like(values)
    for test in range(recordings.tests):
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        width = 2 * max(1, round(0.5 * AVERAGED_S / recordings.dt[test])) + 1
        result[piece] = ndimage.uniform_filter1d(values[piece], width, mode="nearest")
    return result


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
