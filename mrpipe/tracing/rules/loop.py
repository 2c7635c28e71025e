"""How the closed loop is compared with and without the effects."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class LoopRules(Section):
    """How the closed loop is compared with and without the effects. All numbers are dimensionless."""

    alike: float = Field(
        0.01,
        ge=0.0,
        description="Laws whose RMS responses differ by less than this share are not ranked, because repeated tests "
        "differ as much.",
    )
    diverged: float = Field(
        30.0,
        gt=1.0,
        description="A simulated damper motion beyond this multiple of the tested stroke means that the response grows "
        "without bound.",
    )
    tested: float = Field(
        1.25,
        ge=1.0,
        description="A prediction counts as within the tests if the damper motion is at most this multiple of the "
        "tested stroke; a fitted law is trusted a quarter beyond its data.",
    )
    steady: float = Field(
        0.08,
        gt=0.0,
        description="The base motion is steady if its energy departs from linear growth by less than this share; the "
        "first half of it is then left out as settling.",
    )
    force_changed: float = Field(
        0.01,
        ge=0.0,
        description="The inverse is renewed if the effects change the force by this share (RMS over RMS).",
    )
    most_gain: float = Field(
        2.0,
        gt=1.0,
        description="A gain is recalibrated up to this factor either way; where that does not restore the equivalent "
        "damping, the residual force decides and the gain is kept.",
    )
