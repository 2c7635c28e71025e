"""Several forms fitted to the same tests and judged on tests that no fit has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.dampers.fit import FormFit, Projection, fit_form
from mrpipe.dampers.form import Form, Scales, with_fixed
from mrpipe.dampers.samples import FitData, fit_data
from mrpipe.dampers.scoring import PooledScore, TestScore, pool, score_tests
from mrpipe.signals.prepared import PreparedTest

WORTHWHILE = 0.01
"""Share of the error that a parameter at its bound must gain to be kept there."""


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
    cross_validated_nrmse, left_out_nrmse
        NRMSE over training tests left out in turn, pooled and of each test (of each stretch where there are few
        tests); None and empty where not asked for.
    """

    fit: FormFit
    tests: tuple[TestScore, ...]
    training: PooledScore
    validation: PooledScore
    cross_validated_nrmse: float | None = None
    left_out_nrmse: tuple[float, ...] = ()

    @property
    def typical_left_out_nrmse(self) -> float:
        """Geometric mean of the NRMSE of tests left out: strong and weak tests count alike."""
        return float(np.exp(np.mean(np.log(self.left_out_nrmse)))) if self.left_out_nrmse else float("nan")


def best_by_folds(judged: Sequence[JudgedFit]) -> JudgedFit:
    """Return the simplest form among those within one standard error of the best on tests left out.

    Every test counts alike (logarithm of its NRMSE): pooled, the strongest tests alone would decide, and a damper that
    is wrong by a fifth without drive is none for control. Two forms err on the same tests, so the standard error is
    that of their difference, test by test. Simplest: fewest parameters, and of those the fewest that are not linear.

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
        fit = _settled_shape(_fit(form, data, scales, options), data, options)
        item = judge(fit, tests, raw_force=options.raw_force)
        if folds > 1:
            pooled, each = cross_validate(item.fit, data, options, folds)
            item = replace(item, cross_validated_nrmse=pooled, left_out_nrmse=each)
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
    """Return the NRMSE on what was left out in turn, pooled and of each test or stretch.

    Whole tests are left out where there are enough of them, else parts of them. The model runs over all of the motion
    each time; the forces left out are not compared in the fit.
    """
    _, group = np.unique(data.test if data.motion.tests >= 2 * folds else data.block, return_inverse=True)
    error, force = np.zeros(group.max() + 1), np.zeros(group.max() + 1)
    for fold in range(folds):
        out = group % folds == fold
        if not out.any() or out.all():
            continue
        again = _fit(fit.form, data.subset(~out), fit.scales, options, warm=fit.values)
        missed = Projection(fit.form, fit.scales, data.subset(out), offsets=False, weights=None)
        columns, target = missed.columns(again.values)
        error += np.bincount(group[out], weights=(target - again.linear @ columns) ** 2, minlength=len(error))
        force += np.bincount(group[out], weights=missed.data.force**2, minlength=len(force))
    told = force > 0.0
    each = np.sqrt(np.maximum(error[told], 1e-300) / force[told])
    return float(np.sqrt(error.sum() / force.sum())), tuple(float(value) for value in each)


def _settled_shape(fit: FormFit, data: FitData, options: FitOptions) -> FormFit:
    """Return the fit with gamma = beta where the data do not tell the two apart.

    On many real loops the share of gamma runs to its bound and gains next to nothing there. It is taken as the thesis
    prints it (gamma = beta, share 0.5) unless that costs more than :data:`WORTHWHILE` of the error.
    """
    if "gamma_share" not in fit.at_bound:
        return fit
    plain = _fit(with_fixed(fit.form, {"gamma_share": 0.5}), data, fit.scales, options)
    gain = 1.0 - fit.training_nrmse / plain.training_nrmse
    if gain > WORTHWHILE:
        note = f"gamma_share ended at its bound {fit.values['gamma_share']:.3g}; gamma = beta costs {gain:.0%} in error"
        return replace(fit, notes=(note,))
    note = f"gamma_share ran to its bound for a gain of {gain:.1%}: gamma = beta is taken (0.5)"
    return replace(plain, notes=(note,))


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
