"""How the errors on the validation tests decide a verdict, and when something remains unexplained."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class ValidationRules(Section):
    """How the errors on the validation tests decide the class of a verdict. All numbers are dimensionless."""

    within_floors: float = Field(
        1.25,
        gt=0.0,
        description="The error is at the noise floor if it is at most this multiple of it. The floor itself is known "
        "to within a quarter on rigs with known noise.",
    )
    noise_floors: float = Field(
        2.0,
        gt=0.0,
        description="Above this multiple of the noise floor the residual is not noise: twice the floor means that at "
        "most a quarter of the squared error is noise.",
    )
    ceiling_share: float = Field(
        0.9,
        gt=0.0,
        lt=1.0,
        description="The named effects explain a validation test if they remove this share of the squared error that "
        "a flexible model can remove; the rest is within the spread of such models.",
    )
    failed: float = Field(
        0.5,
        gt=0.0,
        description="Above this NRMSE the base model does not predict the validation tests: at 0.5 a quarter of the "
        "squared force is missing, more than any single effect of the planted benchmark contributes.",
    )
    fewest_training: int = Field(
        2,
        ge=1,
        description="Harmed training tests are left out only if this many training tests remain, because tests are "
        "judged by comparison.",
    )
    worst_share: float = Field(
        0.9,
        gt=0.0,
        le=1.0,
        description="Quantile of the relative errors of left-out training tests with which validation tests are "
        "compared.",
    )
    odd_ratio: float = Field(
        2.0,
        gt=0.0,
        description="A validation test is odd if its relative error exceeds this multiple of what left-out training "
        "tests have; twice means four times the squared error.",
    )
    accounts: float = Field(
        0.5,
        gt=0.0,
        description="A difference accounts for the error if it removes this share of the excess squared error, that "
        "is most of it.",
    )
    deviation: float = Field(
        0.03,
        gt=0.0,
        description="A gain that differs from 1 by less is not reported, because it is within the accuracy of "
        "load cells and their amplifiers.",
    )
    spreads: float = Field(
        4.0,
        gt=0.0,
        description="A gain, lag or offset is odd if it differs from the training tests' median by this many standard "
        "deviations.",
    )
    outside: float = Field(
        0.05,
        gt=0.0,
        description="Share of the samples beyond the range of the training tests that makes the range a difference.",
    )
    level: float = Field(
        0.1,
        gt=0.0,
        description="A drive is between the levels of the training tests if it differs from the nearest one by this "
        "share of the largest drive.",
    )
    margin: float = Field(
        0.05,
        gt=0.0,
        description="A sample is beyond the range of the training tests if it exceeds it by this share of the range.",
    )
    yielded: float = Field(
        0.7,
        gt=0.0,
        description="If the hysteretic variable, 1 when the damper has yielded, stays below this in all tests, the "
        "damper does not yield within its stroke: hysteresis, springs and friction cannot be separated.",
    )
    first_part: float = Field(
        1.0 / 3.0,
        gt=0.0,
        lt=1.0,
        description="Share of a validation record from which gain, lag or offset are estimated; errors are those of "
        "the rest.",
    )
    lag_periods: float = Field(
        0.2,
        gt=0.0,
        description="Longest lag that is looked for, in mean periods of the motion; beyond it lag and sign cannot be "
        "separated.",
    )
    whiteness: float = Field(
        1e-6,
        gt=0.0,
        lt=1.0,
        description="Largest probability of a residual's autocorrelation or dependence on states by chance; it is as "
        "small because samples are many and noise of real sensors is not perfectly white.",
    )
    seed: int = Field(
        0,
        ge=0,
        description="Seed of the bootstrap that gives the interval of the error of a flexible model. Every test is "
        "resampled from the same seed, so that chance does not favour one of two models.",
    )


class RemainderRules(Section):
    """When something remains unexplained, and how it is reported. All numbers are dimensionless."""

    of_excess: float = Field(
        0.1,
        ge=0.0,
        description="With named effects, something remains if it is this share of the residual before them.",
    )
    listed: float = Field(
        0.01,
        ge=0.0,
        description="A state is listed under `depends_on` if it explains this share of the residual's variance.",
    )
