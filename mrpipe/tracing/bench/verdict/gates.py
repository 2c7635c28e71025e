"""Decisions that end or permit a tracing: whether the base form predicts the validation tests, and what is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.campaigns.plausibility import Finding
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.kernel import HYSTERESIS_AT, run_recordings
from mrpipe.fitting.known import Known
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.solution import chain_of
from mrpipe.tracing.bench.base_forms.fits_of_forms import compared_fits_without_effects, on_all_tests
from mrpipe.tracing.bench.campaign_tests.odd_tests import SortedTests
from mrpipe.tracing.bench.noise.baseline import Baseline
from mrpipe.tracing.bench.residuals.ceiling import flexible_chi_square
from mrpipe.tracing.bench.residuals.nuisances import session_of
from mrpipe.tracing.bench.residuals.residual_structure import states_of, structure_p_value
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.bench.validation.differences import compare, training_agreements
from mrpipe.tracing.bench.validation.on_validation import OnValidation, VerdictWithEvidence, judge, on_validation
from mrpipe.tracing.bench.verdict.naming import Named, calibrated_probability
from mrpipe.tracing.options import NamingRules, TracingOptions
from mrpipe.tracing.rules import ValidationRules
from mrpipe.words import listed


def errors_on_validation(
    base: Fit,
    chosen: Fit,
    baseline: Baseline,
    training: Recordings,
    validation: Recordings,
    options: TracingOptions,
    own_offsets: bool = False,
) -> OnValidation:
    """Return the errors on the validation tests, with the thresholds from the options of the tracing."""
    return on_validation(
        base, chosen, baseline, training, validation, options.rules.validation,
        noise_rules=options.rules.noise, own_offsets=own_offsets, record_gain=options.record_gain,
    )  # fmt: skip


def never_yields(found: Fit, rules: ValidationRules) -> bool:
    """Return whether the damper never yields in all tests, so that no effect can be separated from its hysteresis."""
    wires = run_recordings(chain_of(found.problem, found.theta)[0], found.problem.recordings)
    reached = np.abs(wires[HYSTERESIS_AT][found.problem.recordings.used])
    return bool(np.max(reached, initial=0.0) < rules.yielded)


def predicts_validation(
    found: OnValidation,
    model: Fit,
    training: Recordings,
    options: TracingOptions,
    faults: Mapping[str, Finding],
    jobs: int,
) -> bool:
    """Return whether the error of a model on the comparable part of the validation tests is below a coarse limit.

    Parameters
    ----------
    found
        Errors on the validation tests, with the model in the place of the chosen one.
    model
        Fit of a base form without effects.
    training
        Training tests.
    options
        Options of the tracing.
    faults
        Known faults of validation tests.
    jobs
        Processes; the result does not depend on their number.
    """
    rules = options.rules.validation
    if found.nrmse(found.after) <= rules.failed:
        return True
    trained = training_agreements(model, options.folds, rules, jobs=jobs)
    compared = compare(found.recordings, found.measured, found.after, found.floor, training, trained, faults, rules)
    part = compared.comparable
    return bool(compared.differences and part.any() and found.nrmse(found.after, part) <= rules.failed)


def refusal_of(
    found: OnValidation,
    first: Baseline,
    training: Recordings,
    validation: Recordings,
    options: TracingOptions,
    faults: Mapping[str, Finding],
    jobs: int,
    known: Known | None = None,
) -> str:
    """Return why nothing is traced; empty if the declared base form or another one predicts the validation tests.

    If the declared form fails, the damper may have another form; the failure alone does not show that the validation
    tests differ. The form that fits the training tests best is then tried.

    Parameters
    ----------
    found, first
        The declared model on the validation tests, and its fit.
    training, validation
        Recordings.
    options
        Options of the tracing.
    faults
        Known faults of validation tests.
    jobs
        Processes; the result does not depend on their number.
    known
        Base forms that were fitted to the same tests before.
    """
    if never_yields(first.fit, options.rules.validation):
        return "the damper does not yield within the stroke of the training tests"
    if predicts_validation(found, first.fit, training, options, faults, jobs):
        return ""
    refusal = f"the model {options.model} does not predict the validation tests (NRMSE {found.nrmse(found.after):.3g})"
    best = min(
        compared_fits_without_effects(first.fit, options, known=known, jobs=jobs).values(),
        key=lambda item: item.chi_square,
    )
    if best.problem.base.name == first.fit.problem.base.name:
        return refusal
    other = on_all_tests(best, first.fit.problem)
    tried = errors_on_validation(first.fit, other, first, training, validation, options)
    if predicts_validation(tried, other, training, options, faults, jobs):
        return ""
    error = tried.nrmse(tried.after)
    return f"{refusal}, nor does {other.problem.base.name}, which fits the training tests best (NRMSE {error:.3g})"


def verdict_on_validation(
    found: OnValidation,
    selection: Selection,
    training: Recordings,
    options: TracingOptions,
    causes: Sequence[Named],
    missing: bool,
    reason: str,
    ordered: SortedTests,
    jobs: int,
) -> VerdictWithEvidence:
    """Return the verdict on the validation tests, with the thresholds from the options of the tracing."""
    taken = selection.ground.problem.base.name if selection.ground is not None else ""
    rules = options.rules
    session = session_of(
        found.recorded, found.measured, found.after, selection.chosen, training, rules.nuisances, rules.validation
    )
    found_out = judge(
        found, selection.base, selection.chosen, training, options.rules.validation,
        names=[item.effect.name for item in causes], base_taken=taken,
        structured=missing or bool(causes), reason=reason, faults=ordered.faults, folds=options.folds,
        session=session, jobs=jobs,
    )  # fmt: skip
    words = sentence_on_ties(causes)
    if not words:
        return found_out
    verdict = found_out.verdict
    return replace(found_out, verdict=replace(verdict, sentence=f"{verdict.sentence}; {words}"))


def sentence_on_ties(causes: Sequence[Named]) -> str:
    """Return which other effects the tests do not separate from the named ones; empty if they separate all."""
    parts = [f"{item.effect.name} from {listed(item.tied_with)}" for item in causes if item.tied_with]
    return f"these tests do not separate {', nor '.join(parts)}" if parts else ""


def residual_is_structured(
    selection: Selection,
    baseline: Baseline,
    training: Recordings,
    options: TracingOptions,
    named: bool,
) -> bool:
    """Return whether the residual of the training tests contains more than noise."""
    if named or not selection.structured or baseline.scale.repeats:
        return selection.structured
    # without repeats coloured noise looks like a structure; it counts as one only if a flexible model can predict it
    base = selection.base
    learnt = flexible_chi_square(base) < (1.0 - options.rules.model_error.flexible_share) * base.chi_square
    return learnt or structure_p_value(base.residual, states_of(base, training)) < options.rules.validation.whiteness


def with_calibrated_probability(
    item: Named,
    judgement: VerdictWithEvidence,
    rules: NamingRules,
    *,
    with_others: bool,
    beyond: bool = False,
    chosen: bool = True,
) -> Named:
    """Return an effect with its confidence as a probability.

    Parameters
    ----------
    item
        The effect with its evidence.
    judgement
        The verdict on the validation tests.
    rules
        Rules that contain the calibrated probabilities.
    with_others
        Whether the effect is named together with others.
    beyond
        Whether a structured residual far above the noise remains, although no flexible model reproduces it.
    chosen
        Whether the effect was chosen from the library; offsets of tests are measured and not chosen.

    Notes
    -----
    The evidence is reduced by the share that is not recovered on the validation tests. An effect that explains only
    part of what is missing, or that leaves a structured residual far above the noise, may stand for an effect that the
    library lacks. Other calibrated probabilities apply to such an effect.
    """
    kind = judgement.verdict.kind
    evidence = item.confidence * (1.0 if kind == "explained" else judgement.evidence.share)
    partly = chosen and (beyond or kind == "partly explained")
    probability = calibrated_probability(evidence, rules, with_others=with_others and chosen, partly=partly)
    return replace(item, confidence=probability)
