"""What is chosen, with the filter of the displacement and the rate of the fits that the chosen model itself prefers.

Before a model is chosen, simple base forms judge the filter, and the rate is given. Both can hide what the models lack.
The chosen model judges them again, and everything is chosen again where another filter or rate leaves clearly less.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.known import Known
from mrpipe.fitting.recordings import MOST_SAMPLES, Recordings, record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.baseline import Baseline, declared_base, fit_baseline
from mrpipe.tracing.bench.choose import Choice, choose_model
from mrpipe.tracing.bench.cutoff import better_limit, highest_cutoff, loosest_limit
from mrpipe.tracing.bench.sampling import better_rate
from mrpipe.tracing.bench.testability import untestable
from mrpipe.tracing.options import TracingOptions


@dataclass(frozen=True)
class Bench:
    """What a tracing has at hand.

    Attributes
    ----------
    tests
        Training tests.
    effects, declared
        The library, and the effects that belong to the baseline.
    rng
        Source of randomness.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share done and a text.
    known
        Base forms as they were fitted to the same tests before: where the search of each begins.
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
    """Training tests as they are fitted, and the declared model on them.

    Attributes
    ----------
    options
        How it is traced, with the rate of the fits.
    limit_hz
        Upper limit of the cut-offs of the displacement.
    training
        The tests.
    able, reasons
        Effects that these tests can show, and for each other one why they cannot.
    first
        Fit of the declared model.
    """

    options: TracingOptions
    limit_hz: float
    training: Recordings
    able: Mapping[str, Effect]
    reasons: Mapping[str, str]
    first: Baseline


@dataclass(frozen=True)
class Chosen(Start):
    """The same with what was chosen.

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


def begin(bench: Bench, options: TracingOptions) -> Start:
    """Return the training tests, filtered by criterion or as simple base forms prefer, with the declared model."""
    return _started(bench, options, *_training(bench, options))


def choose(bench: Bench, begun: Start) -> Chosen:
    """Return base form and effects, chosen again if another filter or rate leaves clearly less.

    Parameters
    ----------
    bench
        What the tracing has at hand.
    begun
        Training tests and declared model.
    """
    found = _choose(bench, begun)
    options, fit = found.options, found.choice.selection.chosen
    faster = _at_better_rate(found.choice, bench.tests, found.limit_hz, options)
    if faster is not options:
        limit = _limit_of(fit, bench, found.limit_hz, faster)
        samples = round(MOST_SAMPLES * faster.fit_rate_hz / options.fit_rate_hz)
        again = _at(bench, faster, limit, samples)
        if again.names == found.names:
            return again
        # a higher rate makes a model more accurate; it does not show that an effect is there or missing
    limit = _limit_of(fit, bench, found.limit_hz, options)
    return found if limit == found.limit_hz else _at(bench, options, limit)


def _at(bench: Bench, options: TracingOptions, limit: float, samples: int = MOST_SAMPLES) -> Chosen:
    training = recorded(bench.tests, limit, options, most_samples=samples)
    return _choose(bench, _started(bench, options, training, limit))


def _started(bench: Bench, options: TracingOptions, training: Recordings, limit: float) -> Start:
    able, reasons = untestable(training, bench.effects, options.rules.testability)
    return Start(options, limit, training, able, reasons, _first_baseline(training, bench, options))


def _choose(bench: Bench, begun: Start) -> Chosen:
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
    return Chosen(**vars(begun), choice=choice)


def _training(bench: Bench, options: TracingOptions) -> tuple[Recordings, float]:
    """Return the training tests and the limit of the cut-offs of their displacement [Hz]."""
    tests = bench.tests
    automatic = recorded(tests, np.inf, options)
    if options.displacement_cutoff_hz > 0.0:
        return automatic, np.inf
    highest = highest_cutoff(
        tests,
        automatic,
        rate_hz=options.fit_rate_hz,
        yield_order=options.yield_order,
        viscosity_order=options.viscosity_order,
        known=bench.known,
        rules=options.rules.nuisances,
        jobs=bench.jobs,
    )
    return (automatic if not np.isfinite(highest) else recorded(tests, highest, options)), highest


def _limit_of(
    chosen: Fit, bench: Bench, highest: float, options: TracingOptions, rule: Callable[..., float] = better_limit
) -> float:
    """Return the limit of the cut-offs [Hz] with which the chosen model leaves clearly less, else the present one."""
    if options.displacement_cutoff_hz > 0.0:
        return highest
    tests = bench.tests
    return rule(
        chosen,
        tests,
        recorded(tests, np.inf, options),
        highest,
        rate_hz=options.fit_rate_hz,
        rules=options.rules.nuisances,
        jobs=bench.jobs,
    )


def limit_of_validation(bench: Bench, taken: Chosen) -> float:
    """Return the limit of the cut-offs of the validation tests [Hz]: no lower than the chosen model needs."""
    return _limit_of(taken.choice.selection.chosen, bench, taken.limit_hz, taken.options, loosest_limit)


def _at_better_rate(
    choice: Choice, tests: Sequence[PreparedTest], highest: float, options: TracingOptions
) -> TracingOptions:
    """Return the options with the rate at which the chosen model leaves clearly less, else the options themselves."""
    chosen, rules = choice.selection.chosen, options.rules
    # where the model's error is the measure, it does not show whether something remains
    near = chosen.chi_square < (1.0 + rules.refinement.worth_a_try) * choice.selection.noise
    if near and not choice.baseline.model_error:
        return options
    rate = better_rate(
        chosen,
        tests,
        rate_hz=options.fit_rate_hz,
        cutoff_hz=options.displacement_cutoff_hz,
        highest_cutoff_hz=highest,
        gain=rules.nuisances.rate_gain,
    )
    return options if rate == options.fit_rate_hz else options.model_copy(update={"fit_rate_hz": rate})


def recorded(
    tests: Sequence[PreparedTest], highest: float, options: TracingOptions, *, most_samples: int = MOST_SAMPLES
) -> Recordings:
    """Return tests end to end, with the displacement filtered by criterion and up to a limit [Hz]."""
    return record_tests(
        tests,
        rate_hz=options.fit_rate_hz,
        cutoff_hz=options.displacement_cutoff_hz,
        highest_cutoff_hz=highest,
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
