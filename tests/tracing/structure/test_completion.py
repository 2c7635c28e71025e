"""Floors without a sensor: their motion follows from the other floors and the identified frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.errors import UserError
from mrpipe.structures import modal_damping_matrix, shear_frame
from mrpipe.structures.response import linear_response
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.structure.completion import completed
from mrpipe.tracing.structure.directions import in_direction
from mrpipe.tracing.structure.records import COMPUTED, without_sensor
from mrpipe.tracing.structure.verdict import trace_structure
from tests.tracing.structure.rig import frame_campaign
from tests.tracing.structure.test_directions import two_directions

MASSES = [6.0, 5.5, 5.0, 5.0]
STOREYS = np.array([9000.0, 8000.0, 7000.0, 6000.0])
DAMPING = [0.01, 0.012, 0.015, 0.02]


def _without(campaign: Campaign, *floors: int) -> Campaign:
    endings = tuple(f"_{floor}" for floor in floors)
    return replace(
        campaign,
        recordings=tuple(
            replace(test, channels={key: x for key, x in test.channels.items() if not key.endswith(endings)})
            for test in campaign.recordings
        ),
    )


def _loosening(factors: list[float], seconds: float = 40.0, rate: float = 100.0) -> Campaign:
    """Return random tests on a frame of four floors whose stiffness has a factor of its own in each test."""
    rng = np.random.default_rng(4)
    time = np.arange(int(seconds * rate)) / rate
    tests = []
    for number, factor in enumerate(factors):
        frame = shear_frame(MASSES, STOREYS * factor, DAMPING)
        frame = replace(frame, damping=modal_damping_matrix(frame.mass, frame.stiffness, DAMPING))
        tones = rng.uniform(0.8, 14.0, 120)
        motion = np.sum(np.sin(2 * np.pi * tones[:, None] * time + rng.uniform(0, 7, (120, 1))), axis=0) / 8.0
        ground = 0.4 * motion * np.clip(np.minimum(time, seconds - 5.0 - time), 0.0, 1.0)
        seen = linear_response(frame, ground, 1.0 / rate).absolute_acceleration
        channels = {"ground_acceleration": ground + 0.004 * rng.standard_normal(time.size)}
        for k in range(len(MASSES)):
            channels[f"floor_acceleration_{k + 1}"] = seen[:, k] + 0.004 * rng.standard_normal(time.size)
        role = "validation" if number == 2 else "training"
        tests.append(Recording(f"test-{number + 1}", role, rate, time, channels, ((0, time.size),), "random", {}))
    return Campaign("own", "shear-frame", Path("nowhere"), tuple(tests), floor_masses_kg=tuple(MASSES))


@pytest.mark.planted
@pytest.mark.parametrize("floor", [1, 2, 3])
def test_the_motion_of_a_floor_is_that_of_its_sensor(floor: int) -> None:
    campaign = frame_campaign("clean", 1)
    found, lines = completed(_without(campaign, floor))
    assert len(lines) == 1 and f"floors without a sensor ({floor})" in lines[0]
    for test, truth in zip(found.recordings, campaign.recordings, strict=True):
        (part,) = test.segments
        name = f"floor_acceleration_{floor}"
        error = test.channels[name][slice(*part)] - truth.channels[name][slice(*part)]
        assert np.std(error) < 0.008, "the noise of a sensor is 0.004 m/s^2"
        assert test.details[COMPUTED] == (floor,)
        assert 0 < part[0] < part[1] < truth.time_s.size


@pytest.mark.property
def test_nothing_is_changed_where_all_floors_have_sensors_or_masses_are_unknown() -> None:
    campaign = frame_campaign("clean")
    assert completed(campaign) == (campaign, [])
    bare = replace(_without(campaign, 2), floor_masses_kg=(6.0, np.nan, 5.0))
    assert completed(bare) == (bare, [])
    assert without_sensor(_without(campaign, 1, 3).recordings[0], 3) == [1, 3]


@pytest.mark.planted
def test_a_frame_that_loosens_is_recognised_with_two_of_four_floors_without_a_sensor() -> None:
    campaign = _without(_loosening([1.0, 0.988, 0.98, 0.968, 0.962, 0.95]), 1, 3)
    effects = {"cubic-stiffness": all_structural_effects()["cubic-stiffness"]}
    options = TracingOptions(most_effects=1, bootstrap_draws=50)
    found = trace_structure([campaign], effects, {}, options, rng=np.random.default_rng(1))
    between = found.summary["frame"]["between_tests"]
    assert between["kind"] == "drift"
    assert between["stiffness_change"] == pytest.approx(-0.05, abs=0.01)
    assert found.summary["effects"] == []
    assert any("floors without a sensor (1, 3)" in line for line in found.findings)
    assert any("drifts from test test-1 to test-6" in line for line in found.findings)
    assert "; the stiffness drifts from test test-1 to test-6 by -4." in found.summary["verdict"]


@pytest.mark.planted
def test_a_linear_frame_with_a_floor_without_a_sensor_leaves_noise() -> None:
    effects = {name: all_structural_effects()[name] for name in ("cubic-stiffness", "joint-friction")}
    options = TracingOptions(most_effects=1, bootstrap_draws=50)
    campaign = _without(frame_campaign("clean", 1), 2)
    found = trace_structure([campaign], effects, {}, options, rng=np.random.default_rng(1))
    assert found.summary["verdict_class"] == "noise"


@pytest.mark.planted
def test_a_direction_of_a_structure_is_completed_by_itself() -> None:
    campaign = two_directions(frame_campaign("clean", 1), frame_campaign("clean", 3))
    dropped = ("floor_acceleration_2_y1", "floor_acceleration_2_y2", "floor_displacement_2")
    tests = tuple(
        replace(test, channels={key: x for key, x in test.channels.items() if not key.startswith(dropped)})
        for test in campaign.recordings
    )
    part = in_direction(replace(campaign, recordings=tests), "y")
    assert part is not None
    found, lines = completed(part)
    assert "floors without a sensor (2)" in lines[0]
    assert "floor_acceleration_2" in found.recordings[0].channels


@pytest.mark.planted
def test_sensors_that_do_not_determine_the_frame_get_one_line() -> None:
    # one sensor, a short test: fewer modes than floors
    campaign = _without(_loosening([1.0]), 1, 2, 3)
    (test,) = campaign.recordings
    slow = np.sin(2.0 * np.pi * 1.0 * test.time_s)
    channels = {"ground_acceleration": slow, "floor_acceleration_4": 1.2 * slow}
    bare = replace(campaign, recordings=(replace(test, channels=channels, role="validation"),))
    with pytest.raises(UserError):
        completed(bare)
