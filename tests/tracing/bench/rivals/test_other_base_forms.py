"""Another base form takes the place of the chosen one where it fits better with the same effects, or with fewer."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mrpipe.dampers.library import base_form
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.base_forms.fits_of_forms import fits_without_effects, on_all_tests, with_effects_of
from mrpipe.tracing.bench.base_forms.race import Race, _compared
from mrpipe.tracing.bench.rivals.needed import without_superfluous
from mrpipe.tracing.bench.rivals.other_base_forms import Orders, Unseen, _before_yielding, rivals_of, with_best_base
from mrpipe.tracing.bench.selection.select import Selection, fit_on_draft_tests
from mrpipe.tracing.rules import RaceRules
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted

PLANTED = "dahl+soft-stop"
ORDERS = Orders(3, 1)


def _with_terms(found: Fit, *forms: tuple[str, str]) -> Fit:
    library = damper_effects()
    terms = tuple(Term(library[effect], library[effect].form(form)) for effect, form in forms)
    starts = []
    for term in terms:
        values = term.form.without_strength(found.problem.scales)
        strengths = {p.name: p.start_values(found.problem.scales)[0] for p in term.form.parameters if p.role != "shape"}
        starts.append({**values, **strengths})
    problem = replace(found.problem, terms=terms)
    return fit(problem, start_of(problem, found.base_values, starts), iterations=20)


@cache
def _raced(*forms: tuple[str, str]) -> tuple[Selection, Race]:
    """Return Bouc-Wen with some effects as what was chosen, and its race with Dahl's law."""
    plain = plain_fit(PLANTED)
    small = fit_on_draft_tests(plain)
    singles = fits_without_effects(small, {"bouc-wen": small.problem.base.form, "dahl": base_form("dahl")})
    models = [*singles.values()]
    for count in range(1, len(forms) + 1):
        models += with_effects_of(_with_terms(small, *forms[:count]), list(singles.values()))
    race = _compared(models, plain, {}, 1.0, frozenset(), RaceRules(), 1)
    return Selection(plain, 1.0, (), on_all_tests(models[-2], plain.problem), proven=len(forms)), race


def _unseen() -> Unseen:
    return Unseen(3, 100, np.random.default_rng(1))


def _again(
    selection: Selection, race: Race | None, *, model_error: bool = False, unseen: Unseen | None = None
) -> Selection:
    """Return the selection after the comparison with the other base forms."""
    compared = unseen or _unseen()
    return with_best_base(
        selection, 0, ORDERS, race, model_error=model_error, worth_a_try=0.2, lead=0.1, unseen=compared
    )


def _names(selection: Selection) -> tuple[str, list[str]]:
    problem = selection.chosen.problem
    return problem.base.name, [term.effect.name for term in problem.terms]


def test_the_form_that_fits_best_with_the_same_effects_is_taken() -> None:
    selection, race = _raced(("end-stop", "linear"))
    assert _names(selection) == ("bouc-wen", ["end-stop"])
    found = _again(selection, race)
    assert _names(found) == ("dahl", ["end-stop"])
    assert found.chosen.chi_square < 0.5 * selection.chosen.chi_square
    assert found.ground is not None
    assert found.ground.problem.base.name == "dahl"


def test_a_form_that_the_race_did_not_combine_with_the_effect_is_tried_with_its_best_form() -> None:
    selection, race = _raced(("end-stop", "linear"))
    alone_only = replace(race, models=tuple(item for item in race.models if item.form != "dahl" or not item.effects))
    assert rivals_of(selection, alone_only) == []
    found = _again(selection, alone_only)
    assert _names(found) == ("dahl", ["end-stop"])
    assert found.chosen.chi_square < 0.5 * selection.chosen.chi_square


def test_forms_that_act_before_the_damper_yields_are_tried_for_effects_whose_simple_forms_change_the_force() -> None:
    small = fit_on_draft_tests(plain_fit(PLANTED))
    pair = _with_terms(small, ("migration", "slip"), ("backlash", "held"))

    def forms(places: list[int], declared: int = 0) -> list[list[str]]:
        return [[term.form.name for term in item.problem.terms] for item in _before_yielding(pair, places, declared)]

    assert forms([0]) == [["slip"], ["yield-force"], ["yield-force-time"]]
    # the play of the simple form changes the motion of the damper already
    assert forms([1]) == [["held"]]
    assert forms([0, 1]) == [["slip", "held"], ["yield-force", "held"], ["yield-force-time", "held"]]
    assert forms([0, 1], declared=1) == [["slip", "held"]]


class _Worse(Unseen):
    """Tests that were left out and that the other base form predicts worse."""

    def better(self, before: Fit, after: Fit, jobs: int) -> bool:
        assert after.chi_square < before.chi_square
        return False


def test_a_form_that_fits_better_but_predicts_unseen_tests_worse_is_not_taken() -> None:
    selection, race = _raced(("end-stop", "linear"))
    found = _again(selection, race, unseen=_Worse(3, 100, np.random.default_rng(1)))
    assert found is selection


def test_a_second_effect_that_corrects_the_base_form_is_dropped() -> None:
    selection, race = _raced(("end-stop", "linear"), ("migration", "slip"))
    assert _names(selection) == ("bouc-wen", ["end-stop", "migration"])
    found = without_superfluous(selection, 0, lead=1.25, orders=ORDERS, worth_a_try=0.2, race=race)
    assert _names(found) == ("dahl", ["end-stop"])
    assert found.proven == 1


def test_nothing_is_compared_where_the_chosen_fit_leaves_no_more_than_noise() -> None:
    selection, race = _raced(("end-stop", "linear"))
    quiet = selection.with_floor(selection.chosen.chi_square)
    assert _again(quiet, race) is quiet


def test_other_base_forms_are_compared_where_the_error_of_a_model_takes_the_place_of_the_noise() -> None:
    selection, race = _raced(("end-stop", "linear"))
    # the error of the best model without effects hides the error of a wrong base form
    hidden = selection.with_floor(selection.chosen.chi_square)
    assert _names(_again(hidden, race, model_error=True)) == ("dahl", ["end-stop"])


def test_a_rival_has_another_form_and_no_effect_that_is_not_named() -> None:
    selection, race = _raced(("end-stop", "linear"))
    rivals = rivals_of(selection, race)
    assert [(item.form, item.effects) for item in rivals] == [("dahl", ("end-stop",))]
    assert rivals_of(selection, None) == []
    assert np.isfinite(race.costs()).all()
