"""Every threshold by which the tracing decides, with its unit, what it decides and why it has this value.

The classes are the sections `close_loop.rules.*` of the settings, so that each of them can be changed.
"""

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
    least_factor: float = Field(
        0.25,
        gt=0.0,
        le=1.0,
        description="Least variance from repeated motion, as a share of what the channels themselves show, because "
        "short repeats may agree by chance.",
    )


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


class SelectionRules(Section):
    """When forward selection adds an effect, and when it is named. All numbers are dimensionless."""

    nothing_missing: float = Field(
        0.2,
        ge=0.0,
        description="Nothing is missing if the chi-square exceeds that of the noise by less than this share of it; the "
        "noise is known to about a fifth.",
    )
    gain: float = Field(
        0.05, ge=0.0, description="A further effect must recover this share of what the base model lacks."
    )
    term_share: float = Field(
        0.25,
        ge=0.0,
        description="A term that recovers this share of the remaining residual is kept, because it improves the model.",
    )
    named_share: float = Field(
        0.5,
        ge=0.0,
        description="A further term is named as an effect if it recovers this share of the remaining residual.",
    )
    lead: float = Field(
        1.25,
        ge=1.0,
        description="It is named only if the residual of every other family is at least this multiple of the "
        "residual of the named one.",
    )
    contender_share: float = Field(
        0.3,
        ge=0.0,
        description="Forms that leave more than the best draft by this share of its gain are not fitted to all tests.",
    )
    further: float = Field(
        0.15,
        ge=0.0,
        description="If less than this share remains, and less than the noise, a further effect must promise its share "
        "in screening.",
    )
    better_optimum: float = Field(
        0.03,
        ge=0.0,
        description="A fit that leaves less than another fit of the same terms by this share shows that the other had "
        "not converged.",
    )
    main_part: float = Field(
        0.2,
        ge=0.0,
        description="The main part of a form with corrections of either sign must be this share of the largest one.",
    )
    per_parameter: float = Field(
        0.01,
        ge=0.0,
        description="Penalty on the chi-square for each parameter of a form, relative, so that the simpler of two "
        "forms that fit alike is taken.",
    )
    same: float = Field(
        0.05,
        ge=0.0,
        description="Differences below this share of the noise do not separate the families of one round.",
    )


BY_FORCE = SelectionRules(gain=0.02, term_share=0.06, named_share=0.25, lead=1.0)
"""Numerical technique: defaults for weights relative to the RMS force: no model reaches the noise."""


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
    listed_lead: float = Field(
        0.05,
        ge=0.0,
        description="Share by which another base form must fit better than the declared one to be reported as best.",
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


class RefinementRules(Section):
    """When a richer form of a named effect is taken. All numbers are dimensionless."""

    worth_a_try: float = Field(
        0.1,
        ge=0.0,
        description="The plain form is sufficient if the chi-square exceeds that of the noise by less than this share.",
    )
    least_gain: float = Field(
        0.05,
        ge=0.0,
        description="A richer form must lower the squared error on left-out tests by this share.",
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
    per_parameter: float = Field(
        0.003,
        ge=0.0,
        description="Penalty on the chi-square for each parameter of a form, relative, so that the simpler of two "
        "forms that fit alike is taken.",
    )
    rocking_share: float = Field(
        0.8,
        gt=0.0,
        le=1.0,
        description="A rocking base is named if it explains this share of what a shear frame lacks and exceeds any "
        "linear frame by `rocking_lead`.",
    )
    rocking_lead: float = Field(
        0.03,
        ge=0.0,
        description="Margin in the comparison of a rocking base with a general linear frame, as a share of what a "
        "shear frame lacks: the spread of this share between records.",
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


class TracingRules(Section):
    """Thresholds of the decisions of `close-loop`."""

    validation: ValidationRules = Field(
        ValidationRules(), description="How errors on the validation tests decide the class of the verdict."
    )
    selection: SelectionRules = Field(SelectionRules(), description="When forward selection adds and names an effect.")
    selection_by_force: SelectionRules = Field(
        BY_FORCE,
        description="The same for weights relative to the RMS force, where any model's error exceeds the noise.",
    )
    race: RaceRules = Field(RaceRules(), description="How base forms with and without effects are compared.")
    model_error: ModelErrorRules = Field(ModelErrorRules(), description="When the sensors' noise is not the measure.")
    refinement: RefinementRules = Field(RefinementRules(), description="When a richer form of an effect is taken.")
    remainder: RemainderRules = Field(RemainderRules(), description="When something remains unexplained.")
    noise: NoiseRules = Field(NoiseRules(), description="How the noise of a bench campaign is estimated.")
    offsets: OffsetRules = Field(OffsetRules(), description="When a moving zero of the load cell is named.")
    nuisances: NuisanceRules = Field(NuisanceRules(), description="When gains of sessions and filters are real.")
    testability: TestabilityRules = Field(TestabilityRules(), description="When a campaign can show an effect.")
    location: LocationRules = Field(LocationRules(), description="How the report divides the residual.")
    frame: FrameRules = Field(FrameRules(), description="How the residual of a linear frame is judged.")
    brace: BraceRules = Field(BraceRules(), description="When a flexible brace of the damper is named.")
    delay: DelayRules = Field(DelayRules(), description="When a controller is called late.")
    loop: LoopRules = Field(LoopRules(), description="How the closed loop is compared with and without the effects.")
