"""A rocking base under a shear frame is accepted only if the error is that of a full stiffness matrix."""

from __future__ import annotations

import pytest

from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.base import ladder
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.rocking import on_rocking_base
from mrpipe.tracing.structure.rounds import FrameSelection, placed_forms
from tests.tracing.structure.test_select import LIBRARY, problem

pytestmark = pytest.mark.planted


def _accepted(effect: str, *names: str) -> FrameSelection | None:
    given = problem(effect)
    designs = ladder(given.training)
    simple, free = (
        FrameSelection(name, item, groups_of(item), {}, storey_stiffness=given.storey_stiffness)
        for name, item in designs.items()
    )
    forms = placed_forms([LIBRARY[name] for name in names], 3)
    return on_rocking_base(simple, free, forms, 1, NamingRules().least_share)


def test_a_rocking_base_is_accepted() -> None:
    found = _accepted("base-rocking", "base-rocking")
    assert found is not None and [item.name for item in found.chosen] == ["base-rocking"]
    assert found.share(found.residual) > 0.9


def test_a_frame_that_bends_as_well_is_not_a_shear_frame_on_a_rocking_base() -> None:
    assert _accepted("braced-rocking", "base-rocking") is None


def test_without_an_effect_of_the_base_nothing_is_searched() -> None:
    assert _accepted("base-rocking", "joint-friction") is None
