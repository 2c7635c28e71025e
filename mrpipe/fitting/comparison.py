"""Several base forms fitted to the same tests, and judged on tests that were not used in the fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from joblib import Parallel, delayed

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.laws import LawShape
from mrpipe.dampers.model import DamperModel
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.drive_laws import LawChoice, choose_laws
from mrpipe.fitting.engine import Fit, fit
from mrpipe.fitting.form_fit import FitMethod, FormFit, fit_form, form_problem, nrmse_of
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.samples import bench_recordings, blocks_of, thinned
from mrpipe.fitting.scoring import PooledScore, TestScore, pool, score_tests
from mrpipe.fitting.settings import DamperFitSettings
from mrpipe.fitting.solution import regressors
from mrpipe.fitting.start import base_of, best_fit, distinct_levels, first_problem, polynomial_laws
from mrpipe.signals.prepared import PreparedTest
from mrpipe.words import in_percent

T = TypeVar("T")

WORTHWHILE = 0.01
"""A parameter at its bound is kept there only if this lowers the error by at least this share."""

DRAFT_SAMPLES = 12_000
"""Number of samples on which forms are ranked. Only the best of them are then fitted to all samples."""

MOST_FITTED = 5
"""Number of forms near the best that are fitted to all samples, in addition to the requested ones."""

COUPLED_SAMPLES = 20_000
"""Number of samples of the motion for coupled forms, whose fit searches the laws of the drive as well."""

CONTENDER = 1.3
"""Forms whose error on the draft exceeds the least one by this factor are not fitted to all samples."""


_SETTINGS = DamperFitSettings()
"""Source of the defaults, so that options and settings have the same ones."""


@dataclass(frozen=True)
class FitOptions:
    """Options of the fits of base forms.

    Attributes
    ----------
    method
        Method by which a form is searched.
    cycles, maximum_samples, raw_force
        See :func:`mrpipe.fitting.samples.bench_recordings`.
    offsets
        Whether each test has its own force offset; otherwise all tests share one.
    equal_tests
        Whether each test is weighted by its own RMS force.
    drive_law
        `cross-validated`: the laws of the drive are chosen by leaving out whole levels of drive. `polynomial`:
        polynomials of the two degrees below.
    yield_order, viscosity_order
        Largest degrees of polynomials in the drive.
    """

    method: FitMethod = field(default_factory=FitMethod)
    cycles: int = _SETTINGS.cycles
    maximum_samples: int = _SETTINGS.maximum_samples
    raw_force: bool = False
    offsets: bool = _SETTINGS.offset_per_test
    equal_tests: bool = _SETTINGS.equal_tests
    drive_law: str = _SETTINGS.drive_law
    yield_order: int = _SETTINGS.yield_order
    viscosity_order: int = _SETTINGS.viscosity_order


@dataclass(frozen=True)
class JudgedFit:
    """A fitted form with its errors.

    Attributes
    ----------
    fit
        The form and its numbers.
    tests
        Score of every test, in the order given.
    training, validation
        Scores pooled over the tests of the role; NaN if there are none.
    cross_validated_nrmse, left_out_nrmse
        NRMSE on training tests that were left out in turn: pooled, and for each test (for each part of a test where
        there are few tests). None and empty if not requested.
    """

    fit: FormFit
    tests: tuple[TestScore, ...]
    training: PooledScore
    validation: PooledScore
    cross_validated_nrmse: float | None = None
    left_out_nrmse: tuple[float, ...] = ()

    @property
    def typical_left_out_nrmse(self) -> float:
        """Geometric mean of the NRMSE of tests left out: tests with large and small forces have equal weight."""
        return float(np.exp(np.mean(np.log(self.left_out_nrmse)))) if self.left_out_nrmse else float("nan")

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Searched parameters that ended at a bound or whose standard error exceeds half of their value."""
        fit = self.fit
        vague = [
            name
            for name, value in fit.values.items()
            if np.isfinite(fit.standard_error(name)) and fit.standard_error(name) > 0.5 * abs(value)
        ]
        return tuple(dict.fromkeys([*fit.at_bound, *vague]))


@dataclass(frozen=True)
class Comparison:
    """Result of a comparison of base forms.

    Attributes
    ----------
    judged
        The forms that were fitted to all samples, in the order given.
    drafts
        NRMSE of every form on the draft, that is, on a share of the samples.
    laws
        The choice of the laws of the drive; None if it was not requested.
    ranked
        The damper model of every form, fitted to the draft.
    """

    judged: tuple[JudgedFit, ...]
    drafts: Mapping[str, float]
    laws: LawChoice | None
    ranked: Mapping[str, DamperModel] = field(default_factory=dict)


