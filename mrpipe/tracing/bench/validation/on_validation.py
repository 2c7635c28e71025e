"""Errors on the validation tests before and after, their comparable part, and the resulting verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.campaigns.plausibility import Finding
from mrpipe.fitting.engine import Fit, predict
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.error_size import rms
from mrpipe.tracing.bench.noise.baseline import Baseline
from mrpipe.tracing.bench.noise.weights import AS_SHOWN, NoiseScale, noise_limits, noise_variances
from mrpipe.tracing.bench.residuals.ceiling import Ceiling, cross_fitted
from mrpipe.tracing.bench.residuals.error_measures import (
    JudgedPart,
    campaign_offset,
    judged_part,
    relative_rms,
    score,
)
from mrpipe.tracing.bench.residuals.nuisances import RecordGain, SessionGain, record_gains
from mrpipe.tracing.bench.residuals.residual_structure import correlation_p_value
from mrpipe.tracing.bench.validation.differences import (
    Comparison,
    compare,
    first_parts,
    training_agreements,
    with_session,
)
from mrpipe.tracing.bench.validation.judgement import Condition, Evidence, classify, unexplained_tests
from mrpipe.tracing.rules import NoiseRules, ValidationRules
from mrpipe.tracing.verdict import Comparable, Score, Verdict
from mrpipe.words import in_percent, listed


@dataclass(frozen=True)
class OnValidation:
    """Forces and errors on the validation tests; forces [N] have shape (n,).

    Attributes
    ----------
    recordings
        The validation tests; only samples that nothing was fitted to are compared.
    recorded
        The same tests with all samples, because gains of a session are estimated from the first parts, which are not
        compared.
    measured
        Offset-free measured force.
    before, after
        Simulated force of the base model and of the final model.
    floor
        Standard deviation of the force that noise explains.
    noise_components
        NRMSE of the parts of the floor: white noise of the force, noise of the force in the band of the motion, and
        noise of the displacement passed through the damper.
    own_offsets
        Whether every test has its own offset.
    gains
        Gain of each test, relative to the final model.
    scale
        Noise in repeated training motion, and the part of the force that does not repeat and is not noise.
    """

    recordings: Recordings
    recorded: Recordings
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    floor: FloatArray
    noise_components: dict[str, float]
    own_offsets: bool
    gains: dict[str, RecordGain]
    scale: NoiseScale = AS_SHOWN

    @property
    def score_before(self) -> Score:
        """Errors of the base model."""
        return score(self.recordings, self.measured, self.before)

    @property
    def score_after(self) -> Score:
        """Errors of the final model."""
        return score(self.recordings, self.measured, self.after)

    def nrmse(self, simulated: FloatArray, part: BoolArray | None = None) -> float:
        """Return the NRMSE over a part of the samples that are compared."""
        used = self.recordings.used if part is None else part & self.recordings.used
        return relative_rms((self.measured - simulated)[used], self.measured[used])

    def floor_nrmse(self, part: BoolArray | None = None) -> float:
        """Return the NRMSE that noise alone causes."""
        used = self.recordings.used if part is None else part & self.recordings.used
        return relative_rms(self.floor[used], self.measured[used])

    def unexplained(self, rules: ValidationRules) -> tuple[bool, float, float]:
        """Return whether more than noise remains, its share of the residual before, and the whiteness p-value."""
        after, before, floor = self.nrmse(self.after), self.nrmse(self.before), self.floor_nrmse()
        p_value = correlation_p_value(self.measured - self.after, self.recordings)
        remains = after > rules.within_floors * floor and p_value < rules.whiteness
        excess = max(before**2 - floor**2, 1e-300)
        return remains, float(np.clip((after**2 - floor**2) / excess, 0.0, 1.0)), p_value


def on_validation(
    base: Fit,
    chosen: Fit,
    baseline: Baseline,
    training: Recordings,
    validation: Recordings,
    rules: ValidationRules,
    *,
    noise_rules: NoiseRules | None = None,
    own_offsets: bool = False,
    record_gain: bool = False,
) -> OnValidation:
    """Simulate the validation tests with the base model and with the final model.

    Parameters
    ----------
    base
        Fit of the base model.
    chosen
        Fit with the named effects.
    baseline
        Base model and noise of the training tests.
    training
        Training tests.
    validation
        Validation tests.
    rules
        Decision thresholds.
    noise_rules
        How the noise was estimated; the defaults if None.
    own_offsets
        Whether the offsets of the tests are a finding; the base model is then judged with one offset for all tests.
    record_gain
        Whether a gain of every record is estimated from its first part; errors are then those of the rest.
    """
    before, after = predict(base, validation), predict(chosen, validation)
    first = first_parts(validation, rules.first_part)
    root = chosen.problem.root_weight
    left = np.divide(chosen.residual, root, out=np.zeros_like(root), where=root > 0.0)
    shared = campaign_offset(training, left, chosen.test_offsets, first_parts(training, rules.first_part))
    if own_offsets:
        shared = None
    judged: JudgedPart = judged_part(validation, after, shared, first)
    recordings = judged.recordings
    gains = record_gains(recordings, judged.measured, after, least=rules.deviation)
    if record_gain:
        given = record_gains(validation, judged.measured, after, first)
        factor = np.array([given[name].value if name in given else 1.0 for name in validation.names])[validation.test]
        before, after = before * factor, after * factor
        recordings = replace(recordings, used=recordings.used & ~first)
    if own_offsets:
        before = before - (judged.offsets - np.median(judged.offsets))[validation.test]
    force, motion = noise_variances(chosen, validation, noise_rules)
    scale = baseline.scale
    # the noise of a displacement, passed through a damper whose force depends on velocity or acceleration, is known
    # only up to a factor; it cannot exceed the residual of the final model
    used = recordings.used
    residual, noise = (judged.measured - after)[used], (scale.force * force + scale.motion * motion)[used]
    part = noise_limits(residual, noise, recordings.test[used], recordings.tests)[recordings.test]
    force, motion = part * force, part * motion
    floor = np.sqrt(scale.force * force + scale.motion * motion)
    power = max(rms(judged.measured[used]), 1e-12)
    parts = {
        "force_white": min(scale.force, 1.0) * force,
        "force_in_band": max(scale.force - 1.0, 0.0) * force,
        "displacement": scale.motion * motion,
    }
    components = {name: float(np.sqrt(np.mean(values[used]))) / power for name, values in parts.items()}
    return OnValidation(
        recordings, validation, judged.measured, before, after, floor, components, shared is None, gains, scale
    )


@dataclass(frozen=True)
class VerdictWithEvidence:
    """The verdict and the data that it is based on.

    Attributes
    ----------
    verdict
        The verdict.
    evidence
        Errors on the comparable part of the validation tests.
    ceiling, ceiling_interval
        NRMSE of a flexible model on all validation tests, and its 95 % interval.
    comparison
        Comparison of the validation tests with the training tests; None if they were not compared.
    """

    verdict: Verdict
    evidence: Evidence
    ceiling: float
    ceiling_interval: tuple[float, float]
    comparison: Comparison | None


def judge(
    found: OnValidation,
    base: Fit,
    chosen: Fit,
    training: Recordings,
    rules: ValidationRules,
    *,
    names: Sequence[str],
    base_taken: str,
    structured: bool,
    reason: str,
    faults: Mapping[str, Finding],
    folds: int,
    session: SessionGain | None = None,
    jobs: int = 1,
) -> VerdictWithEvidence:
    """Return the verdict on the validation tests.

    Parameters
    ----------
    found
        Both models on the validation tests.
    base
        Fit of the base model.
    chosen
        Fit with the named effects.
    training
        Training tests.
    rules
        Decision thresholds.
    names
        Effects that are named.
    base_taken
        Name of the base form that replaces the declared one; empty if none does.
    structured
        Whether the residual of the training tests contains more than noise.
    reason
        Why nothing is named; empty if something is.
    faults
        Known faults of validation tests.
    folds
        Number of folds of the cross-validation on training tests.
    session
        Gain that several validation tests share; None if there is none.
    jobs
        Processes; the result does not depend on their number.
    """
    ceilings = ceilings_of(found, base, chosen, training)
    whole = _evidence(found, ceilings, found.recordings.used, rules, structured, bool(names), bool(base_taken))
    kind = classify(whole, rules)
    total = _lowest(ceilings, found.recordings.used, rules)
    if kind in ("noise", "explained"):
        return VerdictWithEvidence(
            Verdict(kind, _sentence(kind, whole, names, base_taken, reason, rules), whole.share), whole, *total, None
        )
    trained = training_agreements(chosen, folds, rules, jobs=jobs)
    comparison = compare(found.recordings, found.measured, found.after, found.floor, training, trained, faults, rules)
    comparison = with_session(comparison, session, found.recordings, found.floor_nrmse(), rules)
    if not comparison.differences or comparison.accounted < rules.accounts:
        verdict = Verdict(kind, _sentence(kind, whole, names, base_taken, reason, rules), whole.share)
        return VerdictWithEvidence(verdict, whole, *total, comparison)
    part = comparison.comparable
    evidence, inner = whole, ""
    tests: tuple[str, ...] = ()
    if np.count_nonzero(part) > 0:
        evidence = _evidence(found, ceilings, part, rules, structured, bool(names), bool(base_taken))
        tests = tuple(item.name for item in evidence.conditions)
        inner = _sentence(classify(evidence, rules), evidence, names, base_taken, reason, rules)
    comparable = Comparable(
        tests,
        float(np.mean(part[found.recordings.used])),
        evidence.before if tests else None,
        evidence.after if tests else None,
        comparison.corrected,
    )
    words = "; ".join(item.sentence for item in comparison.differences)
    rest = f"; on the comparable part (NRMSE {evidence.after:.3g}): {inner}" if inner else "; no part is comparable"
    verdict = Verdict(
        "validation differs",
        f"the validation tests differ from the training tests: {words}{rest}",
        evidence.share,
        comparison.differences,
        comparable,
    )
    return VerdictWithEvidence(verdict, evidence, *total, comparison)


def ceilings_of(found: OnValidation, base: Fit, chosen: Fit, training: Recordings) -> list[Ceiling]:
    """Return the residuals of flexible models that are added to the base model and to the final model."""
    result = []
    for fitted, simulated in ((base, found.before), (chosen, found.after)):
        root = fitted.problem.root_weight
        residual = np.divide(fitted.residual, root, out=np.zeros_like(root), where=root > 0.0)
        result.append(cross_fitted(fitted, training, residual, found.recordings, found.measured, simulated))
        if base is chosen:
            break
    return result


def _lowest(ceilings: Sequence[Ceiling], part: BoolArray, rules: ValidationRules) -> tuple[float, tuple[float, float]]:
    """Return the lowest NRMSE of the flexible models on some samples, and its 95 % interval.

    The bootstrap of every model and of every part begins at the same seed, so that chance does not favour one of them.
    """
    errors = (item.nrmse(part, np.random.default_rng(rules.seed)) for item in ceilings)
    return min(errors, key=lambda item: item[0])


def _evidence(
    found: OnValidation,
    ceilings: Sequence[Ceiling],
    part: BoolArray,
    rules: ValidationRules,
    structured: bool,
    effects: bool,
    changed: bool,
) -> Evidence:
    conditions = []
    for test, name in enumerate(found.recordings.names):
        own = part & (found.recordings.test == test)
        if not (own & found.recordings.used).any():
            continue
        ceiling, (_, upper) = _lowest(ceilings, own, rules)
        conditions.append(
            Condition(
                name, found.nrmse(found.before, own), found.nrmse(found.after, own), found.floor_nrmse(own), ceiling,
                upper,
            )
        )  # fmt: skip
    power = max(rms(found.measured[part & found.recordings.used]), 1e-12)
    return Evidence(
        found.nrmse(found.before, part),
        found.nrmse(found.after, part),
        found.floor_nrmse(part),
        _lowest(ceilings, part, rules)[0],
        tuple(conditions),
        structured,
        effects,
        changed,
        found.scale.events / power,
        found.scale.disturbance / power,
    )


def _sentence(
    kind: str, evidence: Evidence, names: Sequence[str], base_taken: str, reason: str, rules: ValidationRules
) -> str:
    found = listed(names) + (f" with the base form {base_taken}" if base_taken else "")
    verb = "explains" if len(names) == 1 else "explain"
    if kind == "noise":
        return "the residual is noise: nothing is missing"
    above = evidence.after / max(evidence.floor, 1e-12)
    limit = ""
    if above > rules.within_floors:
        limit = (
            f", as far as a flexible model of motion and drive can show; the error is {above:.2g} times the noise floor"
        )
    if kind == "explained":
        return f"{found}: {verb} what is missing{limit}"
    if kind == "partly explained":
        return (
            f"{found}: {verb} part of what is missing, {in_percent(evidence.share)} of what is recoverable on the "
            "validation tests"
        )
    if kind == "base form":
        return f"the base form: {base_taken} explains what is missing{limit}; no effect is named"
    if evidence.unrepeatable(rules):
        return (
            f"unknown: most of what remains on the validation tests {_unrepeated(evidence)}, and no effect explains it"
        )
    if reason and evidence.structured:
        return reason
    return f"unknown: the error on the validation tests is {above:.3g} times the noise floor, and no effect explains it"


def _unrepeated(evidence: Evidence) -> str:
    if evidence.events >= evidence.disturbance:
        return "consists of single events, which do not repeat when motion and drive repeat"
    return (
        "is a disturbance that grows with the speed and does not repeat when motion and drive repeat (it differs from "
        "cycle to cycle)"
    )


def open_tests(judgement: VerdictWithEvidence, rules: ValidationRules) -> tuple[str, ...]:
    """Return the names of the validation tests with an unexplained error, the worst first."""
    return unexplained_tests(judgement.evidence.conditions, rules)
