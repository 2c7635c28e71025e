"""The baseline: the declared model, its weights, the noise floor, and fits of the base forms that are always listed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.library import forms_named
from mrpipe.effects.contract import Effect
from mrpipe.fitting.drive_laws import adequate_laws
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.known import Known
from mrpipe.fitting.problem import Base, Term
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.reference import own_laws
from mrpipe.fitting.start import base_of, best_fit, distinct_levels, first_problem, polynomial_laws
from mrpipe.tracing.bench.noise.weights import AS_SHOWN, NoiseScale, force_deviation, noise_scale, sensor_deviation
from mrpipe.tracing.rules import NoiseRules

DEFAULT_OF_FAMILY = {"rate-dependent-yield": "yielding-part"}
"""Family of base forms -> form that is used if the settings name the family."""


@dataclass(frozen=True)
class Baseline:
    """The fitted declared model.

    Attributes
    ----------
    fit
        The fit; its problem holds the declared effects.
    noise
        Mean square of the weighted residual that noise alone causes.
    deviation
        Standard deviation of the force that noise explains [N], shape (n,).
    scale
        Factors by which the noise exceeds the white noise of the channels.
    model_error
        Whether the weights follow from the expected error of the model, because it exceeds the noise.
    """

    fit: Fit
    noise: float
    deviation: FloatArray
    scale: NoiseScale
    model_error: bool = False


def form_name(model: str) -> str:
    """Return the name of the base form that the setting `model` refers to."""
    return DEFAULT_OF_FAMILY.get(model, model)


def declared_base(
    recordings: Recordings, name: str, yield_order: int, viscosity_order: int, form_files: Sequence[Path] = ()
) -> Base:
    """Return the declared form with polynomial laws of the drive, of at most the degree that the drive levels allow.

    Parameters
    ----------
    recordings
        Training tests.
    name
        Name of the form, which is in the library or in one of `form_files`.
    yield_order, viscosity_order
        Degrees of the polynomials for the yield force and for the viscosity.
    form_files
        The user's own files that define further base forms.

    Raises
    ------
    UserError
        If no form has this name.
    """
    name = form_name(name)
    form = forms_named([name], form_files)[name]
    return base_of(recordings, form, polynomial_laws(form, distinct_levels(recordings), yield_order, viscosity_order))


def fit_baseline(
    recordings: Recordings,
    base: Base,
    declared: Sequence[Effect] = (),
    *,
    model_error_share: float = 0.0,
    rules: NoiseRules | None = None,
    known: Known | None = None,
) -> Baseline:
    """Fit the declared model, weight the samples by the noise of the force, and fit again.

    Parameters
    ----------
    recordings
        Training tests and repeats.
    base
        Declared form.
    declared
        Effects that belong to the baseline; each is taken in the form that fits best.
    model_error_share
        Expected model error, as a share of the RMS force; on real recordings it exceeds the sensor noise.
    rules
        Thresholds of the noise; their defaults if None.
    known
        Base forms that were fitted to the same tests before; the search starts from them.
    """
    rules = rules or NoiseRules()
    problem = first_problem(recordings, base)
    found = best_fit(problem, known=known)
    found = _weighted(found, recordings, model_error_share, rules)
    laws = adequate_laws(found)
    if laws != found.problem.base.laws:
        problem = replace(found.problem, base=replace(base, laws=laws))
        found = fit(problem, start_of(problem, found.base_values, []), iterations=12)
    for effect in declared:
        found = _with_declared(found, effect)
    if declared:
        found = _weighted(found, recordings, model_error_share, rules)
    scale = noise_scale(found, rules)
    if scale != AS_SHOWN:
        # noise that is visible only in repeated motion is part of the weights, too
        found = _weighted(found, recordings, model_error_share, rules, scale)
        scale = noise_scale(found, rules)
    deviation = force_deviation(found, recordings, model_error_share, scale, rules)
    return Baseline(found, noise_level_of(found, scale, rules), deviation, scale)


def _weighted(
    found: Fit, recordings: Recordings, model_error_share: float, rules: NoiseRules, scale: NoiseScale = AS_SHOWN
) -> Fit:
    deviation = force_deviation(found, recordings, model_error_share, scale, rules)
    problem = replace(found.problem, root_weight=recordings.used / deviation, reference=own_laws(found))
    return fit(problem, found.theta, iterations=12)


def _with_declared(before: Fit, effect: Effect) -> Fit:
    fits = []
    for form in effect.forms:
        problem = replace(before.problem, terms=(*before.problem.terms, Term(effect, form)))
        start = start_of(problem, before.base_values, [*before.term_values, {}])
        start[: len(before.theta)] = before.theta
        fits.append(fit(problem, start, iterations=12))
    return min(fits, key=lambda item: item.cost * (1.0 + 0.01 * len(item.problem.terms[-1].form.parameters)))


def noise_level_of(found: Fit, scale: NoiseScale, rules: NoiseRules | None = None) -> float:
    """Return the mean square of the weighted residual that noise alone causes."""
    root = found.problem.root_weight
    used = root > 0.0
    deviation = sensor_deviation(found, found.problem.recordings, scale, rules)
    return float(np.mean((root[used] * deviation[used]) ** 2))
