"""Clocks of the sensors of ambient tests: found where they differ, and none where they agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.ambient.clocks import ambient_clocks, synchronised
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, Place
from tests.modal.towers import FINE, Sensors, ambient_test, random_tower

pytestmark = pytest.mark.planted
RATE = 50.0
DURATION_S = 900.0


@pytest.fixture(scope="module")
def tower():
    return random_tower(np.random.default_rng(21), floors=4)


@pytest.fixture(scope="module")
def fine(tower):
    """Responses at four times the rate of the sensors, so that each sensor can be read with its own clock."""
    return ambient_test(tower, np.random.default_rng(22), Sensors(noise=0.0), rate=RATE * FINE, duration_s=DURATION_S)


def read(fine, delays_s, drifts=(0.0,) * 4, noise=0.03):
    """Return the test that sensors record whose clocks are late by a delay and run at slightly different rates."""
    ticks = np.arange(fine.shape[0]) / (RATE * FINE)
    time = np.arange(fine.shape[0] // FINE) / RATE
    rng = np.random.default_rng(23)
    seen = np.column_stack([
        np.interp(time - delay - drift * (time - time[-1] / 2), ticks, column)
        for column, delay, drift in zip(fine.T, delays_s, drifts, strict=True)
    ])  # fmt: skip
    seen += noise * seen.std(axis=0) * rng.standard_normal(seen.shape)
    places = tuple(Place(floor) for floor in range(1, 5))
    return FrameTest("wind", "ambient", RATE, None, seen, (False,) * 4, places=places)


def middle_delays(clocks, sensors):
    """Delays in the middle of the record, zero where none was found."""
    found = {clock.sensor: clock.offset_s + clock.drift * DURATION_S / 2 for clock in clocks}
    return np.array([found.get(sensor, 0.0) for sensor in sensors])


def test_clocks_that_agree_get_no_delay(fine):
    assert ambient_clocks(read(fine, (0.0,) * 4), 0.2) == []


def test_delays_are_found_against_the_median_of_the_sensors(fine):
    truth = np.array([0.018, -0.009, 0.001, -0.024])
    test = read(fine, truth)
    found = middle_delays(ambient_clocks(test, 0.2), test.sensors)
    assert found - found[0] == pytest.approx(truth - truth[0], abs=1e-3)
    assert np.median(found) == pytest.approx(0.0, abs=1e-3)


def test_a_drift_is_found_and_taken_out(fine):
    drifts = np.array([6e-5, 0.0, -5e-5, 0.0])
    test = read(fine, (0.01, 0.0, 0.0, -0.01), drifts)
    moved, clocks = synchronised([test], (0.2, 0.0), IdentificationOptions())
    rates = {clock.sensor: clock.drift for clock in clocks}
    found = np.array([rates.get(sensor, 0.0) for sensor in test.sensors])
    # 7e-6 over the half record is 0.08 rad at the highest mode: what the coherency of 15 min determines
    assert found - np.median(found) == pytest.approx(drifts - np.median(drifts), abs=1e-5)
    rest = middle_delays(ambient_clocks(moved[0], 0.2), test.sensors)
    assert np.abs(rest).max() < 0.003


def test_noise_alone_has_no_clocks(fine):
    test = read(fine, (0.0,) * 4)
    noise = np.random.default_rng(5).standard_normal(test.responses.shape)
    assert ambient_clocks(replace(test, responses=noise), 0.2, 20.0) == []


def test_the_correction_can_be_switched_off(fine):
    test = read(fine, (0.02, 0.0, 0.0, -0.02))
    kept, clocks = synchronised([test], (0.2, 0.0), IdentificationOptions(clock_correction=False))
    assert clocks == () and kept == (test,)
