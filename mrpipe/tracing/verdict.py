"""The verdict of a tracing as typed values, and the one place that turns them into JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

VerdictClass = Literal["noise", "explained", "partly explained", "unknown", "base form", "validation differs"]
"""Classes of verdicts on the validation tests.

`noise`: nothing is missing. `explained`: with the named effects the error is that of noise, or that of a flexible
model. `partly explained`: they lower the error, but less. `unknown`: something is missing and no effect explains it.
`base form`: another base form explains what is missing. `validation differs`: the validation tests differ from the
training tests by something that a model of the damper cannot learn from the training tests.
"""


IntervalKind = Literal["confidence", "range", "equivalent", "point"]
"""Meaning of an interval.

`confidence`: it contains the true value with the probability `level`. `range`: smallest and largest value over storeys
or tests. `equivalent`: all values in it fit about as well. `point`: the uncertainty was not estimated.
"""


@dataclass(frozen=True)
class Score:
    """Errors of one model on validation tests, of a damper or of a structure.

    Attributes
    ----------
    nrmse
        RMS error over the RMS of the measured force, pooled over the tests [1].
    fit_percent
        100 (1 - e), where e is the norm of the error over the norm of the measured force [percent]. The mean of the
        force of a damper is removed before its norm is taken.
    by_test
        Name of the test -> NRMSE [1].
    """

    nrmse: float
    fit_percent: float
    by_test: Mapping[str, float]

    def as_json(self) -> dict[str, float]:
        """Return the pooled errors as JSON."""
        return {"nrmse": self.nrmse, "fit_percent": self.fit_percent}


@dataclass(frozen=True)
class Interval:
    """An interval of a number.

    Attributes
    ----------
    low, high
        Ends of the interval, in the unit of the number.
    kind
        Meaning of the interval.
    level
        Probability of a confidence interval; None for other kinds.
    """

    low: float
    high: float
    kind: IntervalKind = "confidence"
    level: float | None = 0.95

    @classmethod
    def point(cls, value: float) -> Interval:
        """Return the interval of a number whose uncertainty was not estimated."""
        return cls(value, value, "point", None)

    def as_json(self) -> dict[str, Any]:
        """Return the keys `interval`, `interval_kind` and, for a confidence interval, `interval_level`."""
        found: dict[str, Any] = {"interval": [self.low, self.high], "interval_kind": self.kind}
        return found if self.level is None else {**found, "interval_level": self.level}


@dataclass(frozen=True)
class Estimate:
    """A parameter of an effect.

    Attributes
    ----------
    value, unit
        Value of the parameter, and its unit.
    interval
        Interval of the value.
    by_storey
        Values of all storeys, lowest first, if it differs between them.
    """

    value: float
    unit: str
    interval: Interval
    by_storey: tuple[float, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the parameter as JSON."""
        found = {"value": self.value, "unit": self.unit, **self.interval.as_json()}
        return {**found, "by_storey": list(self.by_storey)} if self.by_storey else found


@dataclass(frozen=True)
class LeftOutGain:
    """Share of the squared error that an effect removes on left-out tests, with its interval."""

    share: float
    interval: Interval

    def as_json(self) -> dict[str, Any]:
        """Return the gain as JSON."""
        return {"share": self.share, **self.interval.as_json()}


@dataclass(frozen=True)
class NamedEffect:
    """An effect that a verdict names, of a damper, a structure or a controller.

    Attributes
    ----------
    name, form
        Effect, and the form of it that fits best.
    parameters
        Parameter -> estimate.
    confidence
        Calibrated probability that the effect is present.
    physics, remedy, source
        Texts of the effect.
    corrected_in
        `plant`, `prepare`, `structure` or `controller`.
    place
        Storey, floor or part; empty for an effect of a damper on a bench.
    tied_with
        Effects that these tests do not separate from it.
    separating_tests
        Rival -> advice on tests that separate it.
    gain
        Gain on left-out tests; None if it was not estimated.
    """

    name: str
    form: str
    parameters: Mapping[str, Estimate]
    confidence: float
    physics: str
    remedy: str
    source: str
    corrected_in: str
    place: str = ""
    tied_with: tuple[str, ...] = ()
    separating_tests: Mapping[str, str] = field(default_factory=dict)
    gain: LeftOutGain | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the effect as docs/close-loop-json.md describes it."""
        found: dict[str, Any] = {"name": self.name, "form": self.form}
        if self.place:
            found["place"] = self.place
        found |= {
            "parameters": {name: item.as_json() for name, item in self.parameters.items()},
            "confidence": self.confidence,
            "tied_with": list(self.tied_with),
            "physics": self.physics,
            "remedy": self.remedy,
            "source": self.source,
            "corrected_in": self.corrected_in,
        }
        if self.separating_tests:
            found["separating_tests"] = dict(self.separating_tests)
        if self.gain is not None:
            found["cross_validated_gain"] = self.gain.as_json()
        return found


@dataclass(frozen=True)
class Candidate:
    """An effect that was tried.

    Attributes
    ----------
    name, form
        Effect, and the form of it that fits best.
    nrmse
        NRMSE on the validation tests with it.
    evidence
        Gain of the log-likelihood, or the ratio of errors before and after.
    share
        Share of the recoverable residual that it explains.
    forms
        Form -> share, of all forms that were tried.
    at_bound
        Parameters that end at a bound.
    lag_s
        Lag of a late controller [s]; None for other effects.
    """

    name: str
    form: str
    nrmse: float
    evidence: float
    share: float
    forms: Mapping[str, float] = field(default_factory=dict)
    at_bound: tuple[str, ...] = ()
    lag_s: float | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the candidate as JSON."""
        found: dict[str, Any] = {
            "name": self.name, "form": self.form, "nrmse": self.nrmse, "evidence": self.evidence, "share": self.share,
        }  # fmt: skip
        if self.forms:
            found["forms"] = dict(self.forms)
        if self.lag_s is not None:
            found["lag_s"] = self.lag_s
        return {**found, "at_bound": list(self.at_bound)}


