"""Fits of a plain Bouc-Wen model to the rig of these tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import Recordings, record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.noise.baseline import declared_base, fit_baseline
from tests.tracing.bench.rig import campaign


def recorded(tests: Sequence[PreparedTest], *, validation: bool = False) -> Recordings:
    """Return the training tests with the repeats, or the validation tests."""
    return record_tests([test for test in tests if (test.role == "validation") == validation], rate_hz=250.0)


def fit_of(tests: Sequence[PreparedTest]) -> Fit:
    """Return the weighted fit of the declared model to the training tests and repeats."""
    recordings = recorded(tests)
    return fit_baseline(recordings, declared_base(recordings, "bouc-wen", 2, 1)).fit


@cache
def plain_fit(effect: str) -> Fit:
    """Return the fit to a campaign with this effect, which the model lacks."""
    return fit_of(campaign(effect))


def fit_with_terms(planted: str, *forms: tuple[str, str]) -> Fit:
    """Return the fit of the plain model with these forms of effects (effect, form) to a campaign."""
    plain = plain_fit(planted)
    library = damper_effects()
    terms = tuple(Term(library[effect], library[effect].form(form)) for effect, form in forms)
    starts = []
    for term in terms:
        values = term.form.without_strength(plain.problem.scales)
        for parameter in term.form.parameters:
            if parameter.role == "strength":
                values[parameter.name] = parameter.start_values(plain.problem.scales)[0]
        starts.append(values)
    problem = replace(plain.problem, terms=terms)
    return fit(problem, start_of(problem, plain.base_values, starts), iterations=20)
