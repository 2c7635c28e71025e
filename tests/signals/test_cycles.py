"""Steady cycles and static offsets."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.signals.cycles import SteadyCycles, choose_cycles, find_steady_cycles, upward_crossings
from mrpipe.signals.offsets import (
    balanced_extremes,
    drive_favours_a_side,
    force_intercept,
    mean_over_cycles,
)

RATE = 1000.0


@settings(max_examples=40, deadline=None)
@given(
    st.floats(0.3, 8.0), st.floats(1e-3, 30e-3), st.floats(-0.1, 0.1), st.floats(0.0, 6.28), st.integers(0, 2**32 - 1)
)
@pytest.mark.property
def test_cycles_of_a_noisy_sine(frequency: float, amplitude: float, offset: float, phase: float, seed: int) -> None:
    t = np.arange(round(12.0 / frequency * RATE)) / RATE
    noise = 0.01 * amplitude * np.random.default_rng(seed).standard_normal(t.size)
    x = amplitude * np.sin(2 * np.pi * frequency * t + phase) + offset + noise
    cycles = find_steady_cycles(x, RATE)
    assert 10 <= cycles.starts.size - 1 <= 12
    assert cycles.frequency_hz == pytest.approx(frequency, rel=0.01)
    assert cycles.amplitude == pytest.approx(amplitude, rel=0.05)
    # each start is a crossing of the middle, upwards
    assert np.max(np.abs(x[cycles.starts] - offset)) < 0.15 * amplitude
    assert np.all(x[cycles.starts[:-1] + round(RATE / frequency / 4)] > offset)


@pytest.mark.planted
def test_rest_and_run_up_are_no_steady_cycles() -> None:
    t = np.arange(14_000) / RATE
    envelope = np.clip((t - 1.0) / 3.0, 0.0, 1.0) * (t < 12.0)
    cycles = find_steady_cycles(5e-3 * envelope * np.sin(2 * np.pi * (t - 1.0)), RATE)
    assert cycles.periodic
    assert 3.5 <= cycles.starts[0] / RATE <= 5.1 and cycles.starts[-1] / RATE <= 12.01


@pytest.mark.planted
def test_triangles_are_periodic_and_random_motion_is_not() -> None:
    t = np.arange(20_000) / RATE
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * 0.5 * t))
    assert find_steady_cycles(triangle, RATE).starts.size - 1 >= 8
    rng = np.random.default_rng(0)
    tones = rng.uniform(0.3, 8.0, 60)
    noise = np.sum(np.sin(2 * np.pi * tones[:, None] * t + rng.uniform(0, 6.28, (60, 1))), axis=0)
    assert not find_steady_cycles(noise, RATE).periodic
    sweep = np.sin(2 * np.pi * (0.5 * t + 0.25 * t**2))
    assert not find_steady_cycles(sweep, RATE).periodic
    assert not find_steady_cycles(np.zeros(1000), RATE).periodic


@pytest.mark.golden
def test_crossings_need_the_whole_swing() -> None:
    wave = np.array([-1.0, -0.1, 0.05, -0.05, 0.1, 1.0, -1.0, 0.0, 1.0])
    assert upward_crossings(wave, 0.0, 0.3).tolist() == [4, 7]


@pytest.mark.golden
@pytest.mark.parametrize(
    ("count", "settle", "expected"),
    [(0, 0, (0, 12)), (0, 2, (2, 12)), (10, 1, (1, 11)), (10, 5, (5, 12)), (5, 20, (9, 12))],
)
def test_which_cycles_are_kept(count: int, settle: int, expected: tuple[int, int]) -> None:
    chosen = choose_cycles(SteadyCycles(np.arange(13)), count, settle)
    assert (chosen[0], chosen[-1]) == expected


@settings(max_examples=30, deadline=None)
@given(st.floats(-200, 200), st.floats(5.0, 300.0))
@pytest.mark.property
def test_balanced_extremes_return_the_offset(offset: float, level: float) -> None:
    t = np.arange(5000) / RATE
    force = level * np.tanh(10 * np.cos(2 * np.pi * t)) + offset
    starts = np.array([0, 1000, 2000, 3000])
    assert balanced_extremes(force, starts) == pytest.approx(offset, abs=1e-3 * level)
    assert mean_over_cycles(force, starts) == pytest.approx(offset, abs=0.02 * level)


@pytest.mark.planted
def test_a_force_under_random_motion_and_drive_gives_its_offset_away() -> None:
    rng = np.random.default_rng(8)
    t = np.arange(24_000) / 2000.0
    tones, phases = rng.uniform(1.0, 20.0, 80), rng.uniform(0, 6.28, 80)
    waves = 2 * np.pi * tones[:, None] * t + phases[:, None]
    x = np.sum(2e-4 * np.sin(waves), axis=0)
    v = np.sum(2e-4 * (2 * np.pi * tones)[:, None] * np.cos(waves), axis=0)
    drive = np.repeat(rng.uniform(0, 2.25, 120), 200)
    force = (100 + 600 * drive) * np.tanh(v / 0.02) + 800 * v - 120.0 + 5 * rng.standard_normal(t.size)
    assert force_intercept(x, v, drive, force) == pytest.approx(-120.0, abs=0.02 * np.sqrt(np.mean(force**2)))
    assert abs(np.mean(force) + 120.0) > abs(force_intercept(x, v, drive, force) + 120.0)


@pytest.mark.golden
def test_a_drive_that_favours_a_side() -> None:
    t = np.arange(5000) / RATE
    starts = np.array([0, 1000, 2000, 3000])
    noise = 0.01 * np.random.default_rng(0).standard_normal(t.size)
    assert not drive_favours_a_side(2.0 + noise, starts)
    assert not drive_favours_a_side(2.0 * np.abs(np.sin(2 * np.pi * t + 1.0)) + noise, starts)
    assert drive_favours_a_side(2.0 * np.abs(np.sin(2 * np.pi * 0.3 * t)), starts)
    assert drive_favours_a_side(np.where(t % 1.0 < 0.5, 1.0, 2.0), starts)


@pytest.mark.planted
def test_two_swings_of_equal_height_about_different_middles_are_not_periodic() -> None:
    """An earthquake motion was called periodic, and the middle of its swings was removed as the sensor's offset."""
    t = np.arange(-100, 2300) / RATE
    swings = 7.5e-3 * np.sin(2 * np.pi * t)
    middles = 1.0e-3 * np.tanh((1.0 - t) / 0.02)
    assert not find_steady_cycles(swings + middles, RATE).periodic
    # about one middle the same swings are periodic, also if it drifts slowly
    for drift in (0.0, 0.5e-3):
        assert find_steady_cycles(swings + drift * t, RATE).starts.size == 3
