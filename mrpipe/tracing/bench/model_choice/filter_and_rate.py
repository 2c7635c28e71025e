"""Choice of a model, of the filter of the displacement, and of the rate of the fits.

Before a model is chosen, simple base forms judge the filter, and the rate is given. Both can hide what the models lack.
Filter and rate are therefore judged again with the chosen model. If another filter or rate gives a clearly smaller
error, everything is chosen again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import fit
from mrpipe.fitting.known import Known
from mrpipe.fitting.recordings import MOST_JUDGED, MOST_SAMPLES, Recordings, record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.campaign_tests.testability import effects_by_testability
from mrpipe.tracing.bench.model_choice.choose import Choice, choose_model
from mrpipe.tracing.bench.model_choice.cutoff import (
    MotionFilter,
    best_filter,
    better_filter,
    loosest_limit,
    simple_error,
)
from mrpipe.tracing.bench.model_choice.sampling import better_rate
from mrpipe.tracing.bench.noise.baseline import Baseline, declared_base, fit_baseline
from mrpipe.tracing.options import TracingOptions

ITERATIONS = 15
"""Numerical technique: largest number of steps of the fit, at a higher rate, of a model chosen at a lower rate."""


@dataclass(frozen=True)
class Bench:
    """Inputs of a tracing.

    Attributes
    ----------
    tests
        Training tests.
    effects, declared
        Effects of the library, and the effects that belong to the baseline.
    rng
        Source of randomness.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share done and a text.
    known
        Base forms that were fitted to the same tests before; the search of each starts from them.
    """

    tests: Sequence[PreparedTest]
    effects: Mapping[str, Effect]
    declared: Sequence[Effect]
    rng: np.random.Generator
    jobs: int = 1
    progress: Progress = no_progress
    known: Known = field(default_factory=dict)


@dataclass(frozen=True)
class Start:
    """Training tests in the form in which they are fitted, and the fit of the declared model.

    Attributes
    ----------
    options
        Options of the tracing, with the rate of the fits.
    filter
        Filter that removes noise from the displacement.
    training
        The tests, concatenated.
    able, reasons
        Effects that these tests can show, and for every other effect the reason why they cannot.
    first
        Fit of the declared model.
    """

    options: TracingOptions
    filter: MotionFilter
    training: Recordings
    able: Mapping[str, Effect]
    reasons: Mapping[str, str]
    first: Baseline


@dataclass(frozen=True)
class ChosenModel(Start):
    """Training tests in the form in which they are fitted, and the chosen base form with its effects.

    Attributes
    ----------
    choice
        Base form and effects.
    """

    choice: Choice

    @property
    def names(self) -> set[str]:
        """Names of the effects."""
        return {term.effect.name for term in self.choice.selection.chosen.problem.terms}


def fit_declared_model(bench: Bench, options: TracingOptions) -> Start:
    """Return the training tests, with noise removed from the displacement, and the fit of the declared model.

    Either the noise that all tests share is removed, or a low-pass is chosen for each test. The error of simple base
    forms decides.
    """
    way = MotionFilter()
    if options.displacement_cutoff_hz == 0.0:
        judging = partial(
            simple_error,
            rate_hz=options.fit_rate_hz,
            yield_order=options.yield_order,
            viscosity_order=options.viscosity_order,
            known=bench.known,
        )
        automatic = filtered_recordings(bench.tests, way, options)
        way = best_filter(bench.tests, automatic, judging, rules=options.rules.nuisances, jobs=bench.jobs)
    return _started(bench, options, way, filtered_recordings(bench.tests, way, options))


def choose_with_filter_and_rate(bench: Bench, begun: Start) -> ChosenModel:
    """Return base form and effects, chosen again if another filter or rate gives a clearly smaller error.

    Parameters
    ----------
    bench
        Inputs of the tracing.
    begun
        Training tests and declared model.
    """
    found = _choose(bench, begun)
    options = found.options
    faster = _at_better_rate(bench, found)
    if faster is not options:
        samples = round(MOST_SAMPLES * faster.fit_rate_hz / options.fit_rate_hz)
        again = _at(bench, faster, _better_filter(bench, found, faster), samples)
        # a higher rate makes a model more accurate; it does not show that an effect is missing or superfluous
        if again.names == found.names or (
            len(again.names) == len(found.names) and _leaves_less(again, found, options.rules.nuisances.rate_gain)
        ):
            return again
        if found.names and again.names > found.names:
            again = _at(bench, faster, again.filter, samples, found.names)
            if again.names == found.names:
                return again
    way = _better_filter(bench, found, options)
    return found if way is found.filter else _at(bench, options, way)


def _at(
    bench: Bench,
    options: TracingOptions,
    way: MotionFilter,
    samples: int = MOST_SAMPLES,
    names: Set[str] | None = None,
) -> ChosenModel:
    """Return the choice with a given rate and filter; `names` limits the effects that are tried."""
    training = filtered_recordings(bench.tests, way, options, most_samples=samples)
    begun = _started(bench, options, way, training)
    if names is not None:
        begun = replace(begun, able={name: effect for name, effect in begun.able.items() if name in names})
    return _choose(bench, begun)


def _started(bench: Bench, options: TracingOptions, way: MotionFilter, training: Recordings) -> Start:
    able, reasons = effects_by_testability(training, bench.effects, options.rules.testability)
    return Start(options, way, training, able, reasons, _first_baseline(training, bench, options))


def _choose(bench: Bench, begun: Start) -> ChosenModel:
    choice = choose_model(
        begun.first,
        begun.training,
        begun.able,
        list(bench.declared),
        begun.options,
        known=bench.known,
        rng=bench.rng,
        jobs=bench.jobs,
        progress=bench.progress,
    )
    return ChosenModel(**vars(begun), choice=choice)


def _better_filter(bench: Bench, found: ChosenModel, options: TracingOptions) -> MotionFilter:
    """Return the filter with which the error of the chosen model is clearly smaller, else the present one."""
    if options.displacement_cutoff_hz > 0.0:
        return found.filter
    return better_filter(
        found.choice.selection.chosen,
        bench.tests,
        filtered_recordings(bench.tests, MotionFilter(), options),
        found.filter,
        rate_hz=options.fit_rate_hz,
        rules=options.rules.nuisances,
        jobs=bench.jobs,
    )


def validation_recordings(bench: Bench, begun: Start, unseen: Sequence[PreparedTest]) -> Recordings:
    """Return the validation tests, concatenated, with the displacement filtered like that of the training tests.

    The cut-off of a low-pass is the highest one that does not raise the error of the chosen model. Shared noise is
    removed with the spectral density that the training tests show.

    Parameters
    ----------
    bench
        Inputs of the tracing.
    begun
        Training tests and their filter; with the choice, if it has been made.
    unseen
        Validation tests.
    """
    way, options = begun.filter, begun.options
    if isinstance(begun, ChosenModel) and way.noise is None and options.displacement_cutoff_hz == 0.0:
        limit = loosest_limit(
            begun.choice.selection.chosen,
            bench.tests,
            filtered_recordings(bench.tests, MotionFilter(), options),
            way.limit_hz,
            rate_hz=options.fit_rate_hz,
            rules=options.rules.nuisances,
            jobs=bench.jobs,
        )
        way = MotionFilter(limit)
    return filtered_recordings(unseen, way, options, most_samples=MOST_JUDGED)


def _at_better_rate(bench: Bench, found: ChosenModel) -> TracingOptions:
    """Return the options with the rate at which the error of the chosen model is clearly smaller, else unchanged."""
    choice, options = found.choice, found.options
    chosen, rules = choice.selection.chosen, options.rules
    # if weights follow from the error of the model, they do not show whether a structure remains
    near = chosen.chi_square < (1.0 + rules.refinement.worth_a_try) * choice.selection.noise
    if near and not choice.baseline.model_error:
        return options
    rate = better_rate(
        chosen,
        found.filter.applied(bench.tests),
        rate_hz=options.fit_rate_hz,
        cutoff_hz=options.displacement_cutoff_hz,
        highest_cutoff_hz=found.filter.limit_hz,
        gain=rules.nuisances.rate_gain,
    )
    return options if rate == options.fit_rate_hz else options.model_copy(update={"fit_rate_hz": rate})


def _leaves_less(again: ChosenModel, found: ChosenModel, gain: float) -> bool:
    """Return whether the choice at a higher rate has a clearly smaller error there than the choice before.

    A reversal that lasts a few samples of the lower rate can look like a delay between the channels.

    Parameters
    ----------
    again, found
        Choices at the higher and at the lower rate.
    gain
        Share by which the RMS of the residual must be lower.
    """
    chosen, before = (item.choice.selection.chosen for item in (again, found))
    present = fit(before.problem.on_samples_of(chosen.problem), before.theta, iterations=ITERATIONS)
    return bool(np.sqrt(chosen.chi_square) < (1.0 - gain) * np.sqrt(present.chi_square))


def filtered_recordings(
    tests: Sequence[PreparedTest], way: MotionFilter, options: TracingOptions, *, most_samples: int = MOST_SAMPLES
) -> Recordings:
    """Return concatenated tests, with noise removed from the displacement in a given way."""
    return record_tests(
        way.applied(tests),
        rate_hz=options.fit_rate_hz,
        cutoff_hz=options.displacement_cutoff_hz,
        highest_cutoff_hz=way.limit_hz,
        most_samples=most_samples,
    )


def _first_baseline(training: Recordings, bench: Bench, options: TracingOptions) -> Baseline:
    base = declared_base(training, options.model, options.yield_order, options.viscosity_order, options.form_files)
    return fit_baseline(
        training,
        base,
        bench.declared,
        model_error_share=options.model_error_share,
        rules=options.rules.noise,
        known=bench.known,
    )
