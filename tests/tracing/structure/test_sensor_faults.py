"""Planted faults of sensors on a clean frame are found with their size, and removed; effects are no faults."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.tracing.structure import fault_search
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.fault_search import likely_fault
from mrpipe.tracing.structure.fit import Design, design_of
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.records import FrameRecord, frame_data
from mrpipe.tracing.structure.sensor_faults import SensorFault, repaired
from tests.tracing.structure.rig import RATE, frame_campaign

pytestmark = pytest.mark.planted

DELAY_S = 0.004


LONG_DELAY_S = 0.03
"""Nearly half a period of the fastest lines, so that the residual first rises with a delay that is fitted from zero."""


def _late(values: FloatArray, delay_s: float = DELAY_S) -> FloatArray:
    """Return a history that is late by some milliseconds, interpolated by the Fourier transform."""
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(len(values), 1.0 / RATE) * delay_s)
    return np.asarray(np.fft.irfft(np.fft.rfft(values) * turn, len(values)))


def _spoilt(recording: Recording, fault: str) -> Recording:
    channels = dict(recording.channels)
    third = channels["floor_acceleration_3"]
    if fault == "gain":
        channels["floor_acceleration_3"] = 0.85 * third
    elif fault == "sign in one test" and recording.name == "sweep-1":
        channels["floor_acceleration_3"] = -third
    elif fault == "delay":
        channels["floor_acceleration_3"] = _late(third)
    elif fault == "long delay":
        channels["floor_acceleration_3"] = _late(third, LONG_DELAY_S)
    elif fault == "gain of the ground":
        channels["ground_acceleration"] = 1.2 * channels["ground_acceleration"]
    elif fault == "exchanged in all tests" or (fault == "exchanged" and recording.name == "sweep-1"):
        channels["floor_acceleration_3"] = channels["floor_acceleration_2"]
        channels["floor_acceleration_2"] = third
    return replace(recording, channels=channels)


def faulty_campaign(fault: str, effect: str = "clean", *, lasers: bool = False) -> Campaign:
    """Return the small frame's campaign with a fault of a sensor, without its lasers unless they are wanted."""
    campaign = frame_campaign(effect)
    recordings = [_spoilt(item, fault) for item in campaign.recordings]
    if not lasers:
        recordings = [
            replace(item, channels={k: v for k, v in item.channels.items() if "displacement" not in k})
            for item in recordings
        ]
    return replace(campaign, recordings=tuple(recordings))


@functools.cache
def _problem(fault: str, effect: str = "clean") -> FrameProblem:
    data = frame_data(faulty_campaign(fault, effect))
    return frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)


def _found(problem: FrameProblem) -> SensorFault | None:
    design = design_of("linear-frame", problem.training)
    return likely_fault(design, groups_of(design), problem.masses_kg, 0.5)


@pytest.mark.parametrize(
    ("fault", "floor", "test", "gain", "delay_s"),
    [
        ("gain", 3, "", 0.85, 0.0),
        ("sign in one test", 3, "sweep-1", -1.0, 0.0),
        ("delay", 3, "", 1.0, DELAY_S),
        ("long delay", 3, "", 1.0, LONG_DELAY_S),
        ("gain of the ground", 0, "", 1.2, 0.0),
    ],
)
def test_gain_sign_and_delay_are_found(fault: str, floor: int, test: str, gain: float, delay_s: float) -> None:
    found = _found(_problem(fault))
    assert found is not None
    assert (found.floor, found.test, found.exchanged_with) == (floor, test, 0)
    assert found.gain == pytest.approx(gain, abs=0.01)
    assert found.delay_s == pytest.approx(delay_s, abs=2e-4)
    assert found.explained > 0.9


def test_floors_that_are_exchanged_in_one_test_are_found() -> None:
    found = _found(_problem("exchanged"))
    assert found is not None and (found.floor, found.exchanged_with, found.test) == (2, 3, "sweep-1")
    assert "floor_acceleration_2 and floor_acceleration_3 are exchanged in test sweep-1" in found.sentence()


@pytest.mark.parametrize("fault", ["gain", "sign in one test", "delay", "exchanged"])
def test_repaired_records_are_those_of_a_clean_frame(fault: str) -> None:
    problem = _problem(fault)
    found = _found(problem)
    assert found is not None
    again = frame_problem(
        [repaired(item.record, found) for item in problem.training],
        [repaired(item.record, found) for item in problem.validation],
        problem.masses_kg,
    )
    before, after = (design_of("linear-frame", item.training) for item in (problem, again))
    assert groups_of(before).material(before.residual)
    assert not groups_of(after).material(after.residual)


def test_a_step_that_is_too_long_is_shortened(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without shorter steps the fit of the gain ends where it began, and the fault is not found."""
    problem, exact, steps = _problem("gain"), fault_search._step, []

    def first_too_long(fault: SensorFault, design: Design, masses: FloatArray) -> tuple[FloatArray, float]:
        change, expected = exact(fault, design, masses)
        steps.append(change)
        return (4.0 * change if len(steps) == 1 else change), expected

    monkeypatch.setattr(fault_search, "_step", first_too_long)
    found, _ = fault_search._fitted(SensorFault(3, ""), problem.training, problem.masses_kg)
    assert found.gain == pytest.approx(0.85, abs=0.01)


def test_no_fault_explains_a_nonlinear_stiffness() -> None:
    assert _found(_problem("none", "cubic-stiffness")) is None


def test_a_fault_within_the_error_of_a_calibration_does_not_count() -> None:
    assert not SensorFault(2, gain=1.01, delay_s=1e-4).exceeds(0.02, 20.0)
    assert SensorFault(2, gain=0.97).exceeds(0.02, 20.0)
    assert SensorFault(2, delay_s=3e-4).exceeds(0.02, 20.0)
    assert SensorFault(2, exchanged_with=3).exceeds(0.02, 20.0)


def test_a_gain_in_all_tests_may_be_a_wrong_mass() -> None:
    assert "or the mass of floor 2 is 0.8 times the declared one" in SensorFault(2, gain=0.8).sentence()
    assert "mass" not in SensorFault(2, "sweep-1", 0.8).sentence()


def test_a_delay_that_no_structure_shows_is_not_mentioned() -> None:
    assert "delay" not in SensorFault(2, gain=0.8, gain_error=1e-3, delay_s=1e-5, delay_error_s=1e-6).sentence()
    assert "a gain of 0.8 and a delay of 4 ms" in SensorFault(2, gain=0.8, delay_s=0.004).sentence()


def test_the_record_of_another_test_is_not_repaired() -> None:
    record = frame_data(faulty_campaign("none")).records[0]
    assert repaired(record, SensorFault(1, "another test", -1.0)) is record


@pytest.mark.property
def test_a_repaired_delay_moves_the_history_by_whole_samples() -> None:
    record: FrameRecord = frame_data(faulty_campaign("none")).records[0]
    moved = repaired(record, SensorFault(3, delay_s=2.0 / record.rate_hz))
    middle = slice(200, -200)
    expected = np.roll(record.acceleration[:, 2], -2)[middle]
    assert moved.acceleration[middle, 2] == pytest.approx(expected, abs=0.02 * np.std(expected))
