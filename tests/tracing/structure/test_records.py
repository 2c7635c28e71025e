"""Recordings of a structure that cannot be traced, and the parts that are used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.records import frame_data, part_of
from mrpipe.tracing.structure.trace import trace_frame
from tests.tracing.structure.rig import FLOORS, MASSES, RATE, frame_campaign

pytestmark = pytest.mark.property


@pytest.fixture(scope="module")
def clean() -> Campaign:
    return frame_campaign("clean")


def changed(campaign: Campaign, test: int, **channels: float) -> Campaign:
    tests = list(campaign.recordings)
    constant = {name: np.full(tests[test].time_s.size, value) for name, value in channels.items()}
    tests[test] = replace(tests[test], channels={**tests[test].channels, **constant})
    return replace(campaign, recordings=tuple(tests))


def cut(recording: Recording, keep: np.ndarray) -> Recording:
    channels = {name: values[keep] for name, values in recording.channels.items()}
    size = int(np.count_nonzero(keep))
    return replace(recording, time_s=recording.time_s[keep], channels=channels, segments=((0, size),))


def test_a_dead_sensor_and_an_excitation_of_zeros_are_named(clean: Campaign) -> None:
    with pytest.raises(UserError, match=r"tests\.sweep-1\.channels\.floor_acceleration_2: never changes"):
        frame_data(changed(clean, 1, floor_acceleration_2=0.0))
    with pytest.raises(UserError, match=r"tests\.random-2\.channels\.ground_acceleration: never changes"):
        frame_data(changed(clean, 2, ground_acceleration=0.0))


def test_an_unknown_mass_is_named(clean: Campaign) -> None:
    masses = (*MASSES[:-1], float("nan"))
    with pytest.raises(UserError, match=rf"floor_masses_kg: does not give the mass of floor {FLOORS}"):
        frame_data(replace(clean, floor_masses_kg=masses))


def test_the_longest_part_without_a_gap_is_used(clean: Campaign) -> None:
    whole = clean.recordings[0]
    keep = np.ones(whole.time_s.size, dtype=bool)
    keep[600:900] = False
    assert part_of(whole) == slice(0, whole.time_s.size)
    assert part_of(cut(whole, keep)) == slice(600, whole.time_s.size - 300)


def test_a_record_of_few_periods_is_refused_and_not_called_noise(clean: Campaign) -> None:
    tests = list(clean.recordings)
    tests[2] = cut(tests[2], np.arange(tests[2].time_s.size) < 0.8 * RATE)
    short = frame_data(replace(clean, recordings=tuple(tests)))
    with pytest.raises(UserError, match=r"tests\.random-2: lasts 0\.8 s, which is .* periods of the first mode"):
        trace_frame(short, [], [], NamingRules(), rng=np.random.default_rng(1))
