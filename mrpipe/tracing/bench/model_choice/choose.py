"""From the baseline to a base form and effects, by comparison of models (the race).

The first race has weights by the noise of the sensors. If the error of all models exceeds this noise, a second race has
weights by the force.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mrpipe.artifacts import Progress
from mrpipe.dampers.library import base_form
from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit, fit
from mrpipe.fitting.known import Known
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.start import fit_with_form
from mrpipe.signals.error_size import rms
from mrpipe.tracing.bench.base_forms.fits_of_forms import compared_fits_without_effects, on_all_tests
from mrpipe.tracing.bench.base_forms.promotion import extension_of, winner_on_all_tests, with_candidates
from mrpipe.tracing.bench.base_forms.race import Race, race
from mrpipe.tracing.bench.base_forms.sufficient_error import nrmse_of_noise, sufficient_chi_square
from mrpipe.tracing.bench.noise.baseline import Baseline, declared_base, fit_baseline, noise_level_of
from mrpipe.tracing.bench.noise.weights import NoiseScale, force_deviation, noise_scale, noise_variances
from mrpipe.tracing.bench.residuals.ceiling import flexible_chi_square
from mrpipe.tracing.bench.residuals.nuisances import observation_window, with_lag_apart
from mrpipe.tracing.bench.selection.drive_again import with_laws_again, with_laws_of_leaders
from mrpipe.tracing.bench.selection.pairs import with_play
from mrpipe.tracing.bench.selection.refine import with_richer_forms
from mrpipe.tracing.bench.selection.select import Selection, fit_on_draft_tests, forward_selection
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.rules import ModelErrorRules, NoiseRules, TracingRules

ROUNDED_FORM = "yielding-part"
"""Base form with which a moving average by the recorder is judged. Its yield is rounded, so that the average is found
only if it explains more than a rounded yield does: both round the loops of force over displacement."""


@dataclass(frozen=True)
class Choice:
    """Result of the choice of a model.

    Attributes
    ----------
    baseline
        Baseline, with the weights that were used.
    selection
        Base form and effects, fitted to all training tests.
    race
        The models that were compared; None if nothing is missing.
    """

    baseline: Baseline
    selection: Selection
    race: Race | None = None

    def support(self, effect: str, options: TracingOptions, rng: np.random.Generator) -> float:
        """Return the share of resamples of the training tests in which an effect is needed; 0 without a race."""
        if self.race is None:
            return 0.0
        return self.race.support(effect, options.lead, draws=options.bootstrap_draws, rng=rng)


def choose_model(
    first: Baseline,
    training: Recordings,
    effects: Mapping[str, Effect],
    declared: list[Effect],
    options: TracingOptions,
    *,
    known: Known | None = None,
    rng: np.random.Generator,
    jobs: int,
    progress: Progress,
) -> Choice:
    """Choose base form and effects.

    Parameters
    ----------
    first
        Fit of the declared model with its effects.
    training
        Training tests.
    effects
        Effects that the tests can show.
    declared
        Effects that belong to the baseline.
    options
        Options of the tracing.
    known
        Base forms that were fitted to the same tests before; the search of each starts from them.
    rng
        Source of randomness.
    jobs
        Threads.
    progress
        Called with the share of the work that is done (0 to 1) and a text.
    """
    baseline, floor, weighed = first, options.model_error_share, False
    if floor > 0.0:
        baseline = _without_nuisances(baseline, options, known)
    while True:
        choice, completed = _raced(baseline, effects, options, known, floor > 0.0, weighed, jobs, progress)
        selection = choice.selection
        quieter = None if weighed or floor > 0.0 or choice.race is None else _quieter(choice, options.rules)
        if quieter is not None:
            # changes from cycle to cycle that an effect causes looked like noise until the effect was found
            baseline, weighed = quieter, True
            continue
        if choice.race is not None:
            selection = with_laws_again(selection, options.yield_order, options.viscosity_order)
        if floor > 0.0:
            selection = with_floor_of_flexible_model(selection, options.rules.model_error)
            return replace(choice, selection=completed(selection))
        if choice.race is None:
            return choice
        if _near_the_noise(selection, baseline.noise, len(declared), options, rng, jobs):
            baseline, selection = _with_noise_of(selection.chosen, baseline, selection, options.rules.noise)
            return replace(choice, baseline=baseline, selection=completed(selection))
        # a second race judges by the error relative to the force
        chosen = selection.chosen
        used = chosen.problem.root_weight > 0.0
        left = chosen.residual[used] / chosen.problem.root_weight[used]
        floor = rms(left) / training.force_rms
        base = declared_base(training, options.model, options.yield_order, options.viscosity_order, options.form_files)
        declared_fit = fit_baseline(
            training, base, declared, model_error_share=floor, rules=options.rules.noise, known=known
        )
        baseline = _without_nuisances(_with_scale(declared_fit, choice, options.rules.noise), options, known)


def _near_the_noise(
    selection: Selection, noise: float, declared: int, options: TracingOptions, rng: np.random.Generator, jobs: int
) -> bool:
    """Return whether the error is close to the noise, with the chosen effects or a richer form of the same effect."""
    plain = selection.chosen.chi_square / max(noise, 1e-12)
    rules = options.rules.model_error
    if plain < rules.chi_square:
        return True
    # the right effect in too simple a form may leave as large an error as a wrong base form
    refined = with_richer_forms(
        selection,
        declared,
        folds=options.folds,
        draws=options.bootstrap_draws,
        rng=rng,
        jobs=jobs,
        rules=options.rules.refinement,
    )
    richer = refined.chosen.chi_square / max(noise, 1e-12)
    return richer < max(rules.chi_square, min(rules.most * rules.chi_square, (1.0 - rules.too_plain) * plain))


def _raced(
    baseline: Baseline,
    effects: Mapping[str, Effect],
    options: TracingOptions,
    known: Known | None,
    model_error: bool,
    weighed: bool,
    jobs: int,
    progress: Progress,
) -> tuple[Choice, Callable[[Selection], Selection]]:
    """Run the race and fit its winner to all training tests; `weighed`: the weights follow from an earlier winner.

    The function that is returned with the choice adds the candidates and the winner with further terms to the
    selection. It takes long, and it is called only if the race is not repeated.
    """
    rules = options.rules.selection_by_force if model_error else options.rules.selection
    least = options.rules.selection.nothing_missing
    nothing = Selection(baseline.fit, baseline.noise, (), baseline.fit, nothing_missing=least)
    if not nothing.structured and not _noise_of_motion(baseline, options.rules.noise):
        return Choice(baseline, nothing), lambda selection: selection
    progress(0.1, "base forms")
    singles = with_laws_of_leaders(
        compared_fits_without_effects(baseline.fit, options, known=known, jobs=jobs),
        options.yield_order,
        options.viscosity_order,
        enough=sufficient_chi_square(baseline.noise, nrmse_of_noise(baseline.fit, baseline.noise), options.rules.race),
        least=least * baseline.noise,
        jobs=jobs,
    )
    if not model_error and not weighed:
        baseline, singles = _with_noise_of_best(baseline, singles, options.rules)
        nothing = replace(nothing, base=baseline.fit, noise=baseline.noise, chosen=baseline.fit)
    if not nothing.structured:
        return Choice(baseline, nothing), lambda selection: selection
    base, noise = baseline.fit, baseline.noise
    search = partial(
        forward_selection,
        noise=noise,
        terms=[Term(effect, form) for effect in effects.values() for form in effect.forms],
        most=options.most_effects,
        refits=options.refits,
        rules=rules,
        jobs=jobs,
    )
    further = partial(with_play, effects=effects) if model_error else None
    found = race(base, singles, search, noise, further=further, rules=options.rules.race, jobs=jobs, progress=progress)
    winner = found.winner(options.lead)
    progress(0.7, "fit to all tests")
    selection = winner_on_all_tests(found, winner, base)
    selection = replace(
        selection,
        proven=len(winner.effects) - len(found.own),
        tied_forms=found.tied_forms(winner, options.lead),
        nothing_missing=least,
    )

    def completed(kept: Selection) -> Selection:
        further = extension_of(found, winner, selection.chosen, base.problem, search, options.rules.refinement)
        return replace(with_candidates(kept, found), extension=further)

    return Choice(baseline, selection, found), completed


def _with_noise_of(
    chosen: Fit, baseline: Baseline, selection: Selection, rules: NoiseRules
) -> tuple[Baseline, Selection]:
    """Estimate the noise from the chosen fit, because errors of a poor model do not cancel between repeats.

    The residual of the chosen model is an upper bound of the noise.
    """
    scale = noise_scale(chosen, rules)
    noise = noise_level_of(chosen, scale, rules)
    # the residual of a poor model hides hum, so that only hum makes the noise of the better model the larger one
    newly_visible = scale.hum > 0.0 and baseline.scale.hum == 0.0
    if noise >= baseline.noise and not newly_visible:
        scale, noise = baseline.scale, baseline.noise
    excess = chosen.chi_square / max(noise, 1e-300)
    if excess < 1.0:
        scale, noise = replace(scale, force=excess * scale.force, motion=excess * scale.motion), chosen.chi_square
    return replace(baseline, noise=noise, scale=scale), selection.with_floor(noise)


def _noise_of_motion(baseline: Baseline, rules: NoiseRules) -> bool:
    """Return whether most of the noise of the force is noise of the displacement times the stiffness of the model.

    A stiff base form converts noise of the displacement to a large force. Another form of the same damper may not. Such
    noise therefore does not show that nothing is missing.
    """
    force, motion = noise_variances(baseline.fit, baseline.fit.problem.recordings, rules)
    used = baseline.fit.problem.recordings.used
    return bool(np.sum(baseline.scale.motion * motion[used]) > np.sum(baseline.scale.force * force[used]))


def _with_noise_of_best(
    baseline: Baseline, singles: Mapping[str, Fit], rules: TracingRules
) -> tuple[Baseline, dict[str, Fit]]:
    """Return baseline and base forms with weights and noise from the best base form, if it is clearly better.

    The slope of the model converts noise of the displacement to noise of the force, and repeated cycles show noise only
    after a good model has been subtracted.
    """
    base = baseline.fit
    best = min(singles.values(), key=lambda item: item.chi_square)
    if (
        best.problem.base.name == base.problem.base.name
        or best.chi_square > rules.model_error.better_form * base.chi_square
    ):
        return baseline, dict(singles)
    best_on_all = on_all_tests(best, base.problem, iterations=4)
    baseline = _weighed_by(baseline, best_on_all, noise_scale(best_on_all, rules.noise), rules.noise)
    small = fit_on_draft_tests(baseline.fit)
    again = {
        name: fit(replace(item.problem, root_weight=small.problem.root_weight), item.theta, iterations=3)
        for name, item in singles.items()
        if name != base.problem.base.name
    }
    again[base.problem.base.name] = small
    return baseline, again


def _weighed_by(baseline: Baseline, found: Fit, scale: NoiseScale, rules: NoiseRules) -> Baseline:
    """Return the baseline with weights and noise from another fit to all training tests."""
    problem = baseline.fit.problem
    root = problem.recordings.used / force_deviation(found, problem.recordings, 0.0, scale, rules)
    noise = noise_level_of(replace(found, problem=replace(found.problem, root_weight=root)), scale, rules)
    base = fit(replace(problem, root_weight=root), baseline.fit.theta, iterations=8)
    return replace(baseline, fit=base, noise=noise, scale=scale)


def _with_scale(baseline: Baseline, choice: Choice, rules: NoiseRules) -> Baseline:
    """Return a baseline with the noise that the best known model shows, if this is less."""
    scale = noise_scale(choice.selection.chosen, rules)
    noise = noise_level_of(baseline.fit, scale, rules)
    return replace(baseline, noise=noise, scale=scale) if noise < baseline.noise else baseline


def _quieter(choice: Choice, rules: TracingRules) -> Baseline | None:
    """Return the baseline weighted by the noise of the chosen model, if that is clearly less; else None."""
    chosen = choice.selection.chosen
    scale = noise_scale(chosen, rules.noise)
    noise = noise_level_of(chosen, scale, rules.noise)
    if min(noise, chosen.chi_square) > rules.model_error.better_form * choice.baseline.noise:
        return None
    return _weighed_by(choice.baseline, chosen, scale, rules.noise)


def _without_nuisances(baseline: Baseline, options: TracingOptions, known: Known | None) -> Baseline:
    """Return the baseline with separate lags for a rising and a falling drive, and with the filter of the recorder."""
    found = with_lag_apart(baseline.fit, options.rules.nuisances)
    if options.observation_filter and bool(np.all(found.problem.recordings.period_s > 0.0)):
        share = observation_window(
            fit_with_form(found, base_form(ROUNDED_FORM), iterations=8, known=known), rules=options.rules.nuisances
        )[0]
        if share > 0.0:
            found = observation_window(found, (share,))[1]
    return replace(baseline, fit=found, model_error=True)


def with_floor_of_flexible_model(selection: Selection, rules: ModelErrorRules) -> Selection:
    """Judge shares by what a flexible model can recover, if sensor noise is far below the error of any model."""
    fits = [selection.base, selection.chosen]
    reached = [flexible_chi_square(item) for item in fits[: 1 if fits[0] is fits[1] else 2]]
    floor = max(selection.noise, min(*reached, selection.chosen.chi_square, selection.base.chi_square))
    if floor > (1.0 - rules.flexible_share) * selection.base.chi_square:
        # the trees find no structure that holds on other tests: repeats and sensors are the better measure
        return selection
    return selection.with_floor(floor)
