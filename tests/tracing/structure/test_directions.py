"""Structures that move in two directions are traced in each, from all their sensors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import Campaign, Recording
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.errors import UserError
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.structure.directions import directions_of, in_direction
from mrpipe.tracing.structure.verdict import trace_structure
from tests.tracing.structure.rig import frame_campaign


def two_directions(along: Campaign, across: Campaign) -> Campaign:
    """Return the tests of two frames as those of one that moves in x and y, with two sensors of y on each floor."""
    tests = []
    for x, y in zip(along.recordings, across.recordings, strict=True):
        channels = {f"{name}_x" if name.startswith("floor") else name: values for name, values in x.channels.items()}
        turn = 0.3 * np.sin(0.1 * np.arange(x.time_s.size))
        for name, values in y.channels.items():
            if name.startswith("floor_acceleration"):
                channels |= {f"{name}_y1": values - 3.0 * turn, f"{name}_y2": values + 5.0 * turn}
            elif name == "ground_acceleration":
                channels["ground_acceleration_y"] = values
        tests.append(replace(x, channels=channels))
    declared = {"frame": {"sensor_positions_m": {"x": [0, 0], "y1": [-3, 0], "y2": [5, 0]}}}
    return replace(along, recordings=tuple(tests), declared=declared)


@pytest.mark.planted
def test_an_effect_in_one_direction_is_named_there() -> None:
    campaign = two_directions(frame_campaign("clean"), frame_campaign("cubic-stiffness", 3))
    first, *others = campaign.recordings
    measured = replace(first, channels={**first.channels, "damper_force": np.zeros(first.time_s.size)})
    campaign = replace(campaign, recordings=(measured, *others))
    assert directions_of(campaign) == ["x", "y"]
    options = TracingOptions(most_effects=1, bootstrap_draws=50)
    effects = {name: all_structural_effects()[name] for name in ("cubic-stiffness", "joint-friction")}
    found = trace_structure([campaign], effects, {}, options, rng=np.random.default_rng(1))
    assert [item["name"] for item in found.summary["effects"]] == ["cubic-stiffness"]
    assert found.summary["part"] == "frame y"
    assert found.summary["directions"]["coupling_modelled"] is False
    assert any(line.startswith("the damper is not traced") for line in found.findings)
    assert sum("forces that couple the directions" in line for line in found.findings) == 1
    assert found.summary["parts"]["frame x"]["effects"] == []
    assert {name.partition("/")[0] for name in found.histories} == {"x", "y"}


@pytest.mark.property
def test_the_centre_of_mass_and_the_excitation_of_each_direction() -> None:
    along, across = frame_campaign("clean"), frame_campaign("clean", 3)
    campaign = two_directions(along, across)
    for axis, expected in (("x", along), ("y", across)):
        part = in_direction(campaign, axis)
        assert part is not None and part.floor_masses_kg == campaign.floor_masses_kg
        for test, own in zip(part.recordings, expected.recordings, strict=True):
            for name in ("ground_acceleration", "floor_acceleration_2"):
                np.testing.assert_allclose(test.channels[name], own.channels[name], atol=1e-12)


@pytest.mark.property
def test_a_shaker_acts_in_its_direction_and_what_is_not_excited_is_left_out() -> None:
    time = np.arange(100) / 100.0
    channels = {"input_force": time, "floor_acceleration_1_x": time, "floor_acceleration_1_y": time}
    details = {"input_force_direction": "y", "input_force_floor": 1}
    test = Recording("sweep-a", "validation", 100.0, time, channels, ((0, 100),), "sweep", details)
    campaign = Campaign("tower", "shear-frame", Path(), (test,), floor_masses_kg=(100.0,))
    assert in_direction(campaign, "x") is None
    (kept,) = in_direction(campaign, "y").recordings  # type: ignore[union-attr]
    assert set(kept.channels) == {"input_force", "floor_acceleration_1"} and kept.details["floor"] == 1
    bare = replace(campaign, recordings=(replace(test, channels={"floor_acceleration_1_x": time}),))
    with pytest.raises(UserError, match=r"no validation test has a measured excitation .*; give ground_acceleration_x"):
        trace_structure([bare], {}, {}, TracingOptions(), rng=np.random.default_rng(1))
