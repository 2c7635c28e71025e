"""A second effect is kept only if no other form of the first one, and no richer law of the drive, replaces it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.rivals.needed import without_idle, without_names, without_superfluous
from mrpipe.tracing.bench.rivals.other_base_forms import Orders
from mrpipe.tracing.bench.selection.select import Selection
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def _with_terms(planted: str, *forms: tuple[str, str]) -> Fit:
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


def _names(planted: str, *forms: tuple[str, str]) -> tuple[list[tuple[str, str]], int]:
    chosen = _with_terms(planted, *forms)
    selection = Selection(plain_fit(planted), 1.0, (), chosen, proven=len(forms))
    kept = without_superfluous(selection, 0, lead=1.25, orders=Orders(3, 1), worth_a_try=0.1)
    return [(term.effect.name, term.form.name) for term in kept.chosen.problem.terms], kept.proven


def test_a_second_name_that_corrects_the_form_of_the_first_is_dropped() -> None:
    names, proven = _names("soft-stop", ("end-stop", "linear"), ("accumulator", "curved"))
    assert names == [("end-stop", "contact")]
    assert proven == 1


def test_both_of_a_pair_are_kept() -> None:
    names, proven = _names("soft-stop+accumulator", ("end-stop", "linear"), ("accumulator", "linear"))
    assert [effect for effect, _ in names] == ["end-stop", "accumulator"]
    assert proven == 2


def test_one_effect_is_never_dropped() -> None:
    names, proven = _names("accumulator", ("accumulator", "linear"))
    assert names == [("accumulator", "linear")]
    assert proven == 1


def test_what_is_dropped_is_offered_as_a_further_term() -> None:
    chosen = _with_terms("soft-stop", ("accumulator", "curved"), ("end-stop", "linear"))
    selection = Selection(plain_fit("soft-stop"), 1.0, (), chosen, proven=2)
    kept = without_superfluous(selection, 0, lead=1.25, orders=Orders(3, 1), worth_a_try=0.1)
    assert kept.extension is not None
    assert [term.effect.name for term in kept.extension.problem.terms] == ["end-stop", "accumulator"]


def test_an_effect_that_had_only_led_to_a_better_optimum_of_the_base_form_is_not_named() -> None:
    plain = plain_fit("")
    # another search of the same base form that has ended far from the optimum
    poor = fit(plain.problem, plain.theta + 0.7, iterations=0)
    chosen = _with_terms("", ("backlash", "lost-motion"))
    assert chosen.chi_square < 0.2 * poor.chi_square
    selection = Selection(plain, 1.0, (), chosen, proven=1, ground=poor)
    kept, gains, reason = without_idle(selection, [None], 0, lead=1.25)
    assert kept.proven == 0
    assert kept.chosen.problem.terms == ()
    assert kept.without_effects.chi_square < 1.25 * chosen.chi_square
    assert gains == []
    assert reason == "no effect is named: the base form fits as well without backlash"


def test_an_effect_that_is_there_stays_where_its_base_form_is_fitted_again() -> None:
    chosen = _with_terms("accumulator", ("accumulator", "linear"))
    selection = Selection(plain_fit("accumulator"), 1.0, (), chosen, proven=1)
    assert without_idle(selection, [None], 0, lead=1.25) == (selection, [None], "")


def test_of_two_effects_only_the_idle_one_is_dropped() -> None:
    chosen = _with_terms("accumulator", ("backlash", "lost-motion"), ("accumulator", "linear"))
    selection = Selection(plain_fit("accumulator"), 1.0, (), chosen, proven=2)
    kept, _, reason = without_idle(selection, [None, None], 0, lead=1.25)
    assert [term.effect.name for term in kept.chosen.problem.terms] == ["accumulator"]
    assert (kept.proven, reason) == (1, "")


def test_the_term_that_loses_its_name_stands_behind_the_others() -> None:
    plain = plain_fit("accumulator")
    chosen = _with_terms("accumulator", ("inertia", "mass"), ("accumulator", "linear"))
    kept, gains = without_names(Selection(plain, 1.0, (), chosen, proven=2), [None, None], [0], 0)
    assert [item.effect.name for item in kept.chosen.problem.terms] == ["accumulator", "inertia"]
    assert [item.effect.name for item in kept.with_named_alone.chosen.problem.terms] == ["accumulator"]
    assert (kept.proven, gains) == (1, [None])
    assert kept.chosen.chi_square == pytest.approx(chosen.chi_square, rel=1e-3)
