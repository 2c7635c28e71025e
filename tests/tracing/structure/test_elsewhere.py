"""Further effects in other storeys: two planted effects are named, and a single one gets no second name."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.candidates import Fitted, Placed, columns_of
from mrpipe.tracing.structure.elsewhere import recovered, with_effects_elsewhere
from mrpipe.tracing.structure.left_out import folds_of
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.naming import named_effects
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.rounds import FrameSelection, placed_forms
from mrpipe.tracing.structure.select import select
from tests.tracing.structure.rig import frame_campaign

LIBRARY = list(all_structural_effects().values())


@functools.cache
def problem(effect: str) -> FrameProblem:
    data = frame_data(frame_campaign(effect))
    return frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)


@functools.cache
def selected(effect: str, most: int = 3) -> FrameSelection:
    return select(problem(effect), LIBRARY, NamingRules(), most=most, rng=np.random.default_rng(1), draws=40)


def searched(selection: FrameSelection, effect: str, naming: NamingRules | None = None) -> FrameSelection:
    given = problem(effect)
    forms = placed_forms(LIBRARY, len(given.masses_kg))
    folds = folds_of(selection.base, given.training, selection.about)
    return with_effects_elsewhere(
        selection, forms, folds, naming or NamingRules(), most=3, rng=np.random.default_rng(1), draws=40, jobs=1
    )


PAIR = "impact and cubic-stiffness"


@pytest.mark.planted
def test_a_weaker_effect_in_another_storey_is_named_where_it_acts() -> None:
    found = selected(PAIR)
    named = named_effects(found, model_of(found.design, found.chosen, found.about), NamingRules(), explained=True)
    assert [(item.name, item.place) for item in named] == [("impact", "floor 2"), ("cubic-stiffness", "storey 3")]
    # the stronger effect alone explains what counts as proven
    alone = selected(PAIR, most=1)
    assert alone.share(alone.residual) > NamingRules().named_share and found.elsewhere == 1
    # its confidence is that of an effect that is named alone
    assert named[0].confidence > found.rules.probability_of_several >= named[1].confidence
    assert len(found.gains) == 2


@pytest.mark.planted
@pytest.mark.parametrize("effect", ["impact", "joint-friction", "cubic-stiffness", "yielding", "nonlinear-damping"])
def test_a_single_effect_gets_no_second_name(effect: str) -> None:
    assert [item.name for item in selected(effect).chosen] == [effect]


@pytest.mark.property
def test_nothing_is_searched_after_an_effect_that_is_not_named() -> None:
    alone = selected(PAIR, most=1)
    assert searched(alone, PAIR).elsewhere == 1
    assert searched(alone, PAIR, NamingRules(least_share=0.999)) is alone
    # without further records nothing confirms an effect
    none = with_effects_elsewhere(
        alone, [], None, NamingRules(), most=3, rng=np.random.default_rng(1), draws=40, jobs=1
    )
    assert none is alone


@pytest.mark.property
def test_effects_that_explain_a_storey_alike_are_not_named() -> None:
    alone = selected(PAIR, most=1)
    assert searched(alone, PAIR, NamingRules(lead=1.01)).elsewhere == 0


@pytest.mark.property
def test_the_recovered_share_is_that_of_one_storey() -> None:
    found = selected(PAIR, most=1)
    groups = found.groups.of_storeys([2])
    residual = found.design.residual
    lower = residual.copy()
    lower[2] = 0.5 * residual[2]
    assert recovered(groups, residual, residual) == 0.0
    assert 0.5 < recovered(groups, residual, lower) <= 1.05
    assert recovered(found.groups.of_storeys([1]), residual, lower) == 0.0
    none = replace(groups, flagged=np.zeros_like(groups.flagged))
    assert recovered(none, residual, lower) == 0.0


@pytest.mark.property
def test_an_effect_of_one_storey_has_no_force_in_the_others() -> None:
    given = selected(PAIR)
    record = problem(PAIR).training[0]
    friction = next(item for item in LIBRARY if item.name == "joint-friction")
    everywhere = Fitted(Placed(friction, friction.forms[0]), np.full(len(friction.forms[0].searched), 1e-4))
    third = replace(everywhere, placed=replace(everywhere.placed, storeys=(3,)))
    all_lines, lines = (columns_of(item, record, given.about).lines for item in (everywhere, third))
    kinds = len(friction.forms[0].amplitudes)
    np.testing.assert_allclose(lines[2 * kinds :], all_lines[2 * kinds :])
    assert np.any(lines[2 * kinds :]) and not np.any(lines[: 2 * kinds])


@pytest.mark.planted
def test_an_effect_that_leaves_a_part_of_the_validation_error_is_less_probable() -> None:
    """Its confidence had stayed that of an effect which explains everything, at two noise floors."""
    found = selected(PAIR, most=1)
    model = model_of(found.design, found.chosen, found.about)
    sure, doubtful = (named_effects(found, model, NamingRules(), explained=value)[0] for value in (True, False))
    assert sure.confidence > found.rules.probability_in_part >= doubtful.confidence
