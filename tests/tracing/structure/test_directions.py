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
from mrpipe.tracing.structure.base import frame_problem
from mrpipe.tracing.structure.directions import directions_of, in_direction
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.verdict import trace_structure
from tests.tracing.structure.rig import frame_campaign
from tests.tracing.structure.towers import eccentric_building


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
    assert found.summary["directions"]["coupling_modelled"] is True
    assert any(line.startswith("the damper is not traced") for line in found.findings)
    assert sum("rotation of the floors about the vertical" in line for line in found.findings) == 1
    assert found.summary["parts"]["frame x"]["effects"] == []
    assert {name.partition("/")[0] for name in found.histories} == {"x", "y"}


@pytest.mark.planted
@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_rotation_of_an_eccentric_building_is_part_of_its_linear_frame(axis: str) -> None:
    """Without the rotation, the coupling of the directions is a residual far above the noise."""
    part = in_direction(eccentric_building(), axis)
    assert part is not None
    data = frame_data(part)
    for turning, missing in ((True, False), (False, True)):
        records = data.records if turning else [replace(item, turning=item.turning[:, :0]) for item in data.records]
        problem = frame_problem(records[:2], records[2:], data.masses_kg)
        assert problem.training[0].record.turns == (3 if turning else 0)
        design = design_of("linear-frame", problem.training)
        assert groups_of(design).material(design.residual) is missing


@pytest.mark.property
def test_rotations_are_used_only_if_the_sensors_of_every_floor_determine_them() -> None:
    campaign = eccentric_building()
    first = campaign.recordings[0]
    channels = {name: values for name, values in first.channels.items() if name != "floor_acceleration_2_y2"}
    fewer = replace(campaign, recordings=(replace(first, channels=channels), *campaign.recordings[1:]))
    for given, known in ((campaign, True), (fewer, False)):
        part = in_direction(given, "y")
        assert part is not None
        assert all(("floor_turn_2" in item.channels) is known for item in part.recordings)


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
