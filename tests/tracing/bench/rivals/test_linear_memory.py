"""A name is given only if the effect predicts better than a shape that the library does not name."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import signal

from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.rivals.linear_memory import with_linear_memory, without_beaten_names
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.rivals.other_base_forms import Unseen
from mrpipe.tracing.bench.selection.select import Selection
from tests.tracing.bench.fits import fit_of
from tests.tracing.bench.rig import RATE, campaign

pytestmark = pytest.mark.planted


def half_derivative(test: PreparedTest) -> PreparedTest:
    """Return a test with half a derivative of the displacement, times the current, in addition.

    Binomial weights of Gruenwald and Letnikov; the mean square of the addition is that of 15 % of the force.
    """
    x = test.displacement_m
    weights = np.cumprod(np.concatenate([[1.0], 1.0 - 1.5 / np.arange(1, len(x))]))
    extra = test.drive * signal.fftconvolve(x - x[0], weights)[: len(x)] * np.sqrt(RATE)
    force = test.force_raw_n + extra * 45.0 * 0.15 / 0.02
    return replace(test, force_n=force, force_raw_n=force)


@cache
def plain(case: str) -> Fit:
    """Return the fit without effects to tests with half a derivative, or with an effect that the rig knows."""
    tests = [half_derivative(test) for test in campaign("none")] if case == "memory" else campaign(case)
    return fit_of(tests)


def names(case: str, effect: str, form: str) -> tuple[list[str], int, str]:
    base = plain(case)
    term = Term(damper_effects()[effect], damper_effects()[effect].form(form))
    problem = replace(base.problem, terms=(term,))
    start = start_of(problem, base.base_values, [{}])
    chosen = fit(problem, start, iterations=25)
    selection = Selection(base, 0.1 * chosen.chi_square, (), chosen, proven=1)
    unseen = Unseen(3, 100, np.random.default_rng(1))
    found = without_beaten_names(NamedEffects(selection, (None,), declared=0), unseen)
    kept = found.selection
    return [item.effect.name for item in kept.chosen.problem.terms], kept.proven, found.reason


def test_half_a_derivative_is_not_called_migration() -> None:
    effects, proven, reason = names("memory", "migration", "slow-hysteresis")
    # the term stays in the model, because it lowers the error
    assert effects == ["migration"]
    assert proven == 0
    assert "linear memory" in reason


@pytest.mark.parametrize(("effect", "form"), [("accumulator", "linear"), ("end-stop", "linear")])
def test_an_effect_that_is_there_keeps_its_name(effect: str, form: str) -> None:
    _, proven, reason = names(effect, effect, form)
    assert proven == 1
    assert reason == ""


def test_the_memory_explains_half_a_derivative() -> None:
    base = plain("memory")
    assert with_linear_memory(base, 0).chi_square < 0.1 * base.chi_square
