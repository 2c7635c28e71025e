"""Hysteresis and lag of the drive over a recording, step by step with the functions that the kernels compile."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.drive import advance_lag
from mrpipe.dampers.hysteresis import advance_hysteresis


def hysteresis_series(
    displacement: FloatArray, yield_displacement: float, gamma_share: float = 0.5, exponent: float = 2.0
) -> FloatArray:
    """Return zeta, shape (n,), over a displacement [m]; zeta starts at 0."""
    zeta = np.zeros(len(displacement))
    for place, increment in enumerate(np.diff(displacement), 1):
        zeta[place] = advance_hysteresis(zeta[place - 1], increment, yield_displacement, gamma_share, exponent)
    return zeta


def lag_series(drive: FloatArray, dt: float, eta: float) -> FloatArray:
    """Return the effective drive, shape (n,), for a command and a rate of the lag [1/s]; it starts at the command."""
    lagged = np.array(drive, dtype=np.float64)
    for place in range(1, len(drive)):
        lagged[place] = advance_lag(lagged[place - 1], drive[place - 1], drive[place], eta * dt)
    return lagged
