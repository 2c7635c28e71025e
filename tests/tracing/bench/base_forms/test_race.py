"""Who wins a race of base forms and effects."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.library import base_form
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import fit, start_of
from mrpipe.fitting.problem import Problem, Term
from mrpipe.fitting.solution import regressors
from mrpipe.tracing.bench.base_forms.fits_of_forms import fits_without_effects, with_effects_of
from mrpipe.tracing.bench.base_forms.race import Model, Race, _compared, _held
from mrpipe.tracing.rules import RaceRules
from tests.tracing.bench.fits import plain_fit

LEAD = 0.3
TESTS = 8


class FakeModel(Model):
    """A model without a fit: base form, effects, number of fitted numbers."""

    def __init__(self, form: str, effects: tuple[str, ...], chi_square: Any, numbers: int = 5) -> None:
        terms = tuple(SimpleNamespace(effect=SimpleNamespace(name=name)) for name in effects)
        problem = SimpleNamespace(
            base=SimpleNamespace(name=form, columns=numbers), terms=terms, searched=(), amplitudes=()
        )
        squares = 100.0 * np.broadcast_to(np.asarray(chi_square, dtype=np.float64), TESTS)
        super().__init__(SimpleNamespace(problem=problem), squares)  # type: ignore[arg-type]


def race_of(*models: Model) -> Race:
    return Race(models, "bouc-wen", (), {}, np.full(TESTS, 100.0), 1.0)


@pytest.mark.property
def test_an_effect_is_named_only_if_every_form_without_it_is_clearly_worse() -> None:
    plain, wrong = FakeModel("bouc-wen", (), 30.0), FakeModel("bouc-wen", ("migration",), 4.0)
    other = FakeModel("dahl", (), 4.2)
    assert race_of(plain, wrong).winner(LEAD) is wrong
    assert race_of(plain, wrong, other).winner(LEAD) is other


@pytest.mark.property
def test_an_effect_that_every_form_needs_is_named() -> None:
    models = [FakeModel(form, (), 20.0) for form in ("bouc-wen", "dahl", "lugre")]
    right = FakeModel("dahl", ("accumulator",), 3.0)
    assert race_of(*models, right).winner(LEAD) is right
    with_more = FakeModel("lugre", ("accumulator", "stribeck"), 2.9)
    assert race_of(*models, right, with_more).winner(LEAD) is right


@pytest.mark.property
def test_a_form_within_the_noise_needs_nothing_more() -> None:
    enough = FakeModel("dahl", (), 1.5)
    assert race_of(enough, FakeModel("dahl", ("channel-skew",), 0.8)).winner(LEAD) is enough


@pytest.mark.property
def test_an_effect_smaller_than_a_large_noise_is_named() -> None:
    # the excess of 0.5 is within 1.25 floors, but at noise of 6 % of the force it is 4 % of the force
    models = [FakeModel(form, (), 1.5) for form in ("bouc-wen", "dahl", "lugre")]
    right = FakeModel("dahl", ("backlash",), 1.0)
    quiet = race_of(*models, right)
    assert quiet.winner(LEAD).effects == ()
    assert replace(quiet, noise_nrmse=0.01).winner(LEAD).effects == ()
    assert replace(quiet, noise_nrmse=0.06).winner(LEAD) is right


@pytest.mark.property
def test_the_declared_form_is_kept_where_others_are_alike() -> None:
    declared, other = FakeModel("bouc-wen", (), 5.0), FakeModel("dahl", (), 4.9)
    race = race_of(declared, other)
    assert race.winner(LEAD) is declared
    assert race.tied_forms(declared, LEAD) == ("dahl",)
    assert race.tied_forms(other, LEAD) == ("bouc-wen",)


@pytest.mark.property
def test_further_terms_extend_the_winner_in_its_own_form() -> None:
    right = FakeModel("dahl", ("accumulator",), 9.0)
    more = FakeModel("dahl", ("accumulator", "stribeck"), 8.0)
    other = FakeModel("lugre", ("accumulator", "stribeck"), 7.5)
    race = race_of(FakeModel("dahl", (), 60.0), right, more, other)
    assert race.winner(LEAD) is right
    assert race.extended(right) is more


@pytest.mark.property
def test_support_is_the_share_of_resamples_that_need_the_effect() -> None:
    rng = np.random.default_rng(2)
    sure = race_of(FakeModel("bouc-wen", (), 30.0), FakeModel("bouc-wen", ("accumulator",), 2.0))
    assert sure.support("accumulator", LEAD, draws=100, rng=rng) == 1.0
    # one test alone asks for the effect: resamples without this test do not name it
    one = np.full(TESTS, 4.0)
    one[0] = 60.0
    lone = race_of(FakeModel("bouc-wen", (), one), FakeModel("bouc-wen", ("end-stop",), 4.0))
    assert lone.support("end-stop", LEAD, draws=400, rng=rng) == pytest.approx(
        1.0 - (1.0 - 1.0 / TESTS) ** TESTS, abs=0.08
    )


@pytest.mark.property
def test_a_model_that_is_unstable_on_a_test_outside_the_draft_loses(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = plain_fit("accumulator")
    unstable = replace(plain, theta=plain.theta.copy())

    def simulated(problem: Problem, theta: FloatArray) -> FloatArray:
        rows = regressors(problem, theta)
        return np.where(problem.recordings.test == 1, np.nan, rows) if theta is unstable.theta else rows

    monkeypatch.setattr("mrpipe.tracing.bench.base_forms.race.regressors", simulated)
    race = _compared([unstable, plain], plain, {}, 1.0, frozenset(), RaceRules(), 1)
    assert race.winner(LEAD).fit is plain


@pytest.mark.property
def test_springs_of_a_base_form_are_left_to_the_accumulator() -> None:
    for name in ("modified-bouc-wen", "hyperbolic-tangent"):
        form = base_form(name)
        bare = form.without_springs()
        assert {item.name for item in form.parameters} - {item.name for item in bare.parameters} == set(form.springs)
        values = {item.name: 1.0 for item in bare.parameters}
        assert len(bare.steps(values)) == len(form.steps({**values, **dict.fromkeys(form.springs, 0.0)}))


@pytest.mark.planted
def test_a_form_that_reads_its_yield_force_finds_it_again_with_the_effects() -> None:
    """The yield force of the form alone contains the force of the spring in parallel, which the effect then takes."""
    plain = plain_fit("accumulator")
    effect = damper_effects()["accumulator"]
    problem = replace(plain.problem, terms=(Term(effect, effect.form("linear")),))
    chosen = fit(problem, start_of(problem, plain.base_values, [{}]), iterations=6)
    single = _held(
        fits_without_effects(plain, {"bouc-wen-stiffness": base_form("bouc-wen-stiffness")})["bouc-wen-stiffness"]
    )
    (found,) = with_effects_of(chosen, [single])
    drive = np.linspace(0.0, found.problem.scales.drive, 9)
    largest = np.max(np.abs(found.laws[0](drive)))
    assert np.max(np.abs(found.laws[0](drive) - found.problem.reference[0](drive))) < 0.02 * largest
    assert np.max(np.abs(found.laws[0](drive) - single.problem.reference[0](drive))) > 0.02 * largest


@pytest.mark.planted
def test_numbers_of_a_form_that_imitate_the_missing_effect_are_not_kept() -> None:
    """Alone, a form may end in a minimum that the effect cannot leave; it begins at its own starts as well."""
    plain = plain_fit("accumulator")
    effect = damper_effects()["accumulator"]
    problem = replace(plain.problem, terms=(Term(effect, effect.form("linear")),))
    chosen = fit(problem, start_of(problem, plain.base_values, [{}]), iterations=6)
    single = fits_without_effects(plain, {"viscoplastic": base_form("viscoplastic")})["viscoplastic"]
    low, high = single.problem.bounds()
    names = [parameter.name for _, parameter in single.problem.searched]
    theta = single.theta.copy()
    theta[names.index("flow_speed")] = high[names.index("flow_speed")]
    theta[names.index("exponent")] = low[names.index("exponent")]
    (found,) = with_effects_of(chosen, [fit(single.problem, theta, iterations=0)])
    (best,) = with_effects_of(chosen, [single])
    assert found.chi_square < 1.05 * best.chi_square
    problem = replace(single.problem, terms=chosen.problem.terms)
    values = single.problem.values(theta)[0]
    from_there = fit(problem, start_of(problem, values, chosen.term_values), iterations=8)
    assert found.chi_square < 0.9 * from_there.chi_square
