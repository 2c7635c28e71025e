"""Errors on tests, free-run: NRMSE and fit as the contract defines them, per test and pooled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.fitting.recordings import Recordings

STEADY_SHARE = 0.02
"""Offsets of the training tests that spread by less than this share of the force RMS are one of the whole campaign."""


@dataclass(frozen=True)
class Score:
    """Errors of one model on some tests."""

    nrmse: float
    fit_percent: float
    by_test: dict[str, float]


def measured_force(recordings: Recordings, simulated: FloatArray, offset: float | None) -> FloatArray:
    """Return the offset-free measured force [N], shape (n,).

    Parameters
    ----------
    simulated
        Force of the final model; where no offset of the campaign is known, a test's own is the mean of what it leaves.
    offset
        Offset of the campaign [N], from the training tests; None where each test has its own.
    """
    if offset is not None:
        return recordings.force - offset
    test, used = recordings.test, recordings.used
    counts = np.maximum(np.bincount(test[used], minlength=recordings.tests), 1)
    means = np.bincount(test[used], weights=(recordings.force - simulated)[used], minlength=recordings.tests) / counts
    return np.asarray(recordings.force - means[test])


def campaign_offset(offsets: FloatArray, force_rms: float) -> float | None:
    """Return the offset that all training tests share [N], or None where they differ."""
    return float(np.median(offsets)) if float(np.std(offsets)) < STEADY_SHARE * force_rms else None


def score(recordings: Recordings, measured: FloatArray, simulated: FloatArray) -> Score:
    """Return the errors over the samples compared; each test is weighed by its length."""
    used = recordings.used
    error = measured - simulated
    by_test = {}
    for index, name in enumerate(recordings.names):
        own = used & (recordings.test == index)
        if own.any():
            by_test[name] = _rms(error[own]) / max(_rms(measured[own]), 1e-12)
    spread = measured[used] - np.mean(measured[used])
    return Score(
        nrmse=_rms(error[used]) / max(_rms(measured[used]), 1e-12),
        fit_percent=100.0 * (1.0 - float(np.linalg.norm(error[used])) / max(float(np.linalg.norm(spread)), 1e-12)),
        by_test=by_test,
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0
