"""The least standard errors that the noise of forced tests allows for the modes of a virtual tower.

The Cramér-Rao bound of the true model: the excitation and the noise of the sensors are known, natural frequencies and
damping ratios are common to the tests, and each mode has one complex amplitude for each sensor and test. These
amplitudes are nuisance parameters and contain cross-talk and the delays of the clocks. Noise of the excitation is
neglected: at a mode without a peak, the noise of the sensors is larger. No unbiased method has a smaller error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.modal.records import FrameTest
from tests.modal.towers import Tower


def _accelerance(line: np.ndarray, omega: np.ndarray, zeta: np.ndarray) -> np.ndarray:
    """Return the acceleration of each mode over its modal force, shape (lines, modes); angular frequencies [rad/s]."""
    return -(line[:, None] ** 2) / (omega**2 - line[:, None] ** 2 + 2j * zeta * omega * line[:, None])


def least_errors(tower: Tower, tests: Sequence[FrameTest], noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the least relative standard errors of natural frequencies and of damping ratios, shape (modes,) each.

    Parameters
    ----------
    tower
        The true structure.
    tests
        Forced tests with the excitation on a floor.
    noise
        Standard deviation of the noise of a sensor over that of its response [1].

    Returns
    -------
    Standard errors of the logarithms of frequency and damping ratio [1]; Kay, Fundamentals of Statistical Signal
    Processing: Estimation Theory (1993), section 3.9, for Gaussian noise.
    """
    omega, zeta = 2.0 * np.pi * tower.frequencies_hz, tower.damping_ratios
    modes, step = tower.floors, 1e-5
    information = np.zeros((2 * modes, 2 * modes))
    for test in tests:
        samples = test.excitation.size
        frequency = np.fft.rfftfreq(samples, 1.0 / test.sampling_rate_hz)
        inside = (frequency > 0.4 * tower.frequencies_hz[0]) & (frequency < 1.15 * tower.frequencies_hz[-1])
        line = 2.0 * np.pi * frequency[inside]
        force = np.fft.rfft(test.excitation)[inside, None]
        known = force * _accelerance(line, omega, zeta)
        by_omega = [force * _accelerance(line, omega * (1.0 + sign * step), zeta) for sign in (1.0, -1.0)]
        by_zeta = [force * _accelerance(line, omega, zeta * (1.0 + sign * step)) for sign in (1.0, -1.0)]
        slopes = np.hstack([(pair[0] - pair[1]) / (2.0 * step) for pair in (by_omega, by_zeta)])
        q = np.linalg.qr(known)[0]
        slopes = slopes - q @ (q.conj().T @ slopes)
        rows = [sensor.floor - 1 for sensor in test.sensors]
        amplitudes = tower.shapes[rows] * tower.shapes[next(iter(test.inputs)).floor - 1]
        # the variance of a record contains its noise
        variance = samples * test.responses.var(axis=0) * noise**2 / (1.0 + noise**2)
        weight = np.tile((amplitudes / variance[:, None]).T @ amplitudes, (2, 2))
        information += 2.0 * np.real(slopes.conj().T @ slopes * weight)
    errors = np.sqrt(np.diag(np.linalg.inv(information)))
    return errors[:modes], errors[modes:]
