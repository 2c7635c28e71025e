"""The parts of the controller one by one: velocity, amplitude, clipping, inverse, switch, networks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.artifacts import load_parameter_set
from mrpipe.control import ControllerOptions, Gains, build_controller, inverse_table
from mrpipe.control.kernel import (
    COMMAND_AMPLITUDE,
    COMMAND_DRIVE,
    COMMAND_FORCE,
    COMMAND_INVERSE,
    COMMAND_UNCLIPPED,
    COMMAND_VELOCITY,
)
from mrpipe.control.linearisation import equivalent_stiffness, friction_stiffness
from mrpipe.control.neural import ReferenceOptions, network_force, train_reference
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.errors import UserError
from mrpipe.networks.network import averaged, lagged
from mrpipe.thesis.gains import THESIS_GAINS
from tests.control.conftest import random_network
from tests.control.stepped import commands_of

SET_C = inverse_table(damper_from_parameter_set(load_parameter_set("dampers", "set-c")))


def run(controller, displacement, acceleration, velocity=None):
    measured = np.zeros((len(displacement), controller.measured_size))
    measured[:, 0], measured[:, 1] = displacement, acceleration
    measured[:, 2] = 0.0 if velocity is None else velocity
    return commands_of(controller, measured)


def motion(rate, seconds, noise=None, omega=8.0, amplitude=0.009):
    t = np.arange(int(seconds * rate)) / rate
    x = amplitude * np.sin(omega * t)
    a = -(omega**2) * x
    if noise is not None:
        x = x + 20e-6 * noise.standard_normal(len(t))
        a = a + 0.1 * noise.standard_normal(len(t))
    return t, x, a, amplitude * omega * np.cos(omega * t)


@pytest.mark.oracle
def test_the_inverse_table_is_zero_below_the_force_without_drive_and_the_limit_above_the_largest():
    """f = F(u) + c0(u) v of set C, (2.1) to (2.3): between both forces the drive gives the desired one."""
    speed = np.linspace(0.01, 0.45, 60)
    for c, expected in ((20.0, "none"), (5000.0, "limit"), (400.0, "between")):
        options = ControllerOptions(velocity="measured", low_pass_hz=None, drive_limit=4.0)
        controller = build_controller("vd", Gains(c_n_s_m=c), options, inverse=SET_C)
        found = run(controller, np.zeros(60), np.zeros(60), speed)
        drive, force = found[:, COMMAND_INVERSE], found[:, COMMAND_FORCE]
        np.testing.assert_allclose(force, c * speed)
        yielded = np.polyval([-1.785, 20.03, 5.03, 19.92], drive) * np.sqrt(3000.0 / 2460.0)
        reached = yielded + (50.0 + 75.0 * drive) * speed
        if expected == "none":
            assert np.all(drive == 0.0) and np.all(reached > force)
        else:
            inside = (drive > 0.0) & (drive < 4.0)
            np.testing.assert_allclose(reached[inside], force[inside], rtol=1e-3)
            assert np.all(reached[drive == 0.0] >= force[drive == 0.0])
            assert np.all(reached[drive == 4.0] <= force[drive == 4.0])
            assert np.any(drive == 4.0) == (expected == "limit") and np.any(inside)


@pytest.mark.literature
def test_velocity_error_of_filter_and_difference():
    rng = np.random.default_rng(2)
    _, x, a, v = motion(1000.0, 20.0, rng)
    errors = {}
    for kind in ("kalman", "difference"):
        controller = build_controller(
            "vd", Gains(650.0), ControllerOptions(rate_hz=1000.0, velocity=kind), inverse=SET_C
        )
        found = run(controller, x, a)[:, COMMAND_VELOCITY]
        errors[kind] = float(np.sqrt(np.mean((found - v)[1000:] ** 2)))
    assert 0.4e-3 < errors["kalman"] < 0.8e-3
    assert errors["difference"] > 16e-3


@pytest.mark.literature
def test_bias_costs_velocity_and_a_bias_state_removes_it():
    _, x, a, v = motion(1000.0, 60.0)
    found = {}
    for drift in (0.0, 0.01):
        controller = build_controller(
            "vd", Gains(650.0), ControllerOptions(rate_hz=1000.0, bias_drift_m_s2=drift), inverse=SET_C
        )
        error = run(controller, x, a + 0.2)[:, COMMAND_VELOCITY] - v
        found[drift] = float(np.mean(error[-20000:]))
    assert found[0.0] == pytest.approx(0.2 * 100.0 / 5000.0, rel=0.06)
    assert abs(found[0.01]) < 0.02 * found[0.0]


@pytest.mark.property
@pytest.mark.parametrize("rate", [200.0, 500.0])
def test_amplitude_is_the_most_recent_extremum_in_spite_of_noise(rate):
    rng = np.random.default_rng(4)
    t, x, a, _ = motion(rate, 12.0)
    envelope = np.where(t < 6.0, 1.0, 0.5)
    noisy = envelope * x + 20e-6 * rng.standard_normal(len(t))
    controller = build_controller("fdns", Gains(alpha_n_m=3000.0), ControllerOptions(rate_hz=rate), inverse=SET_C)
    amplitude = run(controller, noisy, envelope * a + 0.1 * rng.standard_normal(len(t)))[:, COMMAND_AMPLITUDE]
    assert np.max(np.abs(amplitude[(t > 2.0) & (t < 6.0)] - 0.009)) < 0.02 * 0.009
    assert np.max(np.abs(amplitude[t > 7.5] - 0.0045)) < 0.04 * 0.0045


@pytest.mark.property
def test_amplitude_of_a_stuck_damper_is_forgotten():
    t, x, a, _ = motion(200.0, 6.0)
    x, a = np.where(t < 2.945, x, x[589]), np.where(t < 2.945, a, 0.0)
    x = np.where(t > 3.5, 0.001, x)
    controller = build_controller("fdns", Gains(alpha_n_m=3000.0), ControllerOptions(), inverse=SET_C)
    amplitude = run(controller, x, a)[:, COMMAND_AMPLITUDE]
    assert amplitude[t > 5.0].max() < 0.0015 < amplitude[500]


@pytest.mark.property
@settings(max_examples=25, deadline=None)
@given(law=st.sampled_from(["vd", "vdps", "vdns", "fdns"]), seed=st.integers(0, 1000), size=st.floats(1e-4, 0.05))
def test_what_leaves_the_controller_is_dissipative_and_within_limits(law, seed, size):
    rng = np.random.default_rng(seed)
    x = size * np.cumsum(rng.standard_normal(300)) / 10.0
    v = np.gradient(x) * 200.0
    controller = build_controller(law, THESIS_GAINS[law], ControllerOptions(velocity="measured"), inverse=SET_C)
    commands = run(controller, x, np.zeros(300), v)
    assert np.all(commands[:, COMMAND_FORCE] * v >= 0.0)
    assert np.all((commands[:, COMMAND_DRIVE] >= 0.0) & (commands[:, COMMAND_DRIVE] <= 4.0))
    kept = commands[:, COMMAND_FORCE] != 0.0
    assert np.all(commands[kept, COMMAND_FORCE] == commands[kept, COMMAND_UNCLIPPED])


@pytest.mark.property
@settings(max_examples=60, deadline=None)
@given(speed=st.floats(0.0, 0.5), drive=st.floats(0.01, 3.99))
def test_inverse_table_gives_the_drive_back(speed, drive):
    model = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    force = float(model.quasi_static_force(max(speed, 1e-9), drive))
    # the law asks for just this force at this velocity
    gains = Gains(c_n_s_m=force / max(speed, 1e-9))
    options = ControllerOptions(velocity="measured", residual_force_n=0.0, low_pass_hz=None)
    controller = build_controller("vd", gains, options, inverse=SET_C)
    velocity = np.full(3, max(speed, 1e-9))
    asked = run(controller, np.zeros(3), np.zeros(3), velocity)[-1, COMMAND_INVERSE]
    assert float(model.quasi_static_force(max(speed, 1e-9), asked)) == pytest.approx(force, rel=2e-3, abs=0.05)


@pytest.mark.property
def test_delay_of_the_low_pass_sets_its_cut_off():
    """Paper P5 filters the current so that it is 0.05 s late; the setting names that delay."""
    from scipy.signal import butter, group_delay

    from mrpipe.control.settings import ControllerSettings

    assert ControllerSettings(low_pass_hz=60.0).cutoff_hz == 60.0
    settings = ControllerSettings(low_pass_hz=60.0, low_pass_delay_s=0.05)
    assert settings.cutoff_hz == pytest.approx(4.50, abs=0.01)
    _, delay = group_delay(butter(2, settings.cutoff_hz, fs=500.0), w=[0.1], fs=500.0)
    assert delay[0] / 500.0 == pytest.approx(0.05, rel=0.01)
    assert ControllerSettings(low_pass_hz=None).cutoff_hz is None


@pytest.mark.literature
def test_switch_and_low_pass():
    _, x, a, v = motion(200.0, 4.0)
    plain = {"velocity": "measured", "low_pass_hz": None, "residual_force_n": 18.0}
    with_switch = run(build_controller("vd", Gains(650.0), ControllerOptions(**plain), inverse=SET_C), x, a, v)
    small = np.abs(with_switch[:, COMMAND_FORCE]) < 18.0
    assert small.any() and np.all(with_switch[small, COMMAND_DRIVE] == 0.0)
    options = ControllerOptions(velocity="measured", low_pass_hz=60.0, residual_force_n=0.0)
    from scipy.signal import butter, lfilter

    filtered = run(build_controller("vd", Gains(650.0), options, inverse=SET_C), x, a, v)
    b, a_coefficients = butter(2, 60.0, fs=200.0)
    expected = lfilter(b, a_coefficients, filtered[:, COMMAND_INVERSE])
    np.testing.assert_allclose(filtered[:, COMMAND_DRIVE], np.clip(expected, 0.0, 4.0), atol=1e-12)


@pytest.mark.property
@pytest.mark.parametrize("rate", [200.0, 400.0, 500.0])
def test_inverse_network_sees_its_own_lags_whatever_the_rate(rate):
    """At 500 Hz the past values of a network of 200 Hz lie between samples."""
    network = random_network(("velocity", "force"), "drive", 3, True)
    _, x, a, v = motion(rate, 4.0)
    options = ControllerOptions(rate_hz=rate, velocity="measured", inverse_request="history", residual_force_n=0.0)
    asked = run(build_controller("vd", Gains(650.0), options, inverse=network), x, a, v)[:, COMMAND_INVERSE]
    t = np.arange(0.0, 4.0, 1.0 / 200.0)
    wanted = network.predict(lagged([0.072 * np.cos(8.0 * t), 650.0 * 0.072 * np.cos(8.0 * t)], 3, absolute=True))
    both = np.interp(t[3:], np.arange(len(asked)) / rate, asked)
    assert np.max(np.abs(both - wanted)[20:]) < (1e-9 if rate == 200.0 else 0.02)


@pytest.mark.property
def test_steady_request_asks_for_what_would_hold_the_force():
    """A desired force that jumps at a reversal has no history that a damper's measured force could have."""
    network = random_network(("velocity", "force"), "drive", 3, True)
    _, x, a, v = motion(200.0, 4.0)
    options = ControllerOptions(velocity="measured", residual_force_n=0.0)
    commands = run(build_controller("vdns", Gains(250.0, -4500.0), options, inverse=network), x, a, v)
    present = np.abs(commands[:, [COMMAND_VELOCITY, COMMAND_FORCE]])
    np.testing.assert_allclose(commands[:, COMMAND_INVERSE], network.predict(np.repeat(present, 4, axis=1)), atol=1e-10)


