"""How the residual of a frame and of its closed-loop tests is judged."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class FrameRules(Section):
    """How the residual of a linear frame is judged. Numbers without a unit are dimensionless."""

    band_above: float = Field(
        1.3,
        gt=1.0,
        description="Upper edge of the band, in multiples of the highest natural frequency: the half-power width of a "
        "mode with 10 % damping lies within it.",
    )
    band_below: float = Field(
        0.45,
        gt=0.0,
        lt=1.0,
        description="Lower edge of the band, in multiples of the lowest natural frequency. Below half of it the motion "
        "is quasi-static and integrated noise is large.",
    )
    coupling: float = Field(
        0.05,
        gt=0.0,
        description="Expected size of couplings between floors that no storey connects, as a share of the storey "
        "stiffness. It only regularises the stiffness by which the lines are weighted.",
    )
    better_drift: float = Field(
        0.5,
        gt=0.0,
        lt=1.0,
        description="The order of the tests explains changes of stiffness only if the squared error of tests left out "
        "is below this share of that of the amplitude alone.",
    )
    drift_errors: float = Field(
        3.0,
        gt=0.0,
        description="The change must also exceed its standard error by this factor, which chance does in 3 of 1000 "
        "cases.",
    )
    least_drift: float = Field(
        0.01,
        gt=0.0,
        description="Least change of stiffness over the order of the tests that is reported; frequencies change by "
        "half of it.",
    )
    model_floor: float = Field(
        0.001,
        ge=0.0,
        description="Least standard deviation of a line, as a share of the RMS shear force of the storey: errors of "
        "clocks and gains are of this size.",
    )
    same_gain: float = Field(
        0.02,
        ge=0.0,
        description="Gains of laser and accelerometer that differ by less are taken as equal: usual calibration error.",
    )
    gain_range: float = Field(
        1.25,
        gt=1.0,
        description="A gain between laser and accelerometer is corrected up to this factor; beyond it the two do not "
        "measure the same motion.",
    )
    quietest: float = Field(
        0.1,
        gt=0.0,
        le=1.0,
        description="Least noise density of a quiet part of a record, as a share of that of the whole record; a part "
        "that is quieter still was clipped or padded.",
    )
    significance: float = Field(
        1e-5,
        gt=0.0,
        lt=1.0,
        description="Probability that noise alone makes any group of lines significant. It is small because a campaign "
        "has hundreds of groups and noise of real sensors is not perfectly white.",
    )
    coloured: float = Field(
        1.1,
        ge=1.0,
        description="Factor on the limit of the chi-square test, because the weights assume white noise: sensors "
        "exceed it by up to a tenth.",
    )
    of_response: float = Field(
        0.01,
        gt=0.0,
        description="A residual above the noise is material if it is this share of the shear force of a storey in a "
        "record.",
    )
    of_floor: float = Field(
        0.2,
        gt=0.0,
        description="It also matters if it raises the error above the noise floor by this share, provided that it is "
        "at least `least_of_response`.",
    )
    least_of_response: float = Field(
        0.002,
        gt=0.0,
        description="Least share of the shear force that matters at all; below it lie errors of clocks and gains.",
    )
    at_bound: float = Field(
        0.02,
        ge=0.0,
        lt=1.0,
        description="A parameter is reported as lying at its bound if it is within this share of it.",
    )
    second_gain: float = Field(
        0.05,
        gt=0.0,
        description="A further effect must recover this share of what the frame lacks.",
    )
    lead_errors: float = Field(
        2.0,
        gt=0.0,
        description="An effect is named although another one fits almost as well, if the difference of their squared "
        "errors, on tests left out or on all training tests, exceeds its standard error by this factor, which chance "
        "does in 2 of 100 cases. Otherwise the two are tied and none is named.",
    )
    second_share: float = Field(
        0.5,
        gt=0.0,
        description="It must also recover this share of what the effects before it leave.",
    )
    promising: float = Field(
        0.4,
        gt=0.0,
        lt=1.0,
        description="After screening, only effects that recover this share of what the best one recovers are searched "
        "in full.",
    )
    differing_floors: float = Field(
        2.0,
        gt=1.0,
        description="A validation test differs if its error exceeds its noise by this factor, and if this ratio "
        "exceeds that of every training test by the same factor.",
    )
    unlikely_error: float = Field(
        0.1,
        gt=0.0,
        description="If no effect explains a larger error of a linear frame, a finding points to the description of "
        "the channels, because a wrong sign, unit or floor is then likely.",
    )
    per_parameter: float = Field(
        0.003,
        ge=0.0,
        description="Penalty on the chi-square for each parameter of a form, relative, so that the simpler of two "
        "forms that fit alike is taken.",
    )
    probability_alone: float = Field(
        0.97,
        gt=0.0,
        le=1.0,
        description="Probability that an effect that is named alone and explains what is missing is present: on "
        "planted campaigns all of 31 were, by the rule of succession.",
    )
    probability_in_part: float = Field(
        0.67,
        gt=0.0,
        le=1.0,
        description="The same for an effect that explains only part of what is missing: 3 of 4 were present.",
    )
    probability_of_several: float = Field(
        0.6,
        gt=0.0,
        le=1.0,
        description="The same for each of several effects: 2 of 3 were present; a further one may only correct the "
        "form of another.",
    )
    probability_below_noise: float = Field(
        0.83,
        gt=0.0,
        le=1.0,
        description="The same for an effect that is smaller than the noise of each spectral line: 9 of 10 were "
        "present, by the rule of succession.",
    )
    least_storey: float = Field(
        0.05,
        ge=0.0,
        description="Storeys with a smaller share of the residual above the noise get no flexible model.",
    )
    listed: float = Field(
        0.002,
        ge=0.0,
        description="A state is listed under `depends_on` if it explains this share of the residual's variance.",
    )
    acting: float = Field(
        0.25,
        gt=0.0,
        lt=1.0,
        description="An effect acts on a storey if its amplitude there is this share of the largest one.",
    )


class BraceRules(Section):
    """How a flexible brace between damper and floor is named. All numbers are dimensionless."""

    least_motion: float = Field(
        50.0,
        gt=0.0,
        description="Skip closed-loop tests whose RMS damper motion is below this multiple of its noise, because they "
        "carry no information on the damper.",
    )
    strong_share: float = Field(
        0.5,
        gt=0.0,
        lt=1.0,
        description="A brace that removes this share of the recoverable squared error takes precedence: rival effects "
        "of the damper are then weighed by the residual of the brace model.",
    )
    better: float = Field(
        0.8,
        gt=0.0,
        lt=1.0,
        description="The brace must lower the NRMSE on validation tests to this share, that is a third of the squared "
        "error.",
    )
    equivalent: float = Field(
        1.1,
        gt=1.0,
        description="Compliances whose mean squared error is within this factor of the least one form the interval.",
    )


class DelayRules(Section):
    """When a controller is called late. Times are shares of the mean period of the damper's motion."""

    filter_periods: float = Field(
        0.005,
        ge=0.0,
        description="Lag that is granted to a controller whose rate or command filter the campaign does not declare "
        "(`about: {controller_rate_hz, command_filter_hz}`), in periods: it turns the force by less than 2 degrees.",
    )
    least_periods: float = Field(
        0.004,
        ge=0.0,
        description="Dead time beyond the granted lag that is reported, in periods; smaller ones are within what "
        "sampling and filters of unknown make take.",
    )
    longest_periods: float = Field(
        0.1,
        gt=0.0,
        le=0.5,
        description="Longest lag that is searched, in periods; a loop that is later than this hardly damps.",
    )
    better: float = Field(
        0.8,
        gt=0.0,
        lt=1.0,
        description="Shifting the clock must lower the error to this share, that is remove a third of the squared "
        "error.",
    )
    varies: float = Field(
        1e-3,
        gt=0.0,
        description="A signal varies if its standard deviation exceeds this share of its largest value in the tests.",
    )
    acting: float = Field(
        0.02,
        gt=0.0,
        lt=1.0,
        description="The controller acts where the desired force exceeds this share of its largest value; below it "
        "the drive is switched off.",
    )
