"""Size of a signal and of an error."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray


def rms(values: FloatArray) -> float:
    """Return the root mean square of values, shape (n,), in their unit; 0 without values."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def nrmse(error: FloatArray, signal: FloatArray) -> float:
    """Return the root mean square of an error over that of the signal [1], both of shape (n,)."""
    return float(np.sqrt(np.mean(np.square(error)) / max(float(np.mean(np.square(signal))), 1e-300)))
