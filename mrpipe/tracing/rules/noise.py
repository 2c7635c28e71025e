"""How the noise of a bench campaign is estimated, and when it is not the measure of a residual."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class NoiseRules(Section):
    """How the noise of a bench campaign is estimated. Numbers without a unit are dimensionless."""

    least_share: float = Field(
        0.002,
        ge=0.0,
        description="Least standard deviation of a sample, as a share of the RMS force: a smaller error of the model "
        "has no consequence.",
    )
    same_drive: float = Field(
        0.02,
        gt=0.0,
        description="Two tests or cycles have the same drive if their RMS difference is below this share of the "
        "largest drive.",
    )
    same_motion: float = Field(
        0.04,
        gt=0.0,
        description="They have the same motion if the standard deviation of their difference is below this share of "
        "that of the motion; testing machines repeat a command to a few percent.",
    )
    least_samples: int = Field(
        400,
        ge=10,
        description="Repeated motion shows noise only if it has this many samples, which fixes a variance to about "
        "7 percent.",
    )
    events: float = Field(
        0.5,
        gt=0.0,
        lt=1.0,
        description="Differences of repeated motion are events, not noise, if deviations beyond twice the expected "
        "one hold this share of their squared sum; of normal noise they hold 8 percent.",
    )
    disturbance: float = Field(
        0.25,
        gt=0.0,
        lt=1.0,
        description="Differences of repeated motion hold a disturbance that is not noise, if this share of their "
        "squared sum grows with the speed, because the noise of a channel does not depend on the speed. In few "
        "repeats a quarter may seem to by chance, so that it must be required where the noise of the channels "
        "suffices.",
    )
    hum_line: float = Field(
        4.0,
        gt=1.0,
        description="Hum of the mains is a line with at least this multiple of the mean power of the frequencies "
        "around it.",
    )
    hum_tests: float = Field(
        0.75,
        gt=0.0,
        le=1.0,
        description="Share of the tests that must show the line, because harmonics of a motion lie at other "
        "frequencies in other tests.",
    )
    most_hum: float = Field(
        10.0,
        gt=0.0,
        description="Hum counts as noise up to this multiple of the variance of the white noise of the force. More of "
        "it is a fault of the channel, which a verdict must not call noise.",
    )
    least_factor: float = Field(
        0.25,
        gt=0.0,
        le=1.0,
        description="Least variance from repeated motion, as a share of what the channels themselves show, because "
        "short repeats may agree by chance.",
    )
    seed: int = Field(
        0,
        ge=0,
        description="Seed of the noise of the displacement that is simulated. Every model is simulated with the same "
        "noise, so that chance does not favour one of two models.",
    )


class ModelErrorRules(Section):
    """When the sensors' noise is not the measure of a residual. All numbers are dimensionless."""

    chi_square: float = Field(
        6.0,
        gt=1.0,
        description="If the best model leaves this multiple of the noise, noise is not the measure: the weights are "
        "relative to the RMS force.",
    )
    better_form: float = Field(
        0.5,
        gt=0.0,
        lt=1.0,
        description="Noise and weights come from another base form if it leaves at most this share of what the "
        "declared form leaves.",
    )
    too_plain: float = Field(
        0.5,
        gt=0.0,
        lt=1.0,
        description="If a richer form of the same effect removes this share of the residual, only the plain form was "
        "wrong.",
    )
    most: float = Field(
        3.0,
        ge=1.0,
        description="Such a form may leave up to this multiple of `chi_square`.",
    )
    flexible_share: float = Field(
        0.15,
        gt=0.0,
        lt=1.0,
        description="A flexible model that recovers less than this share of the residual finds no structure in it.",
    )
