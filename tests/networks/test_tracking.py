"""Round trip and viscous emulation with networks that are known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.networks.evaluation import error_figures
from mrpipe.networks.network import FeatureSpec, Network
from mrpipe.networks.tracking import emulate_viscous, round_trip, sinusoidal_motion
from tests.networks.rig import bench_history
from tests.networks.test_evaluation import linear_network

GAIN = 50.0


def inverse_of_gain(past: int = 2) -> Network:
    """Return i = |f| / GAIN, looking at the present force only."""
    weights = np.zeros(2 * (past + 1))
    weights[past + 1] = 1.0 / GAIN
    return linear_network(weights, FeatureSpec(("velocity", "force"), past, True, 200.0, "drive"))


def forward_of_gain() -> Network:
    """Return f = GAIN i (a damper without direction)."""
    return linear_network(np.array([0.0, 0.0, GAIN, 0.0]), FeatureSpec(("velocity", "drive"), 1, False, 200.0, "force"))


@pytest.mark.property
def test_round_trip_returns_the_force_within_the_limits_of_the_drive() -> None:
    history = bench_history()
    trip = round_trip(inverse_of_gain(), forward_of_gain(), history, 3.0)
    assert len(trip.sample) == history.samples - 3 * len(history.names)
    np.testing.assert_array_equal(trip.desired_n, history.channels["force"][trip.sample])
    np.testing.assert_allclose(trip.force_n, np.minimum(np.abs(trip.desired_n), 3.0 * GAIN), rtol=1e-9)
    assert trip.drive.max() <= 3.0 < trip.drive_raw.max()


@pytest.mark.property
def test_viscous_emulation_asks_for_c_v() -> None:
    history = bench_history()
    emulation = emulate_viscous(inverse_of_gain(), forward_of_gain(), history, 4.0, 1.0, 5e-3, 2000.0)
    np.testing.assert_allclose(emulation.tracking.desired_n, 2000.0 * emulation.velocity_m_s, rtol=1e-12)
    assert np.max(np.abs(emulation.velocity_m_s)) == pytest.approx(2.0 * np.pi * 5e-3, rel=1e-6)
    # the damper of this test pushes one way only: right while the velocity is positive, and then exactly
    forth = emulation.velocity_m_s > 0.0
    assert error_figures(emulation.tracking.desired_n[forth], emulation.tracking.force_n[forth]).nrmse < 1e-9
    assert emulation.negative_share == 0.0


@pytest.mark.property
def test_defaults_of_the_emulation_stay_within_the_campaign() -> None:
    history = bench_history()
    emulation = emulate_viscous(inverse_of_gain(), forward_of_gain(), history, 4.0, 1.0)
    assert emulation.amplitude_m == pytest.approx(5e-3, rel=0.02)
    peak = emulation.damping_n_s_m * emulation.amplitude_m * 2.0 * np.pi
    assert 0.3 < peak / np.abs(history.channels["force"]).max() < 0.6


@pytest.mark.property
def test_sinusoidal_motion_is_consistent() -> None:
    motion = sinusoidal_motion(0.01, 1.5, 1000.0, 2000.0, "A")
    speed = np.gradient(motion.channels["displacement"], 1.0 / 2000.0)
    np.testing.assert_allclose(speed[1:-1], motion.channels["velocity"][1:-1], atol=1e-5)
