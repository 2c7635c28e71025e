"""The accelerometer of a bench: sign, gain, and the motion from both sensors."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.signals.accelerometer import Channels, acceleration_gain, with_accelerometer

RATE = 1000.0


def random_motion(seed: int, *, gain: float = 1.0, noise_m: float = 20e-6) -> tuple[Channels, Channels]:
    """Return true and recorded channels of a motion of 5 to 40 Hz with a velocity of 0.1 m/s RMS, 10 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(10_000) / RATE
    x, a = np.zeros(t.size), np.zeros(t.size)
    for frequency in np.arange(5.0, 40.0, 0.37):
        omega, phase = 2 * np.pi * frequency, rng.uniform(0, 2 * np.pi)
        x += 0.014 / omega * np.sin(omega * t + phase)
        a -= 0.014 * omega * np.sin(omega * t + phase)
    recorded = {
        "displacement": x + noise_m * rng.standard_normal(t.size),
        "acceleration": gain * (a + 0.2 * rng.standard_normal(t.size)),
    }
    return {"displacement": x, "acceleration": a}, recorded


def velocity_error(channels: Channels, true: Channels) -> float:
    error = np.gradient(channels["displacement"] - true["displacement"], 1 / RATE)
    return float(np.std(error[200:-200]))


@pytest.mark.planted
@pytest.mark.parametrize("gain", [1.0, -1.0, 9.81, -0.5])
def test_sign_and_scale_of_an_accelerometer_show(gain: float) -> None:
    rng = np.random.default_rng(1)
    t = np.arange(9000) / RATE
    omega = 2 * np.pi * 0.7
    x = 5e-3 * np.sin(omega * t) + 20e-6 * rng.standard_normal(t.size) - 0.03
    a = gain * (-(omega**2) * 5e-3 * np.sin(omega * t)) + 0.05 * rng.standard_normal(t.size) + 0.2
    assert acceleration_gain(x, a, RATE) == pytest.approx(gain, rel=0.05)


@pytest.mark.planted
@pytest.mark.parametrize("gain", [1.0, -1.0])
def test_motion_from_both_sensors_has_a_better_velocity(gain: float) -> None:
    true, recorded = random_motion(2, gain=gain)
    before = velocity_error(recorded, true)
    findings = with_accelerometer({"t": recorded}, RATE, "displacement-and-acceleration", "c")
    assert velocity_error(recorded, true) < 0.1 * before
    assert np.std(recorded["acceleration"] - true["acceleration"]) < 0.25
    assert any("the motion follows the displacement below" in line for line in findings)
    assert any("sign was reversed" in line for line in findings) == (gain < 0)


@pytest.mark.planted
def test_a_better_accelerometer_is_recommended_and_changes_nothing() -> None:
    _, recorded = random_motion(3)
    kept = recorded["displacement"].copy()
    findings = with_accelerometer({"t": recorded}, RATE, "displacement", "c")
    assert len(findings) == 1 and "consider prepare.motion=displacement-and-acceleration" in findings[0]
    assert np.array_equal(recorded["displacement"], kept)


@pytest.mark.planted
def test_no_recommendation_for_a_precise_displacement_or_without_agreement() -> None:
    _, precise = random_motion(4, noise_m=1e-8)
    assert with_accelerometer({"t": precise}, RATE, "displacement", "c") == []
    rng = np.random.default_rng(5)
    precise["acceleration"] = 20.0 * rng.standard_normal(precise["displacement"].size)
    assert not any("consider" in line for line in with_accelerometer({"t": precise}, RATE, "displacement", "c"))


@pytest.mark.property
def test_every_test_needs_an_acceleration() -> None:
    _, recorded = random_motion(6)
    tests = {"with": recorded, "without": {"displacement": recorded["displacement"]}}
    with pytest.raises(UserError, match="without") as caught:
        with_accelerometer(tests, RATE, "displacement-and-acceleration", "campaign.yaml")
    assert "prepare.motion" in str(caught.value)
