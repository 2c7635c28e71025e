"""Forward selection on a structure: places, bounds of shares, and gains on left-out records."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.candidates import Fitted, Outcome, Placed
from mrpipe.tracing.structure.fit import Solved, design_of
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.select import FrameSelection, admissible, left_out_errors, placed_forms, select
from tests.tracing.structure.rig import frame_campaign

pytestmark = pytest.mark.planted

LIBRARY = all_structural_effects()


@functools.cache
def problem(effect: str) -> FrameProblem:
    data = frame_data(frame_campaign(effect))
    return frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)


@functools.cache
def selected(effect: str, *names: str, most: int = 1, declared: bool = False) -> FrameSelection:
    library = [LIBRARY[name] for name in names]
    return select(
        problem(effect), () if declared else library, NamingRules(), most=most, declared=library if declared else (),
        rng=np.random.default_rng(1), draws=40,
    )  # fmt: skip


def test_an_effect_of_a_floor_is_tried_at_every_floor() -> None:
    effects = [LIBRARY[name] for name in ("impact", "joint-friction", "base-rocking", "controller-delay")]
    places = placed_forms(effects, 4)
    assert sorted({item.floor for item in places if item.effect.name == "impact"}) == [1, 2, 3, 4]
    assert {item.floor for item in places if item.effect.name != "impact"} == {0}
    # an effect of the command is no force on the structure
    assert {item.effect.name for item in places} == {"impact", "joint-friction", "base-rocking"}
    assert len(places) == sum(len(LIBRARY[name].forms) for name in ("joint-friction", "base-rocking")) + 4 * len(
        LIBRARY["impact"].forms
    )


def test_a_clean_frame_gets_no_effect() -> None:
    found = selected("clean", "joint-friction", "cubic-stiffness")
    assert not found.structured and found.chosen == () and found.rounds == ()


def test_the_planted_effect_is_chosen_and_gains_on_left_out_records() -> None:
    found = selected("cubic-stiffness", "joint-friction", "cubic-stiffness")
    assert [item.name for item in found.chosen] == ["cubic-stiffness"]
    assert found.share(found.residual) > 0.5
    (gain,) = found.gains
    assert gain.interval[0] > 0.0 and gain.interval[0] <= gain.share <= gain.interval[1]
    first, *others = found.rounds[0]
    assert first.name == "cubic-stiffness" and all(first.share > item.share for item in others)


def test_no_effect_is_added_if_none_is_allowed() -> None:
    found = selected("cubic-stiffness", "cubic-stiffness", most=0)
    assert found.structured and found.chosen == ()


def test_a_declared_effect_belongs_to_the_baseline() -> None:
    found = selected("cubic-stiffness", "cubic-stiffness", declared=True)
    assert found.declared == 1 and [item.name for item in found.chosen] == ["cubic-stiffness"]


def test_a_share_above_its_bound_is_not_admissible() -> None:
    effect = LIBRARY["base-rocking"]
    form = effect.forms[0]
    fitted = Fitted(Placed(effect, form), np.array([2.0, 0.03]))
    residual = np.zeros((3, 4))
    assert admissible(Outcome(fitted, Solved(np.array([0.6]), residual, 1.0)))
    assert not admissible(Outcome(fitted, Solved(np.array([1.4]), residual, 1.0)))
    # an amplitude with a unit has a bound for the search alone
    friction = LIBRARY["joint-friction"]
    other = replace(fitted, placed=Placed(friction, friction.forms[0]))
    assert admissible(Outcome(other, Solved(np.array([1e6]), residual, 1.0)))


def test_errors_of_left_out_records_fall_with_the_planted_effect() -> None:
    found, given = selected("cubic-stiffness", "joint-friction", "cubic-stiffness"), problem("cubic-stiffness")
    design = design_of(found.base, given.training[:1])
    out = given.training[1:]
    without = np.concatenate(left_out_errors(design, (), out, found.about))
    with_effect = np.concatenate(left_out_errors(design, found.chosen, out, found.about))
    assert without.shape == with_effect.shape
    assert with_effect.sum() < 0.7 * without.sum()
