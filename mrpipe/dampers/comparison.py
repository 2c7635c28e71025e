"""Several forms fitted to the same tests and judged on tests that no fit has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.dampers.fit import FormFit, Projection, fit_form
from mrpipe.dampers.form import Form, Scales
from mrpipe.dampers.samples import FitData, fit_data
from mrpipe.dampers.scoring import PooledScore, TestScore, pool, score_tests
from mrpipe.signals.prepared import PreparedTest


@dataclass(frozen=True)
class FitOptions:
    """How forms are fitted, see :func:`mrpipe.dampers.fit.fit_form` and :func:`mrpipe.dampers.samples.fit_data`."""

    method: str = "least-squares"
    starts: int = 2
    cycles: int = 2
    maximum_samples: int = 30_000
    raw_force: bool = False
    offsets: bool = True
    equal_tests: bool = False


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
        Pooled figures; not a number where there are no tests of the role.
    cross_validated_nrmse, fold_nrmse
        NRMSE over training tests left out in turn, and that of each fold; None and empty where not asked for.
    """

    fit: FormFit
    tests: tuple[TestScore, ...]
    training: PooledScore
    validation: PooledScore
    cross_validated_nrmse: float | None = None
    fold_nrmse: tuple[float, ...] = ()


def best_by_folds(judged: Sequence[JudgedFit]) -> JudgedFit:
    """Return the form with the fewest parameters among those within one standard error of the best.

    The errors of two forms on the same fold go up and down together, so the standard error is that of their difference.

    Raises
    ------
    ValueError
        If a form was not cross-validated.
    """
    if any(item.cross_validated_nrmse is None for item in judged):
        raise ValueError("every form must be cross-validated")
    best = min(judged, key=lambda item: item.cross_validated_nrmse or 0.0)
    close = []
    for item in judged:
        difference = np.subtract(item.fold_nrmse, best.fold_nrmse)
        error = np.std(difference, ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else 0.0
        if np.mean(difference) <= error:
            close.append(item)
    return min(close or [best], key=lambda item: (len(item.fit.names), item.cross_validated_nrmse or 0.0))


def compare_forms(
    forms: Sequence[Form],
    tests: Sequence[PreparedTest],
    scales: Scales,
    options: FitOptions,
    *,
    folds: int = 0,
    progress: Progress = no_progress,
) -> list[JudgedFit]:
    """Fit every form to the training tests and score it on all; `folds` above 1 adds cross-validation."""
    training = [test for test in tests if test.role == "training"]
    data = fit_data(
        training,
        cycles=options.cycles,
        maximum_samples=options.maximum_samples,
        raw_force=options.raw_force,
    )
    judged = []
    for place, form in enumerate(forms):
        progress(place / len(forms), f"fit {form.name}")
        fit = _fit(form, data, scales, options)
        item = judge(fit, tests, raw_force=options.raw_force)
        if folds > 1:
            pooled, each = cross_validate(fit, data, options, folds)
            item = replace(item, cross_validated_nrmse=pooled, fold_nrmse=each)
        judged.append(item)
    progress(1.0, "fitted")
    return judged


def judge(fit: FormFit, tests: Sequence[PreparedTest], *, raw_force: bool = False) -> JudgedFit:
    """Score a fit on all tests."""
    scores = score_tests(fit.model, tests, raw_force=raw_force)
    return JudgedFit(
        fit=fit,
        tests=scores,
        training=pool([score for score in scores if score.role == "training"]),
        validation=pool([score for score in scores if score.role == "validation"]),
    )


def cross_validate(fit: FormFit, data: FitData, options: FitOptions, folds: int) -> tuple[float, tuple[float, ...]]:
    """Return the NRMSE on stretches left out in turn, pooled and of each fold.

    Whole tests are left out where there are enough of them, else parts of them. The model runs over all of the motion
    each time; the forces left out are not compared in the fit.
    """
    group = data.test if data.motion.tests >= 2 * folds else data.block
    _, group = np.unique(group, return_inverse=True)
    squares = []
    for fold in range(folds):
        out = group % folds == fold
        if not out.any() or out.all():
            continue
        again = _fit(fit.form, data.subset(~out), fit.scales, options, warm=fit.values)
        missed = Projection(fit.form, fit.scales, data.subset(out), offsets=False, weights=None)
        columns, target = missed.columns(again.values)
        squares.append((float(np.sum((target - again.linear @ columns) ** 2)), float(np.sum(missed.data.force**2))))
    error, force = np.sum(squares, axis=0)
    return float(np.sqrt(error / force)), tuple(float(np.sqrt(e / f)) for e, f in squares)


def _fit(
    form: Form, data: FitData, scales: Scales, options: FitOptions, warm: dict[str, float] | None = None
) -> FormFit:
    chosen = data if form.motion_limit is None else data.thinned(form.motion_limit)
    weights = None
    if options.equal_tests:
        _, owner = np.unique(chosen.test, return_inverse=True)
        power = np.bincount(owner, weights=chosen.force**2) / np.bincount(owner)
        weights = 1.0 / np.sqrt(power)[owner]
        weights = weights / np.sqrt(np.mean(weights**2))
    return fit_form(
        form,
        chosen,
        scales,
        method=options.method,
        starts=options.starts if form.motion_limit is None else 1,
        offsets=options.offsets,
        weights=weights,
        warm=warm,
    )
