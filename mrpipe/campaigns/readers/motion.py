"""One channel of a strong-motion record, whatever the form of its file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from mrpipe.artifacts import FloatArray

_SAME_INTERVAL = 1e-6
"""Relative difference up to which two sampling intervals are the same."""


@dataclass(frozen=True)
class StrongMotion:
    """Acceleration of one channel.

    Attributes
    ----------
    name
        Number and place or direction as the header gives them, such as `3: 90 Deg`.
    acceleration_m_s2
        Shape (n,).
    interval_s
        Sampling interval [s].
    vertical
        Whether the header calls the channel vertical.
    start_s
        Start of the record [s] from a fixed day on; None where the header states none.
    """

    name: str
    acceleration_m_s2: FloatArray
    interval_s: float
    vertical: bool
    start_s: float | None = None

    def at_interval(self, interval_s: float) -> StrongMotion:
        """Return the channel at another sampling interval [s], by a linear-phase filter without delay and aliases."""
        if abs(self.interval_s / interval_s - 1.0) <= _SAME_INTERVAL:
            return self
        # commands that open no record start without scipy
        from scipy.signal import resample_poly

        ratio = Fraction(self.interval_s / interval_s).limit_denominator(1000)
        taps = {"window": ("kaiser", 8.0), "padtype": "line"}
        values = resample_poly(self.acceleration_m_s2, ratio.numerator, ratio.denominator, **taps)
        return replace(self, acceleration_m_s2=np.asarray(values), interval_s=interval_s)
