"""The whole tracing of a bench campaign: baseline, structure, candidates, verdict, errors before and after."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.dampers.library import forms_named
from mrpipe.effects.contract import Effect
from mrpipe.effects.yielding_parts import with_yielding_parts
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import (
    MOST_JUDGED,
    Recordings,
    enough_tests,
    record_tests,
    spread_tests,
)
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.baseline import (
    Baseline,
    declared_base,
    family_of,
    fit_baseline,
    noise_level_of,
    with_form,
)
from mrpipe.tracing.bench.ceiling import flexible_chi_square
from mrpipe.tracing.bench.crossvalidation import Gain, gain_of, intervals, left_out_residual
from mrpipe.tracing.bench.drive_again import with_laws_again
from mrpipe.tracing.bench.forms import alone, cost, grounds
from mrpipe.tracing.bench.gates import held, judged, never_yields, predicts, structured, validated
from mrpipe.tracing.bench.nuisances import observation_window, with_lag_apart
from mrpipe.tracing.bench.odd_tests import SortedTests, sort_tests
from mrpipe.tracing.bench.offsets import offset_between_tests
from mrpipe.tracing.bench.on_validation import OnValidation
from mrpipe.tracing.bench.pairs import rounded_drafts, with_play
from mrpipe.tracing.bench.refine import with_richer_forms
from mrpipe.tracing.bench.select import Selection, Thresholds, forward_selection, share_of
from mrpipe.tracing.bench.summary import FLEXIBLE_SHARE, Summary, Tracing, TracingOptions
from mrpipe.tracing.bench.testability import untestable
from mrpipe.tracing.bench.verdict import (
    Named,
    clear_lead,
    confidence_of,
    parameter_table,
    tied,
    unnamed_reason,
)
from mrpipe.tracing.bench.weights import noise_scale

MODEL_ERROR_CHI_SQUARE = 6.0
"""Where the best composite leaves this many times the noise, sensors' noise is no measure: weights by force RMS."""

TOO_PLAIN = 0.5
"""But where a richer form of the same effect takes this share of it (up to thrice that) only the form was wrong."""

REAL_THRESHOLDS = Thresholds(gain=0.02, term_share=0.06, named_share=0.25, lead=1.0)
"""What a further effect must recover where weights go by force RMS: noise is far below any model's error.

Rivals that come near are told by `tied_with`."""

CLEAR_OFFSETS = 3.0
"""Offsets of the tests that spread by so many times what an unknown residual leaves are no part of that residual."""


