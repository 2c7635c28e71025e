"""The baseline: the declared model with its declared effects, its weights, the noise floor, and the ladder of forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import BaseForm, Problem, Term
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.screen import screen
from mrpipe.tracing.bench.weights import force_deviation, noise_of_repeats, repeated_pairs, sensor_deviation

FREE_EXPONENT = "bouc-wen-free-exponent"
"""Name of the base form whose hysteresis has an exponent of its own."""

DRIVE_VARIES_SHARE = 0.05
LEAST_PAIR_SAMPLES = 400


@dataclass(frozen=True)
class Baseline:
    """The fitted declared model.

    Attributes
    ----------
    fit
        The fit; its problem holds the declared effects.
    noise
        Mean square of the weighted residual that noise alone would leave.
    deviation
        Standard deviation of the force that noise explains [N], shape (n,).
    repeats
        Number of repeated pairs that told the noise.
    model_error
        Whether weights go by what a model cannot follow: the base form itself is in question, the noise is not.
    """

    fit: Fit
    noise: float
    deviation: FloatArray
    repeats: int
    model_error: bool = False


def base_form(recordings: Recordings, name: str, yield_order: int, viscosity_order: int) -> BaseForm:
    """Return the declared form with orders that the levels of drive can tell."""
    drive = recordings.drive
    largest = max(float(np.max(np.abs(drive))), 1e-12)
    pieces = [drive[a:b] for a, b in zip(recordings.starts[:-1], recordings.starts[1:], strict=True)]
    varies = any(float(np.ptp(piece)) > DRIVE_VARIES_SHARE * largest for piece in pieces)
    means = np.sort([float(np.mean(piece)) for piece in pieces])
    levels = 99 if varies else 1 + int(np.sum(np.diff(means) > 0.02 * largest))
    dahl = name == "dahl"
    return BaseForm(
        name="dahl" if dahl else "bouc-wen",
        exponent=1.0 if dahl else 2.0,
        gamma_free=not dahl,
        gamma_share=1.0 if dahl else 0.5,
        yield_order=min(yield_order, levels - 1),
        viscosity_order=min(viscosity_order, levels - 1),
        lag_known=varies,
    )


def first_problem(recordings: Recordings, base: BaseForm) -> Problem:
    """Return the unweighted problem with no effect."""
    scales = recordings.scales()
    reference = np.zeros(4), np.zeros(4)
    reference[0][0] = scales.force
    reference[1][0] = 0.1 * scales.force / max(scales.speed, 1e-9)
    return Problem(recordings, base, (), recordings.used / scales.force, scales, reference)


def best_start(problem: Problem) -> Fit:
    """Fit from several starts of the yield displacement and keep the best."""
    stroke = problem.scales.stroke
    fits = [
        fit(
            problem, start_of(problem, {"yield_displacement": share * stroke}, [{}] * len(problem.terms)), iterations=12
        )
        for share in (0.04, 0.15)
    ]
    return min(fits, key=lambda item: item.cost)


def fit_baseline(
    recordings: Recordings, base: BaseForm, declared: Sequence[Effect] = (), *, model_error_share: float = 0.0
) -> Baseline:
    """Fit the declared model, weigh the samples by what noise makes of its force, and fit again.

    Parameters
    ----------
    recordings
        Training tests and repeats.
    base
        Declared form.
    declared
        Effects that belong to the baseline; each in the form that fits best.
    model_error_share
        Model error to reckon with as a share of the force RMS: on real recordings it outweighs the sensors' noise.
    """
    problem = first_problem(recordings, base)
    found = best_start(problem)
    found = _weighted(found, recordings, model_error_share)
    for effect in declared:
        found = _with_declared(found, effect)
    if declared:
        found = _weighted(found, recordings, model_error_share)
    noise, repeats = noise_level_of(found)
    return Baseline(found, noise, force_deviation(found, recordings, model_error_share), repeats)


def _weighted(found: Fit, recordings: Recordings, model_error_share: float) -> Fit:
    deviation = force_deviation(found, recordings, model_error_share)
    problem = replace(found.problem, root_weight=recordings.used / deviation, reference=positive(found))
    return fit(problem, found.theta, iterations=12)


def positive(found: Fit) -> tuple[FloatArray, FloatArray]:
    """Return the fitted polynomials as reference of effects; a viscosity that is nowhere positive is lifted."""
    forces, viscosity = found.polynomials
    drive = np.linspace(0.0, found.problem.scales.drive, 20)
    if float(np.mean(np.polynomial.polynomial.polyval(drive, viscosity))) <= 0.0:
        viscosity = np.zeros_like(viscosity)
        viscosity[0] = 0.01 * found.problem.scales.force / max(found.problem.scales.speed, 1e-9)
    return _four(forces), _four(viscosity)


def _four(values: FloatArray) -> FloatArray:
    return np.concatenate([values, np.zeros(4 - len(values))])


def _with_declared(before: Fit, effect: Effect) -> Fit:
    fits = []
    for form in effect.forms:
        problem = replace(before.problem, terms=(*before.problem.terms, Term(effect, form)))
        start = start_of(problem, before.base_values, [*before.term_values, {}])
        start[: len(before.theta)] = before.theta
        fits.append(fit(problem, start, iterations=12))
    return min(fits, key=lambda item: item.cost * (1.0 + 0.01 * len(item.problem.terms[-1].form.parameters)))


def with_form(before: Fit, effect: Effect, name: str, *, iterations: int = 12) -> Fit:
    """Return the fit with one more effect in a form of this name, started at the screened point of its grid."""
    term = Term(effect, effect.form(name))
    problem = replace(before.problem, terms=(*before.problem.terms, term))
    start = start_of(problem, before.base_values, [*before.term_values, screen(before, [term])[0].values])
    start[: len(before.theta)] = before.theta
    return fit(problem, start, iterations=iterations)


def noise_level_of(found: Fit) -> tuple[float, int]:
    """Return the mean square of the weighted residual that noise leaves, from repeats or else from the sensors."""
    problem = found.problem
    pairs = repeated_pairs(problem.recordings)
    noise, count = noise_of_repeats(found.residual, problem.recordings, pairs)
    used = problem.root_weight > 0.0
    sensors = float(np.mean((problem.root_weight[used] * sensor_deviation(found, problem.recordings)[used]) ** 2))
    if count >= LEAST_PAIR_SAMPLES:
        return max(noise, 0.25 * sensors), len(pairs)
    return sensors, 0


def with_free_exponent(found: Fit) -> Fit:
    """Return the fit with the exponent of the hysteresis free, from about 2 or from Dahl's law, whichever is nearer.

    The same fit where the exponent is free already.
    """
    base = found.problem.base
    if base.exponent_free:
        return found
    problem = replace(found.problem, base=replace(base, exponent_free=True, gamma_free=True))
    # Dahl's law is the exponent 1 without the part that goes with the sign of the velocity alone
    starts = ({"exponent": 1.9}, {"exponent": 1.1, "gamma_share": 1.0})
    fits = [
        fit(problem, start_of(problem, {**found.base_values, **start}, found.term_values), iterations=8)
        for start in starts
    ]
    return min(fits, key=lambda item: item.cost)


def ladder(found: Fit, rate_forms: Effect | None, rate_fit: Fit | None = None) -> dict[str, Fit]:
    """Return fits of the ladder of base forms: declared, exponent free, Dahl, rate-dependent yield.

    `rate_fit` is the last where the selection has fitted it already.
    """
    problem = found.problem
    base = problem.base
    fits = {base.name: found}
    if base.name == "bouc-wen":
        fits[FREE_EXPONENT] = with_free_exponent(found)
    other = replace(base, name="dahl", exponent=1.0, gamma_free=False, gamma_share=1.0)
    if base.name != "dahl":
        dahl = replace(problem, base=other)
        fits["dahl"] = fit(dahl, start_of(dahl, found.base_values, found.term_values), iterations=8)
    if rate_forms is not None and all(term.effect.name != rate_forms.name for term in problem.terms):
        # forms that screening found no promise in are not all worth a fit
        fits[rate_forms.name] = rate_fit or _with_declared(found, replace(rate_forms, forms=rate_forms.forms[:2]))
    return fits