@dataclass(frozen=True)
class Unexplained:
    """Part of the residual that remains after the named effects.

    Attributes
    ----------
    structured
        Whether more than noise remains.
    share
        Share of the squared residual of the base model that remains.
    depends_on
        (state, share of the residual's variance that it explains), largest first.
    whiteness_p_value
        Probability that white noise has an autocorrelation as large as the residual; None if it was not tested.
    tests
        Names of the validation tests on which it remains, the worst first; None if tests were not judged one by one.
    """

    structured: bool
    share: float = 0.0
    depends_on: tuple[tuple[str, float], ...] = ()
    whiteness_p_value: float | None = None
    tests: tuple[str, ...] | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the remainder as JSON."""
        found: dict[str, Any] = {"structured": self.structured, "share_of_residual": self.share}
        if self.whiteness_p_value is not None:
            found["whiteness_p_value"] = self.whiteness_p_value
        if self.tests is not None:
            found["tests"] = list(self.tests)
        return {**found, "depends_on": [{"state": name, "share": share} for name, share in self.depends_on]}


@dataclass(frozen=True)
class Difference:
    """One way in which validation tests differ from the training tests.

    Attributes
    ----------
    kind
        `gain`, `lag`, `offset`, `drive`, `amplitude`, `speed`, `session`, or the name of a fault of a recording.
    tests
        Names of the validation tests.
    value, unit
        Size of the difference: gain [1], lag [s], offset [N], or share of the samples outside the range of the training
        tests [1].
    sentence
        The difference in words.
    """

    kind: str
    tests: tuple[str, ...]
    value: float
    unit: str
    sentence: str

    def as_json(self) -> dict[str, Any]:
        """Return the difference as JSON."""
        return {
            "kind": self.kind,
            "tests": list(self.tests),
            "value": self.value,
            "unit": self.unit,
            "sentence": self.sentence,
        }


@dataclass(frozen=True)
class Comparable:
    """Errors on the part of the validation tests that the training tests cover.

    Attributes
    ----------
    tests
        Names of the tests that have samples in this part.
    share
        Share of the compared samples [1].
    before, after
        NRMSE of the model without and with the named effects.
    corrected
        NRMSE with the model on all validation tests after gain, lag and offset of the odd tests are corrected; they
        are estimated from the first part of each record and judged on the rest. None if there is nothing to correct.
    """

    tests: tuple[str, ...]
    share: float
    before: float | None
    after: float | None
    corrected: float | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the errors as JSON."""
        return {
            "tests": list(self.tests),
            "share_of_samples": self.share,
            "nrmse_before": self.before,
            "nrmse_after": self.after,
            "nrmse_corrected": self.corrected,
        }


@dataclass(frozen=True)
class Verdict:
    """Class and sentence of a verdict.

    Attributes
    ----------
    kind
        The class.
    sentence
        The verdict in words.
    share
        Share of the recoverable squared error that the named effects or the base form remove on validation tests.
    differences
        Differences between the validation tests and the training tests.
    comparable
        Errors on the comparable part, where validation tests differ.
    notes
        Further keys of `validation` in the JSON.
    """

    kind: VerdictClass
    sentence: str
    share: float = 0.0
    differences: tuple[Difference, ...] = ()
    comparable: Comparable | None = None
    notes: Mapping[str, Any] = field(default_factory=dict)

    def sentence_as_json(self) -> dict[str, Any]:
        """Return sentence, class and share, without the comparison of the validation tests."""
        return {"verdict": self.sentence, "verdict_class": self.kind, "share_explained": self.share}

    def as_json(self) -> dict[str, Any]:
        """Return the keys of the summary that hold the verdict."""
        found = self.sentence_as_json()
        found["validation"] = {
            "differences": [item.as_json() for item in self.differences],
            "comparable": self.comparable.as_json() if self.comparable is not None else None,
            **self.notes,
        }
        return found