def trace_campaign(
    tests: Sequence[PreparedTest],
    effects: Mapping[str, Effect],
    declared: Sequence[Effect],
    options: TracingOptions,
    *,
    rng: np.random.Generator,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Tracing:
    """Trace the residual of a bench campaign.

    Parameters
    ----------
    tests
        Prepared tests; roles `training` and `repeat` decide, `validation` only reports.
    effects
        The library: name -> effect.
    declared
        Effects that the campaign declares: part of the baseline.
    options
        How it is traced.
    rng
        Source of randomness.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share done and a text.
    """
    rate, cutoff = options.fit_rate_hz, options.displacement_cutoff_hz
    ordered = sort_tests(tests)
    usable = spread_tests(enough_tests([t for t in ordered.tests if t.role != "validation"]))
    training = record_tests(usable, rate_hz=rate, cutoff_hz=cutoff)
    unseen = [t for t in ordered.tests if t.role == "validation"]
    validation = record_tests(unseen, rate_hz=rate, cutoff_hz=cutoff, most_samples=MOST_JUDGED)
    progress(0.05, "baseline")
    able, reasons = untestable(training, effects)
    # a base form that is declared is no effect that could be missing
    able = {name: item for name, item in able.items() if name != family_of(options.model)}
    first = _first_baseline(training, declared, options)
    found = validated(first.fit, first.fit, first, training, validation, options)
    refusal = ""
    if never_yields(first.fit, options.validation):
        refusal = "the damper does not yield within the stroke of the training tests"
    elif not predicts(found, first, training, options, ordered.faults, jobs):
        error = found.nrmse(found.before)
        refusal = f"the model {options.model} does not predict the validation tests (NRMSE {error:.3g})"
    if refusal:
        return _nothing_traced(
            f"{refusal}: nothing is traced", ordered, found, first, training, reasons, declared, options, jobs
        )
    baseline, selection = _select(first, training, able, declared, options, rng, jobs, progress)
    window = selection.base.problem.window_share
    if not baseline.model_error:
        window, selection = _with_window(selection, baseline.noise, training, able, options, jobs)
    gains, selection = _cross_validated(selection, len(declared), options, rng, jobs)
    reason = unnamed_reason(selection, options.rules)
    if reason:
        selection = replace(selection, chosen=selection.without_effects)
    elif not baseline.model_error:
        selection = _refined(selection, len(declared), options, rng, jobs)
    progress(0.85, "ceiling")
    offsets = offset_between_tests(
        selection.chosen, effects.get("offset"), least_ratio=CLEAR_OFFSETS if reason and selection.structured else 0.0
    )
    named = _named(selection, gains, len(declared), options, rng)
    causes = [*named[: selection.proven], *([offsets.named()] if offsets is not None else [])]
    if offsets is not None and any(item.effect.name == "offset" for item in named[: selection.proven]):
        causes.pop()
    if baseline.model_error:
        # the base form is a verdict of its own, and every real damper asks for this one: what else there is comes first
        causes.sort(key=lambda item: item.effect.name == "rate-dependent-yield")
    further = named[selection.proven :]
    missing = structured(selection, baseline, training, options, bool(causes))
    found = validated(selection.base, selection.chosen, baseline, training, validation, options, offsets is not None)
    judgement = judged(found, selection, training, options, causes, missing, reason, ordered, jobs)
    if causes and judgement.evidence.after >= judgement.evidence.before:
        # what does not lower the error on the validation tests is not named
        selection = replace(selection, chosen=selection.without_effects)
        causes, further, offsets = [], (), None
        reason = "the effects that the training tests ask for do not lower the error on the validation tests"
        found = validated(selection.base, selection.chosen, baseline, training, validation, options)
        judgement = judged(found, selection, training, options, causes, missing, reason, ordered, jobs)
    causes = [held(item, judgement) for item in causes]
    report = Summary(selection, baseline, training, offsets, found, judgement, ordered)
    return report.build(options, tuple(causes), further, reasons, window, [item.name for item in declared])


def _first_baseline(training: Recordings, declared: Sequence[Effect], options: TracingOptions) -> Baseline:
    base = declared_base(training, options.model, options.yield_order, options.viscosity_order)
    return fit_baseline(training, base, declared, model_error_share=options.model_error_share)


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
    """Return the tracing of a base model on which no effect can be judged."""
    selection = Selection(baseline.fit, baseline.noise, (), baseline.fit)
    judgement = judged(found, selection, training, options, (), True, reason, ordered, jobs)
    if reason not in judgement.verdict.sentence:
        words = f"{reason}; {judgement.verdict.sentence}"
        judgement = replace(judgement, verdict=replace(judgement.verdict, sentence=words))
    report = Summary(selection, baseline, training, None, found, judgement, ordered)
    return report.build(options, (), (), untested, 0.0, [item.name for item in declared])


def _select(
    first: Baseline,
    training: Recordings,
    effects: Mapping[str, Effect],
    declared: Sequence[Effect],
    options: TracingOptions,
    rng: np.random.Generator,
    jobs: int,
    progress: Progress,
) -> tuple[Baseline, Selection]:
    """Fit the baseline and select effects; with weights by force RMS where no composite comes near the noise."""
    base = first.fit.problem.base
    own = list(declared)
    floor = options.model_error_share
    baseline = first
    while True:
        if floor != options.model_error_share:
            baseline = fit_baseline(training, base, own, model_error_share=floor)
        progress(0.2, "candidates")
        if floor > 0.0:
            effects = with_yielding_parts(effects)
            baseline = _without_nuisances(baseline, effects, options)
        select = partial(
            forward_selection,
            noise=baseline.noise,
            terms=[Term(effect, form) for effect in effects.values() for form in effect.forms],
            most=options.most_effects,
            refits=options.refits,
            thresholds=REAL_THRESHOLDS if floor > 0.0 else Thresholds(),
            jobs=jobs,
            drafted=_drafted(baseline.fit, effects) if floor > 0.0 else None,
        )
        selection = select(baseline.fit)
        if floor > 0.0:
            return baseline, _judged_by_trees(with_play(selection, effects))
        full = declared_base(training, options.model, options.yield_order, options.viscosity_order)
        selection = with_laws_again(selection, full)
        selection = _in_better_form(selection, select, options, jobs)
        if _near_the_noise(selection, baseline.noise, len(own), options, rng, jobs):
            return _with_noise_of(selection.chosen, baseline, selection)
        # what is left on the force's own scale becomes the yardstick of the second pass
        chosen = selection.chosen
        used = chosen.problem.root_weight > 0.0
        left = chosen.residual[used] / chosen.problem.root_weight[used]
        floor = float(np.sqrt(np.mean(left**2))) / training.force_rms


def _near_the_noise(
    selection: Selection, noise: float, declared: int, options: TracingOptions, rng: np.random.Generator, jobs: int
) -> bool:
    """Return whether the sensors' noise is the measure, for what was chosen or for a richer form of the same effect."""
    plain = selection.chosen.chi_square / max(noise, 1e-12)
    if plain < MODEL_ERROR_CHI_SQUARE:
        return True
    # the right effect in too plain a form may leave as much as a wrong base does
    richer = _refined(selection, declared, options, rng, jobs).chosen.chi_square / max(noise, 1e-12)
    return richer < max(MODEL_ERROR_CHI_SQUARE, min(3.0 * MODEL_ERROR_CHI_SQUARE, (1.0 - TOO_PLAIN) * plain))


def _drafted(base: Fit, effects: Mapping[str, Effect]) -> Callable[[Fit], list[Fit]] | None:
    rate = effects.get("rate-dependent-yield")
    if rate is None or any(term.effect.name == rate.name for term in base.problem.terms):
        return None
    return partial(rounded_drafts, rate=rate)


def _in_better_form(
    selection: Selection, select: Callable[[Fit], Selection], options: TracingOptions, jobs: int
) -> Selection:
    """Return the selection under another base form, if that leaves less than any effect under the declared form.

    A damper of another published form is no damper with a missing effect: under the declared form it looks like a late
    rise after reversal, or like friction.
    """
    if not selection.structured or not selection.rounds:
        return selection
    drafts = alone(selection.base, forms_named(options.base_forms), selection.noise, jobs=jobs)
    best = selection
    for ground in grounds(selection, drafts, options.rules.lead, options.rules.least_share, jobs=jobs):
        again = select(ground)
        if share_of(ground, again.chosen, again.noise) < options.rules.least_share:
            again = replace(again, chosen=ground)
        if cost(again.chosen, again.noise) < cost(best.chosen, best.noise):
            rounds = again.rounds if again.chosen is not ground else selection.rounds[:1]
            best = replace(again, base=selection.base, ground=ground, rounds=rounds).with_floor(again.noise)
    return best


def _refined(
    selection: Selection, declared: int, options: TracingOptions, rng: np.random.Generator, jobs: int
) -> Selection:
    return with_richer_forms(
        selection, declared, folds=options.folds, draws=options.bootstrap_draws, rng=rng, jobs=jobs
    )


def _with_noise_of(chosen: Fit, baseline: Baseline, selection: Selection) -> tuple[Baseline, Selection]:
    """Take the noise from the chosen fit: a poor model's errors do not all cancel between repeats."""
    scale = noise_scale(chosen)
    noise = noise_level_of(chosen, scale)
    if noise >= baseline.noise:
        return baseline, selection
    return replace(baseline, noise=noise, scale=scale), selection.with_floor(noise)


def _without_nuisances(baseline: Baseline, effects: Mapping[str, Effect], options: TracingOptions) -> Baseline:
    """Return the baseline with a drive lag that falls otherwise than it rises, and with the records' filter, if any.

    Whether the records went through a filter is judged with the yield rounded: both round the corners of a loop.
    """
    found = with_lag_apart(baseline.fit)
    rate = effects.get("rate-dependent-yield")
    present = {term.effect.name for term in found.problem.terms}
    if options.observation_filter and rate is not None and bool(np.all(found.problem.recordings.period_s > 0.0)):
        rounded = found if rate.name in present else with_form(found, rate, "own-dashpot")
        share = observation_window(rounded)[0]
        if share > 0.0:
            found = observation_window(found, (share,))[1]
    return replace(baseline, fit=found, model_error=True)


def _judged_by_trees(selection: Selection) -> Selection:
    """Judge shares by what a flexible model can recover, where the sensors' noise is far below any model's error."""
    fits = [selection.base, selection.chosen]
    reached = [flexible_chi_square(item) for item in fits[: 1 if fits[0] is fits[1] else 2]]
    floor = max(selection.noise, min(*reached, selection.chosen.chi_square, selection.base.chi_square))
    if floor > (1.0 - FLEXIBLE_SHARE) * selection.base.chi_square:
        # the trees learn nothing that holds on other tests: repeats and sensors are the better measure
        return selection
    return selection.with_floor(floor)


def _with_window(
    selection: Selection,
    noise: float,
    training: Recordings,
    effects: Mapping[str, Effect],
    options: TracingOptions,
    jobs: int,
) -> tuple[float, Selection]:
    """Look for a moving average that the records went through, where something is left to explain."""
    left = selection.chosen.chi_square - noise
    if not options.observation_filter or left < 0.2 * noise or not bool(np.all(training.period_s > 0.0)):
        return 0.0, selection
    share, filtered = observation_window(selection.chosen)
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
        thresholds=REAL_THRESHOLDS,
        jobs=jobs,
    )
    if selection.ground is not None:
        again = replace(again, base=base, ground=ground).with_floor(noise)
    if noise < selection.noise:
        again = _judged_by_trees(again)
    if again.chosen.chi_square > filtered.chi_square:
        again = replace(again, chosen=filtered, rounds=selection.rounds)
    return share, again


