"""A second effect is kept only if no other form of the first one, and no richer law of the drive, replaces it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.fitting.engine import fit
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.rivals.needed import without_idle, without_superfluous
from mrpipe.tracing.bench.rivals.other_base_forms import Orders
from mrpipe.tracing.bench.selection.select import Selection
from tests.tracing.bench.fits import fit_with_terms, plain_fit

pytestmark = pytest.mark.planted


def _names(planted: str, *forms: tuple[str, str]) -> tuple[list[tuple[str, str]], int]:
    chosen = fit_with_terms(planted, *forms)
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
    chosen = fit_with_terms("soft-stop", ("accumulator", "curved"), ("end-stop", "linear"))
    selection = Selection(plain_fit("soft-stop"), 1.0, (), chosen, proven=2)
    kept = without_superfluous(selection, 0, lead=1.25, orders=Orders(3, 1), worth_a_try=0.1)
    assert kept.extension is not None
    assert [term.effect.name for term in kept.extension.problem.terms] == ["end-stop", "accumulator"]


def test_an_effect_that_had_only_led_to_a_better_optimum_of_the_base_form_is_not_named() -> None:
    plain = plain_fit("")
    # another search of the same base form that has ended far from the optimum
    poor = fit(plain.problem, plain.theta + 0.7, iterations=0)
    chosen = fit_with_terms("", ("backlash", "lost-motion"))
    assert chosen.chi_square < 0.2 * poor.chi_square
    selection = Selection(plain, 1.0, (), chosen, proven=1, ground=poor)
    found = without_idle(NamedEffects(selection, (None,), declared=0), lead=1.25)
    kept = found.selection
    assert kept.proven == 0
    assert kept.chosen.problem.terms == ()
    assert kept.without_effects.chi_square < 1.25 * chosen.chi_square
    assert found.gains == ()
    assert found.reason == "no effect is named: the base form fits as well without backlash"


def test_an_effect_that_is_there_stays_where_its_base_form_is_fitted_again() -> None:
    chosen = fit_with_terms("accumulator", ("accumulator", "linear"))
    selection = Selection(plain_fit("accumulator"), 1.0, (), chosen, proven=1)
    named = NamedEffects(selection, (None,), declared=0)
    assert without_idle(named, lead=1.25) == named


def test_of_two_effects_only_the_idle_one_is_dropped() -> None:
    chosen = fit_with_terms("accumulator", ("backlash", "lost-motion"), ("accumulator", "linear"))
    selection = Selection(plain_fit("accumulator"), 1.0, (), chosen, proven=2)
    found = without_idle(NamedEffects(selection, (None, None), declared=0), lead=1.25)
    assert [term.effect.name for term in found.selection.chosen.problem.terms] == ["accumulator"]
    assert (found.selection.proven, found.gains, found.reason) == (1, (None,), "")


def test_a_delay_below_the_sampling_interval_is_not_named() -> None:
    # with a lead of 0 no effect is idle, so that only the resolution of the records decides
    chosen = fit_with_terms("", ("delay", "dead-time"))
    short = replace(chosen, theta=np.append(chosen.theta[:-1], 0.2 * chosen.problem.recordings.recorded_dt.max()))
    assert 0.0 < short.term_values[0]["delay"] < short.problem.recordings.recorded_dt.max()
    found = without_idle(
        NamedEffects(Selection(plain_fit(""), 1.0, (), short, proven=1), (None,), declared=0), lead=0.0
    )
    assert found.selection.chosen.problem.terms == ()
    assert "shorter than the sampling interval" in found.reason


def test_a_delay_that_the_records_resolve_is_named() -> None:
    chosen = fit_with_terms("", ("delay", "dead-time"))
    long = replace(chosen, theta=np.append(chosen.theta[:-1], 20.0 * chosen.problem.recordings.recorded_dt.max()))
    named = NamedEffects(Selection(plain_fit(""), 1.0, (), long, proven=1), (None,), declared=0)
    assert without_idle(named, lead=0.0) == named