def best_by_folds(judged: Sequence[JudgedFit]) -> JudgedFit:
    """Return the simplest form among those within one standard error of the best on tests left out.

    Every test has equal weight, by the logarithm of its NRMSE. A pooled error would be decided by the tests with the
    largest forces, but a damper model that is wrong by 20 % at zero drive is useless for control. The errors of two
    forms on the same test are correlated, so the standard error is that of their difference, test by test. The simplest
    form has the fewest parameters; among equals, the fewest nonlinear ones.

    Raises
    ------
    ValueError
        If a form was not cross-validated.
    """
    if any(not item.left_out_nrmse for item in judged):
        raise ValueError("every form must be cross-validated")
    best = min(judged, key=lambda item: item.typical_left_out_nrmse)
    close = []
    for item in judged:
        difference = np.log(item.left_out_nrmse) - np.log(best.left_out_nrmse)
        error = np.std(difference, ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else 0.0
        if np.mean(difference) <= error:
            close.append(item)
    return min(close, key=lambda item: (len(item.fit.names), len(item.fit.values), item.typical_left_out_nrmse))


def reason_of_choice(chosen: JudgedFit, judged: Sequence[JudgedFit]) -> str:
    """Return in a sentence why a form was chosen."""
    name = chosen.fit.form.name
    if not chosen.left_out_nrmse:
        return f"{name} is the form that identify_damper.form names."
    best = min(judged, key=lambda item: item.typical_left_out_nrmse)
    error = in_percent(chosen.typical_left_out_nrmse, 1)
    if best is chosen:
        return f"{name} is taken because it has the smallest error on tests left out ({error})."
    return (
        f"{name} is taken because it has the fewest parameters ({len(chosen.fit.names)}) of the forms whose error on "
        f"tests left out ({error}) lies within one standard error of the best ({best.fit.form.name}, "
        f"{in_percent(best.typical_left_out_nrmse, 1)})."
    )


def compare_forms(
    forms: Sequence[BaseForm],
    tests: Sequence[PreparedTest],
    options: FitOptions,
    *,
    folds: int = 0,
    keep: Sequence[str] = (),
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Comparison:
    """Rank all forms on a share of the training samples, fit the best ones to all samples, and score them on all tests.

    Parameters
    ----------
    forms
        Forms that are compared.
    tests
        Prepared tests.
    options
        Options of the fits.
    folds
        Number of parts of the cross-validation of the fitted forms; 0 or 1: no cross-validation.
    keep
        Names of forms that are fitted to all samples, whatever their rank.
    jobs
        Threads; the result does not depend on their number.
    progress
        Called with the share done and a text.
    """
    training = [test for test in tests if test.role == "training"]
    unit = training[0].drive_unit or "A"
    recordings = bench_recordings(
        training, cycles=options.cycles, maximum_samples=options.maximum_samples, raw_force=options.raw_force
    )
    laws, choice = _laws(forms[0], recordings, options)
    ranked = _drafts(forms, recordings, laws, options, jobs, progress)
    drafts = {name: nrmse_of(found) for name, found in ranked.items()} or {forms[0].name: 0.0}
    least = min(drafts.values())
    near = sorted(
        (form.name for form in forms if drafts[form.name] <= CONTENDER * least), key=lambda name: drafts[name]
    )
    chosen = [form for form in forms if form.name in (*near[:MOST_FITTED], *keep)]

    def fitted(form: BaseForm) -> JudgedFit:
        seen = thinned(recordings, COUPLED_SAMPLES) if form.coupled else recordings
        weights = _equal_weights(seen) if options.equal_tests else None
        problem = form_problem(seen, base_of(seen, form, laws), offsets=options.offsets, weights=weights)
        warm = ranked[form.name].base_values if len(forms) > len(keep) + 1 else None
        found = _settled_shape(fit_form(problem, options.method, drive_unit=unit, warm=warm), options, unit)
        item = judge(found, tests, raw_force=options.raw_force)
        if folds > 1:
            pooled, each = cross_validate(found, folds)
            item = replace(item, cross_validated_nrmse=pooled, left_out_nrmse=each)
        return item

    judged = _each(fitted, chosen, jobs, lambda done, text: progress(0.4 + 0.6 * done, f"fit {text}"))
    progress(1.0, "fitted")
    dampers = {
        name: damper_model(found, unit, assumed_eta=options.method.assumed_eta) for name, found in ranked.items()
    }
    return Comparison(tuple(judged), drafts, choice, dampers)


def _laws(form: BaseForm, recordings: Recordings, options: FitOptions) -> tuple[tuple[LawShape, ...], LawChoice | None]:
    plain = polynomial_laws(form, distinct_levels(recordings), options.yield_order, options.viscosity_order)
    if options.drive_law == "polynomial" or distinct_levels(recordings) == 1:
        return plain, None
    small = thinned(recordings, 2 * DRAFT_SAMPLES)
    found = best_fit(replace(first_problem(small, base_of(small, form, plain)), offsets=options.offsets))
    choice = choose_laws(found)
    return choice.laws, choice


def _drafts(
    forms: Sequence[BaseForm],
    recordings: Recordings,
    laws: Sequence[LawShape],
    options: FitOptions,
    jobs: int,
    progress: Progress,
) -> dict[str, Fit]:
    """Return every form fitted to a share of the samples; empty if there is only one form."""
    if len(forms) == 1:
        return {}
    small = thinned(recordings, DRAFT_SAMPLES)

    def draft(form: BaseForm) -> Fit:
        problem = form_problem(small, base_of(small, form, laws), offsets=options.offsets)
        # one start is enough for the ranking: the best forms are searched further on all samples
        return best_fit(problem, starts=1)

    found = _each(draft, forms, jobs, lambda done, text: progress(0.4 * done, f"rank {text}"))
    return {form.name: item for form, item in zip(forms, found, strict=True)}


def _each(
    work: Callable[[BaseForm], T], forms: Sequence[BaseForm], jobs: int, progress: Callable[[float, str], None]
) -> list[T]:
    """Return the result of `work` for every form, in order; the compiled steps run in parallel threads."""
    runner = Parallel(n_jobs=max(1, min(jobs, len(forms))), backend="threading", return_as="generator")
    results: list[T] = []
    for form, result in zip(forms, runner(delayed(work)(form) for form in forms), strict=True):
        results.append(result)
        progress(len(results) / len(forms), form.name)
    return results


def judge(fit: FormFit, tests: Sequence[PreparedTest], *, raw_force: bool = False) -> JudgedFit:
    """Score a fit on all tests."""
    scores = score_tests(fit.model, tests, raw_force=raw_force)
    return JudgedFit(
        fit=fit,
        tests=scores,
        training=pool([score for score in scores if score.role == "training"]),
        validation=pool([score for score in scores if score.role == "validation"]),
    )


def cross_validate(found: FormFit, folds: int) -> tuple[float, tuple[float, ...]]:
    """Return the NRMSE on the tests left out in turn: pooled, and for each test or part of a test.

    Whole tests are left out if there are enough of them, otherwise parts of tests. The model always runs over the whole
    motion; the forces left out are not compared in the fit.
    """
    problem = found.fit.problem
    recordings = problem.recordings
    _, group = np.unique(
        recordings.test if recordings.tests >= 2 * folds else blocks_of(recordings), return_inverse=True
    )
    error, force = np.zeros(group.max() + 1), np.zeros(group.max() + 1)
    used = problem.root_weight > 0.0
    for fold in range(folds):
        out = used & (group % folds == fold)
        rest = replace(problem, root_weight=np.where(out, 0.0, problem.root_weight))
        if not out.any() or not np.any(rest.root_weight):
            continue
        again = fit(rest, found.fit.theta, iterations=6, tolerance=1e-4)
        calculated = again.linear @ regressors(again.problem, again.theta)
        missed = recordings.force - calculated
        # a test that was left out as a whole has the mean offset of the other tests
        offsets = _offsets(again.problem, again.test_offsets)
        missed = missed - offsets[recordings.test]
        error += np.bincount(group[out], weights=missed[out] ** 2, minlength=len(error))
        force += np.bincount(group[out], weights=recordings.force[out] ** 2, minlength=len(force))
    seen = force > 0.0
    errors = np.sqrt(np.maximum(error[seen], 1e-300) / force[seen])
    return float(np.sqrt(error.sum() / force.sum())), tuple(float(value) for value in errors)


def _offsets(problem: Problem, offsets: FloatArray) -> FloatArray:
    compared = np.bincount(problem.recordings.test, weights=problem.root_weight, minlength=len(offsets)) > 0.0
    return np.where(compared, offsets, float(np.median(offsets[compared])))


def _settled_shape(found: FormFit, options: FitOptions, unit: str) -> FormFit:
    """Return the fit with gamma = beta where the data do not determine their ratio.

    On many measured loops the share gamma / (gamma + beta) ends at its bound and hardly improves the fit. It is then
    set to 0.5 (gamma = beta, as in Table 2.2 of the thesis), unless this raises the error by more than
    :data:`WORTHWHILE`.
    """
    if "gamma_share" not in found.at_bound:
        return found
    problem = found.fit.problem
    base = replace(problem.base, held={**problem.base.held, "gamma_share": 0.5})
    plain = fit_form(replace(problem, base=base), options.method, drive_unit=unit, warm=found.fit.base_values)
    gain = 1.0 - found.training_nrmse / plain.training_nrmse
    if gain > WORTHWHILE:
        value = found.values["gamma_share"]
        note = (
            f"gamma_share ended at its bound {value:.3g} and is kept there, because gamma = beta (0.5) would raise the "
            f"error by {in_percent(gain)}"
        )
        return replace(found, notes=(note,))
    note = (
        f"gamma_share ended at its bound, which changes the error by only {in_percent(abs(gain), 1)}: gamma = beta is "
        "taken (0.5)"
    )
    return replace(plain, notes=(note,))


def _equal_weights(recordings: Recordings) -> FloatArray:
    used = recordings.used
    total = np.bincount(recordings.test[used], weights=recordings.force[used] ** 2, minlength=recordings.tests)
    power = total / np.maximum(np.bincount(recordings.test[used], minlength=recordings.tests), 1)
    weights = 1.0 / np.sqrt(np.maximum(power, 1e-12 * power.max()))[recordings.test]
    return np.asarray(weights / np.sqrt(np.mean(weights[used] ** 2)), dtype=np.float64)
