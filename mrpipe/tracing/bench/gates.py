"""Gates of the tracing: does the base predict at all, is anything missing, what do the validation tests say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.campaigns.plausibility import Finding
from mrpipe.fitting.engine import Fit, chain_of
from mrpipe.fitting.kernel import HYSTERESIS_AT, run_recordings
from mrpipe.fitting.known import Known
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.baseline import Baseline
from mrpipe.tracing.bench.ceiling import flexible_chi_square
from mrpipe.tracing.bench.nuisances import session_of
from mrpipe.tracing.bench.odd_tests import SortedTests
from mrpipe.tracing.bench.on_validation import Judgement, OnValidation, judge, on_validation
from mrpipe.tracing.bench.race import alone_of, on_all_tests
from mrpipe.tracing.bench.residual_structure import states_of, structure_p_value
from mrpipe.tracing.bench.select import Selection
from mrpipe.tracing.bench.validation import compare, training_agreements
from mrpipe.tracing.bench.verdict import Named, calibrated
from mrpipe.tracing.options import NamingRules, TracingOptions
from mrpipe.tracing.rules import ValidationRules


def validated(
    base: Fit,
    chosen: Fit,
    baseline: Baseline,
    training: Recordings,
    validation: Recordings,
    options: TracingOptions,
    own_offsets: bool = False,
) -> OnValidation:
    """Return the errors on the validation tests by the options of the tracing."""
    return on_validation(
        base, chosen, baseline, training, validation, options.rules.validation,
        own_offsets=own_offsets, record_gain=options.record_gain,
    )  # fmt: skip


def never_yields(found: Fit, rules: ValidationRules) -> bool:
    """Return whether the hysteresis stays elastic in all tests, so that no effect can be separated from it."""
    wires = run_recordings(chain_of(found.problem, found.theta)[0], found.problem.recordings)
    reached = np.abs(wires[HYSTERESIS_AT][found.problem.recordings.used])
    return bool(np.max(reached, initial=0.0) < rules.yielded)


def predicts(
    found: OnValidation,
    model: Fit,
    training: Recordings,
    options: TracingOptions,
    faults: Mapping[str, Finding],
    jobs: int,
) -> bool:
    """Return whether a model predicts the comparable part of the validation tests at all.

    Parameters
    ----------
    found
        The validation tests, with the model as what was chosen.
    model
        Base form without effects.
    training
        Training tests.
    options
        Of the tracing.
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

    A declared form that fails does not show that the validation tests differ: the damper may have another form. The
    other form is the one that fits the training tests best.

    Parameters
    ----------
    found, first
        The declared model on the validation tests, and its fit.
    training, validation
        Recordings.
    options
        Of the tracing.
    faults
        Known faults of validation tests.
    jobs
        Processes; the result does not depend on their number.
    known
        Base forms as they were fitted to the same tests before.
    """
    if never_yields(first.fit, options.rules.validation):
        return "the damper does not yield within the stroke of the training tests"
    if predicts(found, first.fit, training, options, faults, jobs):
        return ""
    refusal = f"the model {options.model} does not predict the validation tests (NRMSE {found.nrmse(found.after):.3g})"
    best = min(alone_of(first.fit, options, known=known, jobs=jobs).values(), key=lambda item: item.chi_square)
    if best.problem.base.name == first.fit.problem.base.name:
        return refusal
    other = on_all_tests(best, first.fit.problem)
    tried = validated(first.fit, other, first, training, validation, options)
    if predicts(tried, other, training, options, faults, jobs):
        return ""
    error = tried.nrmse(tried.after)
    return f"{refusal}, nor does {other.problem.base.name}, which fits the training tests best (NRMSE {error:.3g})"


def judged(
    found: OnValidation,
    selection: Selection,
    training: Recordings,
    options: TracingOptions,
    causes: Sequence[Named],
    missing: bool,
    reason: str,
    ordered: SortedTests,
    jobs: int,
) -> Judgement:
    """Return the verdict on the validation tests by the options of the tracing."""
    taken = selection.ground.problem.base.name if selection.ground is not None else ""
    rules = options.rules
    session = session_of(
        found.recorded, found.measured, found.after, selection.chosen, training, rules.nuisances, rules.validation
    )
    return judge(
        found, selection.base, selection.chosen, training, options.rules.validation,
        names=[item.effect.name for item in causes], base_taken=taken,
        structured=missing or bool(causes), reason=reason, faults=ordered.faults, folds=options.folds,
        session=session, jobs=jobs,
    )  # fmt: skip


def structured(
    selection: Selection,
    baseline: Baseline,
    training: Recordings,
    options: TracingOptions,
    named: bool,
) -> bool:
    """Return whether the residual of the training tests holds more than noise."""
    if named or not selection.structured or baseline.scale.repeats:
        return selection.structured
    # without repeats coloured noise looks like an excess: it is one only where something can be learnt of it
    base = selection.base
    learnt = flexible_chi_square(base) < (1.0 - options.rules.model_error.flexible_share) * base.chi_square
    return learnt or structure_p_value(base.residual, states_of(base, training)) < options.rules.validation.whiteness


def held(
    item: Named,
    judgement: Judgement,
    rules: NamingRules,
    *,
    several: bool,
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
        They hold the probabilities.
    several
        Whether the effect is named together with others.
    beyond
        Whether a structured residual far above the noise remains, although no flexible model learns it.
    chosen
        Whether it was chosen among the effects of the library; offsets of tests are measured, not chosen.

    Notes
    -----
    The evidence is lowered by the share that is not recovered on the validation tests. An effect that explains only
    part of what is missing, or leaves a structured residual far above the noise, may stand for one that the library
    lacks, so that its probability is another one.
    """
    kind = judgement.verdict.kind
    evidence = item.confidence * (1.0 if kind == "explained" else judgement.evidence.share)
    partly = chosen and (beyond or kind == "partly explained")
    probability = calibrated(evidence, rules, several=several and chosen, partly=partly)
    return replace(item, confidence=probability)
