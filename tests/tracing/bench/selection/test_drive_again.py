"""Laws of the drive are chosen again with the chosen model."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mrpipe.dampers.laws import LawShape
from mrpipe.fitting.engine import fit, start_of
from mrpipe.tracing.bench.selection.drive_again import with_final_laws, with_laws_again, with_laws_of_leaders
from mrpipe.tracing.bench.selection.select import Selection
from tests.tracing.bench.fits import plain_fit
from tests.tracing.bench.rivals.test_law_rival import selected

pytestmark = pytest.mark.planted


def test_laws_that_were_too_simple_are_replaced() -> None:
    base = plain_fit("")
    poor = replace(base.problem.base, laws=(LawShape("polynomial", 1), LawShape("polynomial", 0)))
    problem = replace(base.problem, base=poor)
    chosen = fit(problem, start_of(problem, base.base_values, []), iterations=8)
    again = with_laws_again(Selection(base, 1.0, (), chosen), 2, 1)
    assert again.chosen.chi_square < 0.5 * chosen.chi_square
    assert again.chosen.problem.base.laws != poor.laws


def test_the_best_forms_of_the_race_have_laws_of_their_own() -> None:
    """A clean Gamota-Filisko damper was called migration, because it had the laws that suffice for a Bouc-Wen model."""
    base = plain_fit("")
    poor = replace(base.problem.base, laws=(LawShape("polynomial", 1), LawShape("polynomial", 0)))
    problem = replace(base.problem, base=poor)
    single = fit(problem, start_of(problem, base.base_values, []), iterations=8)
    theta = single.theta.copy()
    theta[0] = problem.bounds()[1][0]
    hopeless = fit(problem, theta, iterations=0)
    assert hopeless.chi_square > 5.0 * single.chi_square
    singles = {"good": single, "hopeless": hopeless}
    found = with_laws_of_leaders(singles, 2, 1, enough=0.0, least=0.0)
    assert found["good"].chi_square < 0.5 * single.chi_square
    assert found["hopeless"] is hopeless
    # a form at the noise needs nothing more, and a small decrease is no reason for more coefficients
    assert with_laws_of_leaders(singles, 2, 1, enough=single.chi_square, least=0.0) == singles
    assert with_laws_of_leaders(singles, 2, 1, enough=0.0, least=single.chi_square) == singles


def test_laws_that_suffice_are_kept() -> None:
    base = plain_fit("")
    selection = Selection(base, 1.0, (), base)
    assert with_laws_again(selection, 2, 1) is selection


def test_the_final_laws_may_saturate_where_levels_left_out_are_predicted_better() -> None:
    """While names are searched the laws are low polynomials; the yield force of this damper follows a tanh law."""
    chosen = selected(driver=False).without_effects
    poor = fit(chosen.problem, chosen.theta, iterations=2)
    selection = Selection(poor, 1e-6, (), poor, ground=poor)
    found = with_final_laws(selection, 0.05)
    assert found.chosen.problem.base.laws[0] not in poor.problem.base.laws
    assert found.chosen.chi_square < 0.8 * poor.chi_square
    assert found.without_effects is found.chosen and found.base is poor
    # nothing is left to explain beyond the noise
    calm = replace(selection, noise=poor.chi_square)
    assert with_final_laws(calm, 0.05) is calm


def test_the_final_laws_do_not_saturate_beside_an_effect_that_bends_the_drive() -> None:
    selection = selected(driver=True)
    found = with_final_laws(selection, 0.05)
    assert not any(law.saturates for law in found.chosen.problem.base.laws)
    assert found.chosen.problem.terms == selection.chosen.problem.terms
