"""Every threshold by which the tracing decides, with its unit, what it decides and why it has this value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ValidationRules:
    """How the errors on the validation tests decide the class of a verdict. All numbers are dimensionless.

    Attributes
    ----------
    within_floors
        The error is at the noise floor if it is at most this multiple of it. The floor itself is known to within a
        quarter on rigs with known noise.
    noise_floors
        Above this multiple of the noise floor the residual is not noise: twice the floor means that at most a quarter
        of the squared error is noise.
    ceiling_share
        The named effects explain a validation test if they remove this share of the squared error that a flexible
        model can remove; the rest is within the spread of such models.
    failed
        Above this NRMSE the base model does not predict the validation tests: at 0.5 a quarter of the squared force
        is missing, more than any single effect of the planted benchmark contributes.
    odd_ratio
        A validation test is odd if its relative error exceeds this multiple of what left-out training tests have;
        twice means four times the squared error.
    accounts
        A difference accounts for the error if it removes this share of the excess squared error, that is most of it.
    deviation
        A gain that differs from 1 by less is not reported: load cells and their amplifiers are no better.
    spreads
        A gain, lag or offset is odd if it differs from the training tests' median by this many standard deviations.
    outside
        Share of the samples beyond the range of the training tests that makes the range a difference.
    level
        A drive is between the levels of the training tests if it differs from the nearest one by this share of the
        largest drive.
    margin
        A sample is beyond the range of the training tests if it exceeds it by this share of the range.
    yielded
        If the hysteretic variable, 1 when the damper has yielded, stays below this in all tests, the damper does not
        yield within its stroke: hysteresis, springs and friction cannot be separated.
    first_part
        Share of a validation record from which gain, lag or offset are estimated; errors are those of the rest.
    lag_periods
        Longest lag that is looked for, in mean periods of the motion; beyond it lag and sign cannot be separated.
    whiteness
        Largest probability of a residual's autocorrelation or dependence on states by chance; it is as small because
        samples are many and noise of real sensors is not perfectly white.
    """

    within_floors: float = 1.25
    noise_floors: float = 2.0
    ceiling_share: float = 0.9
    failed: float = 0.5
    odd_ratio: float = 2.0
    accounts: float = 0.5
    deviation: float = 0.03
    spreads: float = 4.0
    outside: float = 0.05
    level: float = 0.1
    margin: float = 0.05
    yielded: float = 0.7
    first_part: float = 1.0 / 3.0
    lag_periods: float = 0.2
    whiteness: float = 1e-6
