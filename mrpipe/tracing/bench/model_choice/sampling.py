"""Rate at which models are fitted: the given rate, or a multiple of it if the error is then clearly smaller.

Forces are picked from the records at a reduced rate, because most of them change slowly. A force that depends on
velocity, or that went through a filter, changes within a few milliseconds. The model cannot represent this change
between two samples of a reduced rate, and its parameters become biased. Only a model with the effect shows this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.fitting.engine import Fit, fit
from mrpipe.fitting.recordings import MOST_SAMPLES, record_tests
from mrpipe.signals.prepared import PreparedTest

RATIO = 2.0
"""Numerical technique: ratio of successive rates."""

ITERATIONS = 4
"""Numerical technique: iterations of each fit of the chosen model."""


def better_rate(
    found: Fit,
    tests: Sequence[PreparedTest],
    *,
    rate_hz: float,
    cutoff_hz: float = 0.0,
    highest_cutoff_hz: float = np.inf,
    gain: float,
) -> float:
    """Return the rate [Hz] at which the error of a chosen model is clearly smaller than at half this rate.

    It is the given rate if there is no such higher rate.

    Parameters
    ----------
    found
        Chosen model, fitted to the training tests.
    tests
        Training tests.
    rate_hz
        Rate at which the model was chosen [Hz].
    cutoff_hz, highest_cutoff_hz
        Filter of the displacement with which the model was chosen, see :func:`mrpipe.fitting.recordings.record_tests`.
    gain
        Share by which the RMS of the residual must fall from one rate to the next.
    """
    recorded = max(test.sampling_rate_hz for test in tests)

    def again(start: Fit, rate: float) -> Fit:
        # a limit that was chosen at a low rate can hide an effect that a higher rate shows
        fits = [at_rate(start, rate, limit) for limit in sorted({highest_cutoff_hz, np.inf})]
        return min(fits, key=lambda item: item.chi_square)

    def at_rate(start: Fit, rate: float, limit: float) -> Fit:
        recordings = record_tests(
            tests,
            rate_hz=rate,
            cutoff_hz=cutoff_hz,
            highest_cutoff_hz=limit,
            # as long as at the given rate
            most_samples=round(MOST_SAMPLES * rate / rate_hz),
        )
        weight = recordings.used / found.problem.scales.force
        return fit(
            replace(found.problem, recordings=recordings, root_weight=weight), start.theta, iterations=ITERATIONS
        )

    best, present = rate_hz, again(found, rate_hz)
    while RATIO * best <= recorded:
        faster = again(present, RATIO * best)
        if np.sqrt(faster.chi_square) > (1.0 - gain) * np.sqrt(present.chi_square):
            break
        best, present = RATIO * best, faster
    return best
