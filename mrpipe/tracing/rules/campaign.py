"""What a campaign can show, and how the report divides its residual."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class TestabilityRules(Section):
    """When a campaign can show an effect at all. All numbers are dimensionless."""

    drive_change: float = Field(
        0.05,
        gt=0.0,
        description="The drive varies if its range within a test exceeds this share of the largest drive of the "
        "campaign.",
    )
    frequency_ratio: float = Field(
        1.15,
        gt=1.0,
        description="Tests have several frequencies if the highest exceeds the lowest by this factor.",
    )
    speed_ratio: float = Field(
        1.5,
        gt=1.0,
        description="Speeds vary if the 90 % quantile exceeds the 25 % quantile by this factor: it is 2.6 for a sine "
        "and 1 for triangles of one speed.",
    )
    turning: float = Field(
        0.1,
        gt=0.0,
        description="Motions turn at several positions if these spread by more than this share of the stroke.",
    )
    long_cycles: float = Field(
        20.0,
        gt=0.0,
        description="A long test has this many cycles of motion, far more than the hysteresis needs to settle.",
    )


class LocationRules(Section):
    """How the report divides the residual by the state of the damper. Numbers without a unit are dimensionless."""

    post_yield: float = Field(
        0.9,
        gt=0.0,
        lt=1.0,
        description="The damper has yielded where the hysteretic variable exceeds this share of its final value.",
    )
    drive_rate: float = Field(
        0.05,
        gt=0.0,
        description="The drive rises or falls where its rate exceeds this share of the largest drive in a second.",
    )
