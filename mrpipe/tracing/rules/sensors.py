"""When faults of the sensors are taken as real: offsets of the load cell, gains of sessions, filters of the records."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class OffsetRules(Section):
    """When a load cell whose zero moves between tests is named. All numbers are dimensionless."""

    fewest_tests: int = Field(
        4, ge=2, description="Tests from which a spread of the offsets between them is estimated."
    )
    least_spread: float = Field(
        0.01,
        gt=0.0,
        description="Spread of the offsets, as a share of the RMS force, below which the zero of the load cell counts "
        "as steady.",
    )
    least_excess: float = Field(
        0.2,
        gt=0.0,
        description="One common offset must raise the chi-square by this share, else the tests do not require separate "
        "ones.",
    )
    clear: float = Field(
        3.0,
        gt=0.0,
        description="With an unexplained residual, offsets are named only if they spread by this multiple of its RMS.",
    )
    confidence: float = Field(
        0.97,
        gt=0.0,
        lt=1.0,
        description="Confidence of this finding, which compares two fits of the same model and has no rival effect.",
    )


class NuisanceRules(Section):
    """When gains of sessions and filters of the records are taken as real. All numbers are dimensionless."""

    least_gain: float = Field(
        0.05,
        gt=0.0,
        lt=1.0,
        description="A moving average of the records, or a lag that differs between rising and falling drive, must "
        "remove this share of the sum of squares.",
    )
    filter_gain: float = Field(
        0.01,
        ge=0.0,
        lt=1.0,
        description="The displacement is filtered below the cut-off that its spectrum suggests if a base form then "
        "leaves an error that is smaller by this share.",
    )
    filter_doubt: float = Field(
        0.25,
        ge=0.0,
        description="The noise that all tests share is removed from the displacement unless simple base forms leave "
        "less by this share behind a low-pass.",
    )
    filter_again: float = Field(
        0.05,
        ge=0.0,
        lt=1.0,
        description="The displacement is filtered with another limit, and everything is chosen again, if the chosen "
        "model then leaves an error that is smaller by this share.",
    )
    rate_gain: float = Field(
        0.1,
        ge=0.0,
        lt=1.0,
        description="Models are fitted at twice the rate, and everything is chosen again, if the chosen model then "
        "leaves an error that is smaller by this share.",
    )
    fewest_of_session: int = Field(
        3, ge=2, description="Number of records that must agree on a gain before it counts as a gain of the session."
    )
    spreads: float = Field(
        2.0,
        gt=0.0,
        description="The gain of a record differs if it lies this many standard deviations of the training tests' "
        "gains from 1.",
    )
    agreement: float = Field(
        0.5,
        gt=0.0,
        description="Gains of a session agree if their standard deviation is below this share of their mean distance "
        "from 1.",
    )
