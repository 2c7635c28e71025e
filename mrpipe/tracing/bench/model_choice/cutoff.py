"""Removal of noise from the displacement: the noise that all tests share is removed, or a low-pass is chosen.

The tests of a campaign show the noise of the sensor at frequencies at which some of them have no motion
(:mod:`mrpipe.signals.shared_noise`). Otherwise a spectrum only shows the frequency above which white noise exceeds the
displacement. It cannot separate motion from hum of the mains, and it does not show how the remaining noise affects a
force that depends on velocity or acceleration. Therefore the error of models decides. Before a model is chosen, the
error of simple base forms is used. They can prefer a limit that hides what they lack, so the decision is made again
with the chosen model.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from mrpipe.dampers.library import base_form
from mrpipe.fitting.engine import Fit, fit
from mrpipe.fitting.known import Known
from mrpipe.fitting.recordings import Recordings, record_tests
from mrpipe.fitting.start import base_of, best_fit, distinct_levels, first_problem, polynomial_laws
from mrpipe.signals.prepared import PreparedTest
from mrpipe.signals.shared_noise import NoiseDensity, quiet_motion, shared_noise
from mrpipe.tracing.bench.selection.select import draft_tests
from mrpipe.tracing.rules import NuisanceRules

FORMS = ("bouc-wen", "bingham", "hyperbolic-tangent", "hysteretic-sigmoid")
"""Numerical technique: base forms by whose error the filter is judged. They depend on displacement, on velocity, on
both, and on acceleration.
"""

RATIO = 2.0
"""Numerical technique: ratio of successive limits that are tried with simple base forms."""

FINE_RATIO = 1.4
"""Numerical technique: ratio of successive limits that are tried with the chosen model."""

FINE_ITERATIONS = 3
"""Numerical technique: iterations of each fit of the chosen model."""

HARMONICS = 4.0
"""Numerical technique: the lowest limit, in multiples of the frequency of the motion."""

ITERATIONS = 6
"""Numerical technique: iterations of each fit."""


@dataclass(frozen=True, eq=False)
class MotionFilter:
    """Filter that removes noise from the displacement of tests.

    Attributes
    ----------
    limit_hz
        Upper limit of the cut-off frequencies of the low-passes [Hz]; infinite: no limit beyond the criterion of the
        spectra.
    noise
        Noise of the displacement sensor that is removed from the tests; None if a low-pass is used.
    """

    limit_hz: float = np.inf
    noise: NoiseDensity | None = None

    @property
    def kind(self) -> tuple[float, bool]:
        """Kind of the filter: the limit [Hz], and whether shared noise is removed."""
        return self.limit_hz, self.noise is not None

    def applied(self, tests: Sequence[PreparedTest]) -> Sequence[PreparedTest]:
        """Return the tests after removal of the shared noise."""
        return tests if self.noise is None else quiet_motion(tests, self.noise)


class Judging(Protocol):
    """Error of simple base forms on recordings, as a share of the scale of the force."""

    def __call__(self, tests: Sequence[PreparedTest], highest_cutoff_hz: float) -> float:
        """Return the error [1] of the best base form with cut-off frequencies up to a limit [Hz]."""


def simple_error(
    tests: Sequence[PreparedTest],
    highest_cutoff_hz: float,
    *,
    rate_hz: float,
    yield_order: int,
    viscosity_order: int,
    known: Known | None = None,
) -> float:
    """Return the RMS residual of the best of a few simple base forms, as a share of the scale of the force.

    Parameters
    ----------
    tests
        Training tests.
    highest_cutoff_hz
        Upper limit of the cut-off frequencies of the displacement [Hz].
    rate_hz
        Rate at which models are fitted [Hz].
    yield_order, viscosity_order
        Degrees of the laws of the drive.
    known
        Base forms that were fitted to the same tests before; the search of each starts from them.
    """
    recordings = record_tests(tests, rate_hz=rate_hz, highest_cutoff_hz=highest_cutoff_hz)
    return min(_left(recordings, name, yield_order, viscosity_order, known) for name in FORMS)


def best_filter(
    tests: Sequence[PreparedTest],
    automatic: Recordings,
    judging: Judging,
    *,
    rules: NuisanceRules | None = None,
    jobs: int = 1,
) -> MotionFilter:
    """Return the filter of the displacement that is used before a model is chosen.

    Removal of the noise that all tests share is preferred, unless the error with a low-pass is much smaller. This
    happens if all tests have the same random motion, which then looks like noise.

    Parameters
    ----------
    tests
        Training tests.
    automatic
        The same tests, with cut-off frequencies chosen from their spectra.
    judging
        Function that returns the error of simple base forms on filtered tests.
    rules
        Decision thresholds; their defaults if None.
    jobs
        Threads; the result does not depend on their number.
    """
    rules = rules or NuisanceRules()
    few = [tests[place] for place in draft_tests(automatic)]
    low_passes = [MotionFilter(limit) for limit in [np.inf, *_limits(automatic, RATIO)]]
    removals = _removals(tests)
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        ways = [*low_passes, *removals]
        errors = dict(zip(ways, pool.map(lambda way: judging(way.applied(few), way.limit_hz), ways), strict=True))
    best = low_passes[0]
    lower = min(low_passes, key=errors.__getitem__)
    if errors[lower] < (1.0 - rules.filter_gain) * errors[best]:
        best = lower
    for removal in removals:
        if errors[removal] <= (1.0 + rules.filter_doubt) * errors[best]:
            return removal
    return best


def better_filter(
    found: Fit,
    tests: Sequence[PreparedTest],
    automatic: Recordings,
    present: MotionFilter,
    *,
    rate_hz: float,
    rules: NuisanceRules | None = None,
    jobs: int = 1,
) -> MotionFilter:
    """Return the filter with which the error of a chosen model is clearly smaller, else the present one.

    Parameters
    ----------
    found
        Chosen model, fitted to the training tests.
    tests, automatic
        Training tests, and the same tests with cut-off frequencies chosen from their spectra.
    present
        Present filter.
    rate_hz
        Rate at which models are fitted [Hz].
    rules
        Decision thresholds; their defaults if None.
    jobs
        Threads; the result does not depend on their number.
    """
    rules = rules or NuisanceRules()
    limits = sorted({np.inf, *_limits(automatic, FINE_RATIO)}, reverse=True)
    others = [MotionFilter(limit) for limit in limits] + ([] if present.noise is not None else _removals(tests))
    ways = [present, *(way for way in others if way.kind != present.kind)]
    errors = _errors(found, tests, ways, rate_hz, jobs)
    best = min(ways, key=errors.__getitem__)
    return best if errors[best] < (1.0 - rules.filter_again) * errors[present] else present


def loosest_limit(
    found: Fit,
    tests: Sequence[PreparedTest],
    automatic: Recordings,
    highest: float,
    *,
    rate_hz: float,
    rules: NuisanceRules | None = None,
    jobs: int = 1,
) -> float:
    """Return the highest limit [Hz] with which the error of a chosen model does not exceed that with the present one.

    Validation tests may contain faster motion than the training tests. A limit that does not matter in the training
    tests could remove a part of that motion.

    Parameters
    ----------
    found, tests, automatic, highest, rate_hz, rules, jobs
        See :func:`better_filter`; the present limit [Hz] is `highest`.
    """
    if not np.isfinite(highest):
        return highest
    rules = rules or NuisanceRules()
    above = {limit for limit in _limits(automatic, FINE_RATIO) if limit > highest}
    ways = [MotionFilter(limit) for limit in sorted({highest, np.inf, *above})]
    errors = _errors(found, tests, ways, rate_hz, jobs)
    most = (1.0 + rules.filter_again) * errors[ways[0]]
    return max(way.limit_hz for way, error in errors.items() if error <= most)


def _errors(
    found: Fit, tests: Sequence[PreparedTest], ways: Sequence[MotionFilter], rate_hz: float, jobs: int
) -> dict[MotionFilter, float]:
    """Return filter -> RMS residual of a chosen model, as a share of the scale of the force."""

    def left(way: MotionFilter) -> float:
        recordings = record_tests(way.applied(tests), rate_hz=rate_hz, highest_cutoff_hz=way.limit_hz)
        weight = recordings.used / found.problem.scales.force
        problem = replace(found.problem, recordings=recordings, root_weight=weight)
        return float(np.sqrt(fit(problem, found.theta, iterations=FINE_ITERATIONS).chi_square))

    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return dict(zip(ways, pool.map(left, ways), strict=True))


def _removals(tests: Sequence[PreparedTest]) -> list[MotionFilter]:
    """Return the filter that removes the noise which all tests share, if the tests show such noise.

    Where the noise of the motion is known from its sensors, nothing is estimated from the spectra. A motion of laser
    and accelerometers together has its noise in the band of the motion, and closed-loop tests all move in this band:
    the estimate would contain the motion itself.
    """
    if any(test.displacement_noise_band_hz > 0.0 for test in tests):
        return []
    noise = shared_noise(tests)
    return [] if noise is None else [MotionFilter(np.inf, noise)]


def _limits(recordings: Recordings, ratio: float) -> list[float]:
    """Return the limits that are tried [Hz], the highest first."""
    lowest, limit = _lowest(recordings), float(np.max(recordings.cutoff_hz)) / ratio
    limits = []
    while limit > lowest:
        limits.append(limit)
        limit /= ratio
    return limits


def _lowest(recordings: Recordings) -> float:
    """Return the lowest limit that is tried [Hz]: a few times the frequency of the fastest motion."""
    return HARMONICS / float(np.min(recordings.motion_period_s))


def _left(recordings: Recordings, name: str, yield_order: int, viscosity_order: int, known: Known | None) -> float:
    """Return the RMS residual of a base form, as a share of the scale of the force."""
    form = base_form(name)
    laws = polynomial_laws(form, distinct_levels(recordings), yield_order, viscosity_order)
    problem = first_problem(recordings, base_of(recordings, form, laws))
    found = best_fit(problem, starts=1, iterations=ITERATIONS, known=known)
    return float(np.sqrt(found.chi_square))
