"""Moving averages over a share of the period of each test."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.fitting.recordings import Recordings


def moving_average(columns: FloatArray, recordings: Recordings, window_share: float) -> FloatArray:
    """Return rows after a centred moving average over a share of each test's period.

    Tests without a period are not changed.

    Parameters
    ----------
    columns
        Rows of samples, shape (c, n) or (n,).
    recordings
        Tests that the n samples belong to.
    window_share
        Length of the window, as a share of the period.
    """
    result = columns.copy()
    for test in range(recordings.tests):
        half = 0.5 * window_share * recordings.period_s[test] / recordings.dt[test]
        if half < 0.05:
            continue
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        values = columns[..., piece]
        length = values.shape[-1]
        # the window need not be a whole number of samples: integral of the piecewise linear signal between shifted
        # limits
        total = np.zeros((*values.shape[:-1], length))
        total[..., 1:] = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1)
        at = np.arange(length)
        low, high = np.maximum(at - half, 0.0), np.minimum(at + half, length - 1.0)
        result[..., piece] = (_at(total, high) - _at(total, low)) / (high - low)
    return result


def _at(total: FloatArray, place: FloatArray) -> FloatArray:
    whole = np.minimum(place.astype(np.int64), total.shape[-1] - 2)
    part = place - whole
    return np.asarray(total[..., whole] * (1.0 - part) + total[..., whole + 1] * part)
