"""Size of a signal and of an error."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.words import in_percent

HARDLY = 0.02
"""Changes of a signal over its RMS value up to which it counts as constant with the noise of a sensor."""


def rms(values: FloatArray) -> float:
    """Return the root mean square of values, shape (n,), in their unit; 0 without values."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def nrmse(error: FloatArray, signal: FloatArray) -> float:
    """Return the root mean square of an error over that of the signal [1], both of shape (n,)."""
    return float(np.sqrt(np.mean(np.square(error)) / max(float(np.mean(np.square(signal))), 1e-300)))


def doubt_about_fit(nrmse: float, fit_percent: float, quantity: str) -> str | None:
    """Return why the fit of the validation tests is not defined, or says little; None where it is meaningful.

    Parameters
    ----------
    nrmse, fit_percent
        Errors pooled over the validation tests; NaN where they are not defined.
    quantity
        What the model predicts: `force` or `drive`.
    """
    what = f"the fit compares the error with the changes of the {quantity}"
    remedy = f"judge by the NRMSE, or add a validation test in which the {quantity} changes"
    if np.isfinite(fit_percent):
        share = nrmse / max(1.0 - fit_percent / 100.0, 1e-300)
        if share > HARDLY:
            return None
        return (
            f"the {quantity} of the validation tests changes by {in_percent(share, digits=2)} of its RMS value "
            f"only; {what}, so that it says little: {remedy}"
        )
    if np.isfinite(nrmse):
        return f"the {quantity} of the validation tests is constant; {what}, so that it is not defined: {remedy}"
    return f"no validation test has a {quantity} other than zero, so that no relative error is defined"
