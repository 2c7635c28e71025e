"""How base forms with and without effects are compared."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class RaceRules(Section):
    """How base forms with and without effects are compared. All numbers are dimensionless."""

    claim_cost: float = Field(
        0.02,
        ge=0.0,
        description="Share by which each fitted number counts against a model; an effect counts three times.",
    )
    form_lead: float = Field(
        0.1,
        ge=0.0,
        description="Share by which another base form must cost less than the declared one to be taken.",
    )
    noise_share: float = Field(
        0.1,
        ge=0.0,
        description="Differences below this share of the noise do not count, because the noise is not known better.",
    )
    sufficient: float = Field(
        1.25,
        ge=1.0,
        description="A model whose error is at most this multiple of the noise floor needs nothing more; the floor is "
        "known to within a quarter.",
    )
    sufficient_share: float = Field(
        0.015,
        gt=0.0,
        description="The part of such an error that is not noise must also be at most this share of the RMS force. If "
        "the noise is large, its multiple alone would hide an effect.",
    )
    listed_lead: float = Field(
        0.05,
        ge=0.0,
        description="Share by which another base form must fit better than the declared one to be reported as best.",
    )
