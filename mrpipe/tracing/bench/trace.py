"""The whole tracing of a bench campaign: baseline, structure, candidates, verdict, errors before and after."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.effects.contract import Effect
from mrpipe.fitting.known import Known
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import Recordings, enough_tests, spread_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.campaign_tests.odd_tests import SortedTests, sort_tests
from mrpipe.tracing.bench.model_choice.choose import Choice, with_floor_of_flexible_model
from mrpipe.tracing.bench.model_choice.filter_and_rate import (
    Bench,
    ChosenModel,
    choose_with_filter_and_rate,
    fit_declared_model,
    validation_recordings,
)
from mrpipe.tracing.bench.model_choice.passes import in_passes
from mrpipe.tracing.bench.noise.baseline import Baseline
from mrpipe.tracing.bench.residuals.crossvalidation import gain_of, left_out_residual
from mrpipe.tracing.bench.residuals.nuisances import observation_window
from mrpipe.tracing.bench.rivals.inner_springs import with_inner_springs
from mrpipe.tracing.bench.rivals.law_rival import without_laws_of_drive
from mrpipe.tracing.bench.rivals.linear_memory import without_beaten_names
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.rivals.needed import without_idle, without_superfluous
from mrpipe.tracing.bench.rivals.other_base_forms import Orders, Unseen, with_best_base
from mrpipe.tracing.bench.selection.drive_again import with_final_laws
from mrpipe.tracing.bench.selection.refine import with_further_terms, with_richer_forms
from mrpipe.tracing.bench.selection.select import Selection, forward_selection
from mrpipe.tracing.bench.validation.on_validation import OnValidation
from mrpipe.tracing.bench.verdict.assess import Case, with_likely_names
from mrpipe.tracing.bench.verdict.gates import errors_on_validation, refusal_of, verdict_on_validation
from mrpipe.tracing.bench.verdict.naming import unnamed_reason
from mrpipe.tracing.bench.verdict.offsets import offset_between_tests
from mrpipe.tracing.bench.verdict.summary import Summary, Tracing
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.options import TracingOptions


def trace_campaign(
    tests: Sequence[PreparedTest],
    effects: Mapping[str, Effect],
    declared: Sequence[Effect],
    options: TracingOptions,
    *,
    known: Known | None = None,
    rng: np.random.Generator,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Tracing:
    """Trace the residual of a bench campaign.

    Parameters
    ----------
    tests
        Prepared tests. The tests with the roles `training` and `repeat` decide; those with `validation` are used for
        the reported errors.
    effects
        The library: name -> effect.
    declared
        Effects that the campaign declares: part of the baseline.
    options
        Options of the tracing. The unit of the drive is that of the tests.
    known
        Base forms as `identify-damper` fitted them to the same tests; the search of each starts from them. A form that
        is not among them starts from the starts of the library.
    rng
        Source of randomness.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share of the work that is done (0 to 1) and a text.
    """
    options = options.changed(drive_unit=next((test.drive_unit for test in tests if test.drive_unit), "A"))
    rules = options.rules
    ordered = sort_tests(tests, rules.validation)
    usable = spread_tests(enough_tests([t for t in ordered.tests if t.role != "validation"]))
    unseen = [t for t in ordered.tests if t.role == "validation"]
    bench = Bench(usable, effects, declared, rng, jobs, in_passes(progress), known or {})
    begun = fit_declared_model(bench, options)
    validation = validation_recordings(bench, begun, unseen)
    progress(0.05, "baseline")
    training, first = begun.training, begun.first
    found = errors_on_validation(first.fit, first.fit, first, training, validation, options)
    refusal = refusal_of(found, first, training, validation, options, ordered.faults, jobs, bench.known)
    if refusal:
        return _nothing_traced(
            f"{refusal}: nothing is traced", ordered, found, first, training, begun.reasons, declared, options, jobs
        )
    taken = choose_with_filter_and_rate(bench, begun)
    options, training, choice = taken.options, taken.training, taken.choice
    validation = validation_recordings(bench, taken, unseen)
    baseline = choice.baseline
    window, named = _named_on_training(taken, len(declared), rng, jobs)
    progress(0.85, "ceiling")
    offsets = offset_between_tests(
        named.selection.chosen,
        effects.get("offset"),
        rules=rules.offsets,
        least_ratio=rules.offsets.clear if named.reason and named.selection.structured else 0.0,
    )
    case = Case(choice, training, validation, options, ordered, offsets, jobs)
    if not named.reason:
        named = without_beaten_names(named, Unseen(options.folds, options.bootstrap_draws, rng), jobs)
    named, assessed = with_likely_names(named, case, rng)
    selection = named.selection
    causes, further, found, judgement = assessed.causes, assessed.further, assessed.found, assessed.judgement
    if causes and judgement.evidence.after >= judgement.evidence.before:
        # an effect that does not lower the error on the validation tests is not named
        selection = replace(selection, chosen=selection.without_effects, named_fit=None)
        causes, further, offsets = (), (), None
        reason = "the effects that the training tests require do not lower the error on the validation tests"
        found = errors_on_validation(selection.base, selection.chosen, baseline, training, validation, options)
        judgement = verdict_on_validation(
            found, selection, training, options, causes, assessed.missing, reason, ordered, jobs
        )
    report = Summary(selection, baseline, training, offsets, found, judgement, ordered, choice.race, jobs)
    return report.build(options, causes, further, taken.reasons, window, [item.name for item in declared])


def _named_on_training(
    taken: ChosenModel, declared: int, rng: np.random.Generator, jobs: int
) -> tuple[float, NamedEffects]:
    """Return the effects that the training tests require, in the forms and with the laws of the drive that they need.

    The window of the filter of the displacement is returned with them.
    """
    options, choice = taken.options, taken.choice
    baseline, selection = choice.baseline, choice.selection
    window = selection.base.problem.window_share
    if not baseline.model_error:
        window, selection = _with_window(selection, baseline.noise, taken.training, taken.able, options, jobs)
    selection = _needed(selection, choice, declared, options, rng, jobs)
    gains, selection = _cross_validated(selection, declared, options, rng, jobs)
    named = NamedEffects(selection, tuple(gains), declared, unnamed_reason(selection, options))
    if named.reason:
        named = replace(named, selection=replace(selection, chosen=selection.without_effects))
    else:
        compared = Unseen(options.folds, options.bootstrap_draws, rng)
        selection = _refined(selection, declared, baseline.model_error, options, rng, jobs)
        refinement = options.rules.refinement
        limit = selection.sufficient(refinement.worth_a_try, model_error=baseline.model_error)
        selection = with_inner_springs(selection, limit, refinement.least_gain, compared, jobs)
        named = without_idle(replace(named, selection=selection), lead=_lead(baseline, options))
        if named.selection.proven:
            named = without_laws_of_drive(named, compared, jobs)
    selection = with_final_laws(named.selection, options.rules.refinement.least_gain)
    selection = with_further_terms(
        selection,
        folds=options.folds,
        draws=options.bootstrap_draws,
        rng=rng,
        jobs=jobs,
        rules=options.rules.refinement,
    )
    return window, replace(named, selection=selection)


def _nothing_traced(
    reason: str,
    ordered: SortedTests,
    found: OnValidation,
    baseline: Baseline,
    training: Recordings,
    untested: Mapping[str, str],
    declared: Sequence[Effect],
    options: TracingOptions,
    jobs: int,
) -> Tracing:
    """Return the tracing of a base model with which no effect can be judged."""
    selection = Selection(
        baseline.fit, baseline.noise, (), baseline.fit, nothing_missing=options.rules.selection.nothing_missing
    )
    judgement = verdict_on_validation(found, selection, training, options, (), True, reason, ordered, jobs)
    if reason not in judgement.verdict.sentence:
        words = f"{reason}; {judgement.verdict.sentence}"
        judgement = replace(judgement, verdict=replace(judgement.verdict, sentence=words))
    report = Summary(selection, baseline, training, None, found, judgement, ordered)
    return report.build(options, (), (), untested, 0.0, [item.name for item in declared])


def _needed(
    selection: Selection,
    choice: Choice,
    declared: int,
    options: TracingOptions,
    rng: np.random.Generator,
    jobs: int,
) -> Selection:
    """Return the selection without superfluous effects, with the base form that fits best with the remaining ones."""
    rules = options.rules
    orders = Orders(options.yield_order, options.viscosity_order)
    kept = without_superfluous(
        selection,
        declared,
        lead=_lead(choice.baseline, options),
        orders=orders,
        worth_a_try=rules.refinement.worth_a_try,
        race=choice.race,
        jobs=jobs,
    )
    return with_best_base(
        kept,
        declared,
        orders,
        choice.race,
        model_error=choice.baseline.model_error,
        worth_a_try=rules.refinement.worth_a_try,
        lead=rules.race.form_lead,
        unseen=Unseen(options.folds, options.bootstrap_draws, rng),
        jobs=jobs,
    )


def _lead(baseline: Baseline, options: TracingOptions) -> float:
    """Return the multiple of the chi-square with an effect up to which a model without it is as good."""
    return (options.rules.selection_by_force if baseline.model_error else options.rules.selection).lead


def _refined(
    selection: Selection,
    declared: int,
    model_error: bool,
    options: TracingOptions,
    rng: np.random.Generator,
    jobs: int,
) -> Selection:
    return with_richer_forms(
        selection,
        declared,
        folds=options.folds,
        draws=options.bootstrap_draws,
        rng=rng,
        model_error=model_error,
        jobs=jobs,
        rules=options.rules.refinement,
    )


def _with_window(
    selection: Selection,
    noise: float,
    training: Recordings,
    effects: Mapping[str, Effect],
    options: TracingOptions,
    jobs: int,
) -> tuple[float, Selection]:
    """Search for a moving average by the recorder, if the model leaves more than noise."""
    left = selection.chosen.chi_square - noise
    if (
        not options.observation_filter
        or left < options.rules.selection.nothing_missing * noise
        or not bool(np.all(training.period_s > 0.0))
    ):
        return 0.0, selection
    share, filtered = observation_window(selection.chosen, rules=options.rules.nuisances, jobs=jobs)
    if share == 0.0:
        return 0.0, selection
    base, ground = (observation_window(item, (share,))[1] for item in (selection.base, selection.without_effects))
    terms = [Term(effect, form) for effect in effects.values() for form in effect.forms]
    again = forward_selection(
        ground,
        noise,
        terms,
        most=options.most_effects,
        refits=options.refits,
        rules=options.rules.selection_by_force,
        jobs=jobs,
    )
    if selection.ground is not None:
        # an effect may have led to a better optimum of the base form
        again = replace(again, base=base, ground=again.base).with_floor(noise)
    if noise < selection.noise:
        again = with_floor_of_flexible_model(again, options.rules.model_error)
    known = {term.effect.name for term in selection.chosen.problem.terms}
    others = {term.effect.name for term in again.chosen.problem.terms} - known
    if others or again.chosen.chi_square > filtered.chi_square:
        # only the race compares an effect with all base forms, so no effect is newly named after the filter
        again = replace(again, chosen=filtered, rounds=selection.rounds, proven=selection.proven)
    return share, again


def _cross_validated(
    selection: Selection, declared: int, options: TracingOptions, rng: np.random.Generator, jobs: int
) -> tuple[list[Gain | None], Selection]:
    """Keep the chosen effects that lower the error on training tests left out; return the gain of each."""
    chosen = selection.chosen
    if len(chosen.problem.terms) == declared:
        return [], selection
    path = [selection.without_effects]
    for candidates in selection.rounds:
        nearest = [c.fit for c in candidates if c.fit.problem.terms == chosen.problem.terms[: len(path) + declared]]
        if nearest:
            path.append(nearest[0])
    if path[-1] is not chosen:
        path = [selection.without_effects, chosen]
    errors = [left_out_residual(item, options.folds, jobs=jobs) for item in path]
    gains: list[Gain | None] = []
    for before, after in itertools.pairwise(errors):
        gain = gain_of(before, after, chosen.problem, draws=options.bootstrap_draws, rng=rng)
        if not gain.significant:
            return gains, replace(selection, chosen=path[len(gains)])
        gains.append(gain)
    return gains, selection
