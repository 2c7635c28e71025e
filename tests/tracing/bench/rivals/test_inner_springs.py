"""A spring inside a base form, in addition to the spring across the damper that is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.dampers.library import base_form
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.fitting.start import fit_with_form
from mrpipe.tracing.bench.rivals.inner_springs import with_inner_springs
from mrpipe.tracing.bench.rivals.other_base_forms import Unseen
from mrpipe.tracing.bench.selection.select import Selection
from tests.fitting.spencer import spencer_fit

pytestmark = pytest.mark.planted

INNER, OUTER = 6000.0, 1500.0
LEAST_GAIN = 0.05


def _with_accumulator(found: Fit) -> Fit:
    """Return the modified Bouc-Wen model without its springs, with the effect `accumulator`."""
    plain = fit_with_form(found, base_form("modified-bouc-wen").without_springs(), starts=1, iterations=25)
    effect = damper_effects()["accumulator"]
    problem = replace(plain.problem, terms=(Term(effect, effect.form("linear")),))
    return fit(problem, start_of(problem, plain.base_values, [{}]), iterations=25)


def _selection(inner: float) -> Selection:
    chosen = _with_accumulator(spencer_fit(inner, OUTER))
    return Selection(chosen, 1.0, (), chosen, proven=1)


def _unseen() -> Unseen:
    return Unseen(3, 100, np.random.default_rng(1))


def test_a_spring_inside_the_damper_is_found_in_addition_to_the_spring_across_it() -> None:
    before = _selection(INNER)
    after = with_inner_springs(before, 0.0, LEAST_GAIN, _unseen(), 1).chosen
    assert after.chi_square < 0.3 * before.chosen.chi_square
    assert after.base_values["k0"] == pytest.approx(INNER, rel=0.15)
    assert after.term_values[0]["stiffness"] == pytest.approx(OUTER, rel=0.15)


def test_without_a_spring_inside_or_above_no_limit_the_model_is_kept() -> None:
    plain = _selection(0.0)
    assert with_inner_springs(plain, 0.0, LEAST_GAIN, _unseen(), 1) is plain
    sprung = _selection(INNER)
    assert with_inner_springs(sprung, 1e9, LEAST_GAIN, _unseen(), 1) is sprung