def _cross_validated(
    selection: Selection, declared: int, options: TracingOptions, rng: np.random.Generator, jobs: int
) -> tuple[list[Gain], Selection]:
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
    gains: list[Gain] = []
    for before, after in itertools.pairwise(errors):
        gain = gain_of(before, after, chosen.problem, draws=options.bootstrap_draws, rng=rng)
        if not gain.significant:
            return gains, replace(selection, chosen=path[len(gains)])
        gains.append(gain)
    return gains, selection


def _named(
    selection: Selection, gains: Sequence[Gain], declared: int, options: TracingOptions, rng: np.random.Generator
) -> tuple[Named, ...]:
    chosen = selection.chosen
    named = []
    limits = intervals(chosen) if len(chosen.problem.terms) > declared else []
    total = selection.share(chosen)
    for place, index in enumerate(range(declared, len(chosen.problem.terms))):
        term = chosen.problem.terms[index]
        candidates = selection.rounds[place] if place < len(selection.rounds) else ()
        rivals: tuple[str, ...] = ()
        if candidates and candidates[0].name == term.effect.name:
            rivals = tied(candidates, selection.noise, options.rules, draws=options.bootstrap_draws, rng=rng)
        gain = gains[place] if place < len(gains) else None
        named.append(
            Named(
                term.effect,
                term.form.name,
                parameter_table(chosen, index, limits[index], options.drive_unit),
                confidence_of(total, clear_lead(candidates, selection.noise), gain, options.rules),
                rivals,
                {name: term.effect.separated_by[name].advice for name in rivals if name in term.effect.separated_by},
                gain,
            )
        )
    return tuple(named)
