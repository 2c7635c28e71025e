"""Random draws of the noise of a displacement channel: white noise in its band, and rounding errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from mrpipe.artifacts import FloatArray
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.filters import butterworth_lowpass

ROUNDING_TERMS = 6
"""Numerical technique: terms of the series of the rounding error."""

FEWEST_ROUNDED = 16
"""Numerical technique: tests with fewer samples are not interpolated."""


def noisy_motion(recordings: Recordings, rng: np.random.Generator) -> Recordings:
    """Return the tests with one random draw of displacement noise added to their motion.

    Parameters
    ----------
    recordings
        Tests laid end to end.
    rng
        Draws the noise.
    """
    displacement, velocity = recordings.displacement.copy(), recordings.velocity.copy()
    acceleration = recordings.acceleration.copy()
    for test in range(recordings.tests):
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        dt = recordings.dt[test]
        white = rng.standard_normal(piece.stop - piece.start)
        filtered = butterworth_lowpass(white, recordings.noise_band_hz[test], 1.0 / dt)
        rounding, random = rounding_error(recordings, test, rng)
        noise = recordings.displacement_noise[test] * np.sqrt(random) * filtered / max(float(np.std(filtered)), 1e-12)
        noise += rounding
        displacement[piece] += noise
        velocity[piece] += np.gradient(noise, dt)
        acceleration[piece] += np.gradient(np.gradient(noise, dt), dt)
    return replace(recordings, displacement=displacement, velocity=velocity, acceleration=acceleration)


def rounding_error(recordings: Recordings, test: int, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Return the rounding error of the displacement of one test [m], shape (n,), and the share of noise without it.

    Rounding to steps q looks like white noise only while the motion passes many steps from sample to sample. Near a
    reversal the error is a function of the motion, x + e(x), so that a low-pass does not remove it. Noise with standard
    deviation sigma before rounding smooths its mean (Widrow and Kollar, Quantization Noise, 2008): e(x) is the sum over
    k of (-1)^k q / (pi k) exp(-2 (pi k sigma / q)^2) sin(2 pi k x / q). The phase of the steps is not known and is
    drawn at random.

    Parameters
    ----------
    recordings
        Tests laid end to end.
    test
        Index of the test.
    rng
        Random generator for the phase of the steps.
    """
    piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
    step, dither = float(recordings.displacement_rounding[test]), float(recordings.displacement_dither[test])
    motion, dt = recordings.displacement[piece], float(recordings.dt[test])
    if not step > 0.0 or len(motion) < FEWEST_ROUNDED:
        return np.zeros(len(motion)), 1.0
    # the record has more samples than the fit: the filter averages the rounding errors of the samples in between
    stride = max(1, round(dt / float(recordings.recorded_dt[test])))
    fine = np.arange((len(motion) - 1) * stride + 1) / stride
    place = 2.0 * np.pi * (CubicSpline(np.arange(len(motion)), motion)(fine) / step + rng.random())
    error, power = np.zeros(len(fine)), 0.0
    for k in range(1, ROUNDING_TERMS + 1):
        size = step / (np.pi * k) * np.exp(-2.0 * (np.pi * k * dither / step) ** 2)
        error += (-1) ** k * size * np.sin(k * place)
        power += 0.5 * size**2
    filtered = butterworth_lowpass(error, recordings.noise_band_hz[test], stride / dt)
    return np.asarray(filtered[::stride]), max(0.0, 1.0 - power / (step**2 / 12.0 + dither**2))
