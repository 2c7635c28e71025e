"""Errors of free-running simulations on tests: NRMSE and fit, per test and pooled, and the offset of the force."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.error_size import rms
from mrpipe.tracing.verdict import Score


@dataclass(frozen=True)
class JudgedPart:
    """Part of the validation tests on which errors are judged.

    Attributes
    ----------
    recordings
        The validation tests; samples from which offsets are estimated are not compared.
    measured
        Offset-free measured force [N], shape (n,).
    offsets
        Offset of each test [N], shape (tests,).
    """

    recordings: Recordings
    measured: FloatArray
    offsets: FloatArray


def judged_part(recordings: Recordings, simulated: FloatArray, offset: float | None, first: BoolArray) -> JudgedPart:
    """Return the offset-free measured force and the samples on which errors are judged.

    Parameters
    ----------
    recordings
        Validation tests.
    simulated
        Force of the final model [N], shape (n,).
    offset
        Offset of the campaign [N], from the training tests. None: every test has a separate offset, the mean difference
        over the first part of the record, and that part is not judged.
    first
        Samples of the first parts, shape (n,).
    """
    if offset is not None:
        return JudgedPart(recordings, recordings.force - offset, np.full(recordings.tests, offset))
    test, early = recordings.test, recordings.used & first
    counts = np.maximum(np.bincount(test[early], minlength=recordings.tests), 1)
    sums = np.bincount(test[early], weights=(recordings.force - simulated)[early], minlength=recordings.tests)
    offsets = np.asarray(sums / counts)
    rest = replace(recordings, used=recordings.used & ~first)
    return JudgedPart(rest, recordings.force - offsets[test], offsets)


def campaign_offset(
    recordings: Recordings, residual: FloatArray, offsets: FloatArray, first: BoolArray
) -> float | None:
    """Return the common offset of all training tests [N]; None if separate estimates are more accurate.

    Both are judged on the training tests: the offset of the later part of a test is predicted from its first part, or
    from all tests together.

    Parameters
    ----------
    recordings
        Training tests.
    residual
        Measured minus simulated force without offsets [N], shape (n,).
    offsets
        Offset of each test [N].
    first
        Samples of the first parts, shape (n,).
    """
    early, late = (_means(recordings, residual, recordings.used & part) for part in (first, ~first))
    early, late = early + offsets, late + offsets
    shared = float(np.median(offsets))
    by_test = float(np.mean((early - late) ** 2))
    return shared if float(np.mean((shared - late) ** 2)) <= by_test else None


def _means(recordings: Recordings, values: FloatArray, part: BoolArray) -> FloatArray:
    counts = np.maximum(np.bincount(recordings.test[part], minlength=recordings.tests), 1)
    sums = np.bincount(recordings.test[part], weights=values[part], minlength=recordings.tests)
    return np.asarray(sums / counts)


def score(recordings: Recordings, measured: FloatArray, simulated: FloatArray) -> Score:
    """Return the errors over the samples that are compared; each test is weighted by its duration."""
    used = recordings.used
    error = measured - simulated
    by_test = {}
    for index, name in enumerate(recordings.names):
        own = used & (recordings.test == index)
        if own.any():
            by_test[name] = relative_rms(error[own], measured[own])
    spread = measured[used] - np.mean(measured[used])
    return Score(
        nrmse=relative_rms(error[used], measured[used]),
        fit_percent=100.0 * (1.0 - float(np.linalg.norm(error[used])) / max(float(np.linalg.norm(spread)), 1e-12)),
        by_test=by_test,
    )


def relative_rms(error: FloatArray, measured: FloatArray) -> float:
    """Return the root mean square of an error over that of the measured signal; 0 without samples."""
    return rms(error) / max(rms(measured), 1e-12)