@pytest.mark.property
def test_several_networks_side_by_side_are_one_inverse():
    """The mean of twelve, wider than any single one would be, is what the controller asks."""
    first = random_network(("velocity", "force"), "drive", 3, True)
    others = (random_network(("velocity", "force"), "drive", 3, True, seed) for seed in range(2, 13))
    members = [first, *(replace(first, weights=item.weights, biases=item.biases) for item in others)]
    _, x, a, v = motion(200.0, 2.0)
    options = ControllerOptions(velocity="measured", residual_force_n=0.0)
    commands = run(build_controller("vd", Gains(650.0), options, inverse=averaged(members)), x, a, v)
    present = np.repeat(np.abs(commands[:, [COMMAND_VELOCITY, COMMAND_FORCE]]), 4, axis=1)
    wanted = np.mean([member.predict(present) for member in members], axis=0)
    np.testing.assert_allclose(commands[:, COMMAND_INVERSE], wanted, atol=1e-10)


@pytest.mark.literature
def test_neural_reference_imitates_friction_with_negative_stiffness():
    amplitudes = tuple(0.0093 * np.geomspace(0.2, 2.0, 7))
    frequencies = tuple(1.273 * np.geomspace(0.625, 1.6, 7))
    options = ReferenceOptions(
        3000.0, amplitudes, frequencies, rounding_m_s=0.0125, disturbances_rad_s=(24.3, 38.4, 49.3, 56.5)
    )
    trained = train_reference(options, np.random.default_rng(1))
    assert trained.network.architecture == "12-6-6-1"
    assert trained.verification_nrmse < 0.12
    for amplitude in (0.008, 0.0093, 0.015):
        H = equivalent_stiffness(lambda x, v: network_force(trained.network, x, v), amplitude, 8.0)
        assert abs(H / friction_stiffness(3000.0) - 1.0) < 0.1


@pytest.mark.golden
def test_a_damper_without_control_has_no_inverse():
    model = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    from dataclasses import replace

    with pytest.raises(UserError, match="drive_limit"):
        inverse_table(replace(model, drive_limit=float("inf")))
    flat = {name: 0.0 if name[-2:] in ("_b", "_c", "_d") else value for name, value in model.parameters.items()}
    with pytest.raises(UserError, match="does not rise with the drive"):
        inverse_table(replace(model, parameters=flat))
