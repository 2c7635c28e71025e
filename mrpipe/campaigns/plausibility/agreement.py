"""Agreement of the force of one test with the prediction of the other tests, and the error of this prediction."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.plausibility.reference import Normal, ReferenceMap, Slow

SHAPE_COUNTS = 0.5
"""Correlation from which the shape of a test's force takes part in the estimate of its own gain."""


@dataclass(frozen=True)
class Agreement:
    """Agreement of one test with the prediction of the others.

    Attributes
    ----------
    gain
        Measured over predicted force by least squares.
    correlation
        Correlation of measured and predicted force.
    log_gain_error
        Standard error of log(gain) by the jackknife over the other tests; infinite where the prediction depends on
        single tests so much that it is not usable.
    highest_correlation
        Highest correlation that any jackknife prediction reaches.
    """

    gain: float
    correlation: float
    log_gain_error: float
    highest_correlation: float

    @property
    def log_gain(self) -> float:
        """Natural logarithm of the gain; a large negative number where the gain is not positive."""
        return float(np.log(max(self.gain, 1e-12)))


def log_gain_of(reference: ReferenceMap, index: int, without: Collection[int]) -> float:
    """Return the logarithm of the gain of a test against all tests but those in `without`."""
    part = reference.parts[index]
    gain, correlation = fit(part, reference.coefficients(without))
    if correlation > SHAPE_COUNTS:
        gain = float(reference.joint_gains(part, without, np.array([gain]), jackknife=False)[0])
    return float(np.log(max(gain, 1e-12)))


def agreement(reference: ReferenceMap, part: Normal, without: Collection[int]) -> Agreement:
    """Compare a test, given by its normal equations, with the prediction of all tests but those in `without`."""
    gain, correlation = fit(part, reference.coefficients(without))
    others = [index for index in range(len(reference.parts)) if index not in without]
    if len(others) < 2:
        return Agreement(gain, correlation, float("inf"), correlation)
    trials = [fit(part, coefficients) for coefficients in reference.jackknife(without)]
    correlations = np.array([item[1] for item in trials])
    gains = np.array([item[0] for item in trials])
    if correlation > SHAPE_COUNTS:
        gain = float(reference.joint_gains(part, without, np.array([gain]), jackknife=False)[0])
        gains = reference.joint_gains(part, without, gains, jackknife=True)
    if gain <= 0.0 or np.any(gains <= 0.0):
        error = float("inf")
    else:
        logs = np.log(gains)
        error = float(np.sqrt((len(others) - 1) / len(others) * np.sum((logs - logs.mean()) ** 2)))
    return Agreement(gain, correlation, error, float(correlations.max()))


def fit(part: Normal, coefficients: FloatArray) -> tuple[float, float]:
    """Return gain and correlation of a test against the prediction with these coefficients."""
    product = float(coefficients @ part.vector)
    power = float(coefficients @ part.matrix @ coefficients)
    if power <= 0.0 or part.power <= 0.0:
        return 0.0, 0.0
    return product / power, product / float(np.sqrt(power * part.power))


def delay(test: Slow, expected: FloatArray) -> float:
    """Return the delay [s] of the force of a test relative to the prediction, from the highest cross-correlation.

    Lags up to a quarter of a second are searched; a parabola interpolates between samples.
    """
    force = test.force - np.mean(test.force)
    longest = min(int(0.25 / test.interval_s) + 2, force.size // 4)
    if longest < 2:
        return 0.0
    size = 2 * force.size
    product = np.fft.irfft(np.fft.rfft(force, size) * np.conj(np.fft.rfft(expected, size)), size)
    around = np.concatenate((product[-longest:], product[: longest + 1]))
    peak = int(np.argmax(around))
    if not 0 < peak < around.size - 1:
        return 0.0
    left, middle, right = around[peak - 1 : peak + 2]
    curve = left - 2.0 * middle + right
    return float((peak - longest + (0.5 * (left - right) / curve if curve < 0.0 else 0.0)) * test.interval_s)
