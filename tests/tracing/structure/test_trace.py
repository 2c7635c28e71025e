"""Planted effects of a structure, in forms that the library does not hold, are named; clean and unknown frames not."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.trace import FrameTracing, trace_frame
from tests.tracing.structure.rig import frame_campaign


@functools.cache
def traced(effect: str) -> FrameTracing:
    library = list(all_structural_effects().values())
    rng = np.random.default_rng(1)
    return trace_frame(frame_data(frame_campaign(effect)), library, [], NamingRules(), most=1, draws=60, rng=rng)


def summary(effect: str) -> dict[str, Any]:
    return traced(effect).summary


@pytest.mark.planted
@pytest.mark.parametrize("effect", ["joint-friction", "cubic-stiffness", "impact", "base-rocking", "nonlinear-damping"])
def test_a_planted_effect_is_named_first(effect: str) -> None:
    found = summary(effect)
    assert found["effects"][0]["name"] == effect
    assert found["candidates"][0]["name"] == effect
    assert found["after"]["nrmse"] < 0.6 * found["before"]["nrmse"]


@pytest.mark.planted
def test_a_base_whose_edge_lifts_is_a_rocking_one() -> None:
    found = summary("lifting-edge")
    assert [item["name"] for item in found["effects"]] == ["base-rocking"]
    assert found["after"]["nrmse"] < 0.3 * found["before"]["nrmse"]


@pytest.mark.planted
def test_the_storeys_and_the_floor_are_found() -> None:
    assert summary("cubic-stiffness")["effects"][0]["place"] == "storey 2"
    bumper = summary("impact")["effects"][0]
    assert bumper["place"] == "floor 2"
    assert bumper["parameters"]["gap"]["value"] == pytest.approx(0.004, rel=0.1)
    forces = summary("joint-friction")["effects"][0]["parameters"]["force"]["by_storey"]
    assert forces == pytest.approx([0.5, 0.8, 0.3], rel=0.3)


@pytest.mark.planted
def test_a_clean_frame_lacks_nothing() -> None:
    found = summary("clean")
    assert found["effects"] == []
    assert not found["residual"]["structured"]
    assert found["before"]["nrmse"] < 1.1 * found["noise_floor_nrmse"]


@pytest.mark.planted
def test_a_law_of_no_family_stays_unknown() -> None:
    found = summary("unknown")
    assert found["residual"]["structured"]
    assert found["effects"] == []
    assert found["unexplained"]["structured"]
    assert found["unexplained"]["depends_on"]
    assert found["residual"]["where"]["storey_1"] > 0.5


@pytest.mark.property
def test_the_storeys_of_a_clean_frame_come_out() -> None:
    assert traced("clean").problem.storey_stiffness == pytest.approx([9000.0, 8000.0, 7000.0], rel=0.01)
