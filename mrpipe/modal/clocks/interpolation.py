"""Values of a record between its samples.

A cubic spline through the samples is inaccurate for a mode with few samples per period: half a sample away it loses 5 %
of a motion at 0.3 times the sampling rate, and 24 % at 0.4 times. A clock that drifts would then change the amplitude
of the highest modes. The record is therefore first sampled more finely by a low-pass filter, which is exact up to
nearly half the sampling rate, and the spline goes through the fine samples.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import firwin, resample_poly

from mrpipe.artifacts import FloatArray

_FINER = 4
_REACH = 64
"""Number of samples on each side on which a value depends."""
_SHAPE = 6.0
"""Shape of the Kaiser window: errors are about 1e-4."""


class Interpolation:
    """A record as a function of time: a cubic spline through samples at equal intervals.

    The interval of an instant follows from a division; a search for it, as in the spline of scipy, takes most of the
    time of an evaluation.

    Attributes
    ----------
    spline
        The spline.
    interval_s
        Time between its samples [s]; the first sample is at time zero.
    """

    def __init__(self, spline: CubicSpline, interval_s: float) -> None:
        self.spline = spline
        self.interval_s = interval_s

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the values at these times [s], shape (n,)."""
        return self.with_slope(time)[0]

    def with_slope(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the values and the derivatives at these times [s], shape (n,) each."""
        knots, coefficients = self.spline.x, self.spline.c
        place = np.clip((time / self.interval_s).astype(np.int64), 0, coefficients.shape[1] - 1)
        cubic, square, linear, constant = coefficients[:, place]
        since = time - knots[place]
        value = constant + since * (linear + since * (square + since * cubic))
        return value, linear + since * (2.0 * square + since * (3.0 * cubic))


def between_samples(values: FloatArray, sampling_rate_hz: float) -> Interpolation:
    """Return a record as a function of time.

    Parameters
    ----------
    values
        Samples, shape (n,); the first is at time zero.
    sampling_rate_hz
        Sampling rate [Hz].
    """
    taps = firwin(2 * _REACH * _FINER + 1, 1.0 / _FINER, window=("kaiser", _SHAPE))
    # the ends are continued as an odd reflection, so that neither value nor slope jumps there
    reach = min(_REACH, values.size - 1)
    ends = np.pad(values, reach, mode="reflect", reflect_type="odd")
    fine = resample_poly(ends, _FINER, 1, window=taps)[reach * _FINER : (reach + values.size - 1) * _FINER + 1]
    rate_hz = _FINER * sampling_rate_hz
    return Interpolation(CubicSpline(np.arange(fine.size) / rate_hz, fine), 1.0 / rate_hz)
