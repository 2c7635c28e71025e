"""Effects of a wall are chosen in the equations of its modes."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.choice import choice
from mrpipe.tracing.structure.rounds import FrameSelection
from mrpipe.tracing.structure.select import select
from tests.tracing.structure.towers import BUMPED_FLOOR, MASSES, bumped_wall, tower_records

LIBRARY = [all_structural_effects()[name] for name in ("impact", "cubic-stiffness", "joint-friction")]


def choose(problem: FrameProblem) -> FrameSelection:
    return select(problem, LIBRARY, NamingRules(), most=1, rng=np.random.default_rng(1), draws=50)


@pytest.mark.planted
def test_a_bumper_at_a_wall_is_found_at_its_floor() -> None:
    records = bumped_wall()
    problem, found = choice(frame_problem(records[:2], records[2:], MASSES), choose)
    assert problem.modal is not None
    assert [(item.name, item.placed.floor) for item in found.chosen] == [("impact", BUMPED_FLOOR)]
    assert found.share(found.residual) > NamingRules().least_share


@pytest.mark.planted
def test_nothing_is_chosen_for_a_wall_without_an_effect() -> None:
    records = tower_records("wall", noise=0.002)
    problem, found = choice(frame_problem(records[:2], records[2:], MASSES), choose)
    assert problem.modal is None and not found.chosen and not found.structured
