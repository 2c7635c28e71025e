"""The plant step against what is known exactly, and against two other ways to run it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from mrpipe.control import ControllerOptions, Gains, build_controller
from mrpipe.control.limits import limiting_modes
from mrpipe.dampers.plant import build_chain
from mrpipe.errors import DivergedError, UserError
from mrpipe.simulation import LoopOptions, SensorNoise, at_rest, harmonic, recorded, simulate_law, sweep
from mrpipe.simulation.excitation import amplitude_for
from mrpipe.simulation.indices import indices
from mrpipe.simulation.reference import ReferenceController, reference_loop
from mrpipe.simulation.sensors import MISSING, STUCK, ZERO, SensorFault
from mrpipe.simulation.windows import values_between
from mrpipe.structures import Frame, frequency_response, natural_modes, state_space
from mrpipe.thesis.gains import THESIS_GAINS
from tests.control.conftest import random_network


def passive(**options):
    return build_controller("passive-off", Gains(), ControllerOptions(drive_limit=4.0, **options))


def nothing():
    return build_chain([])


@pytest.mark.property
def test_undamped_frame_without_damper_swings_as_the_cosine(rig):
    frame = Frame(rig.frame.mass, np.zeros((5, 5)), rig.frame.stiffness)
    modes = natural_modes(frame)
    start = np.concatenate([modes.mode_shapes[:, 0] + 0.3 * modes.mode_shapes[:, 2], np.zeros(5)]) * 0.01
    response = simulate_law(frame, nothing(), passive(), at_rest(20.0), LoopOptions(), initial_state=start)
    omega = modes.angular_frequencies
    exact = 0.01 * (
        np.outer(np.cos(omega[0] * response.time_s), modes.mode_shapes[:, 0])
        + 0.3 * np.outer(np.cos(omega[2] * response.time_s), modes.mode_shapes[:, 2])
    )
    assert np.max(np.abs(response.displacement - exact)) < 1e-6 * np.max(np.abs(exact))
    assert np.ptp(response.energy) < 1e-6 * response.energy[0]


@pytest.mark.property
def test_viscous_damper_decays_as_the_matrix_exponential(rig):
    controller = build_controller("vd", Gains(650.0), ControllerOptions())
    start = np.concatenate([0.03 * np.array([0.35, 0.6, 0.77, 0.92, 1.0]), np.zeros(5)])
    options = LoopOptions(tracking="continuous", plant_rate_hz=8000.0)
    response = simulate_law(rig.frame, None, controller, at_rest(3.0), options, initial_state=start)
    damped = Frame(rig.frame.mass, rig.frame.damping + 650.0 * np.outer(*[rig.position] * 2), rig.frame.stiffness)
    A = state_space(damped).A
    exact = np.array([expm(A * t) @ start for t in response.time_s[::500]])[:, :5]
    assert np.max(np.abs(response.displacement[::500] - exact)) < 1e-6 * 0.03


@pytest.mark.property
def test_viscous_damper_under_harmonic_motion_reaches_its_frequency_response(rig):
    controller = build_controller("vd", Gains(650.0), ControllerOptions())
    excitation = harmonic(rig.ideal_amplitude, 8.0, cycles=60, settling_cycles=50)
    options = LoopOptions(tracking="continuous", plant_rate_hz=8000.0)
    response = simulate_law(rig.frame, None, controller, excitation, options)
    damped = Frame(rig.frame.mass, rig.frame.damping + 650.0 * np.outer(*[rig.position] * 2), rig.frame.stiffness)
    gain = np.abs(frequency_response(damped, [8.0], absolute_acceleration=False)[0])
    t = response.time_s
    steady = (t >= excitation.steady_s[0]) & (t < excitation.steady_s[1])
    basis = np.column_stack([np.sin(8.0 * t[steady]), np.cos(8.0 * t[steady])])
    amplitude = np.hypot(*np.linalg.lstsq(basis, response.displacement[steady], rcond=None)[0])
    np.testing.assert_allclose(amplitude, rig.ideal_amplitude * gain, rtol=1e-6)


@pytest.mark.property
def test_rotations_that_nothing_moves_change_no_result(rig):
    """In a frame with torsion the floors and the top are the translations that move with the ground."""
    n = rig.frame.floors
    places = 3 * np.arange(n)

    def among_rotations(matrix, value):
        whole = value * np.eye(3 * n)
        whole[np.ix_(places, places)] = matrix
        return whole

    influence = np.zeros(3 * n)
    influence[places] = 1.0
    frame = rig.frame
    spatial = Frame(
        among_rotations(frame.mass, 2.0),
        among_rotations(frame.damping, 1.0),
        among_rotations(frame.stiffness, 5e3),
        "with torsion",
        influence,
    )
    excitation = harmonic(rig.ideal_amplitude, 8.0, cycles=12, settling_cycles=6, decay_s=4.0)
    options = LoopOptions(tracking="continuous")
    judged = {"residual_force_n": 18.0, "drive_limit": 4.0}
    found = []
    for structure in (frame, spatial):
        position = np.eye(structure.floors)[0]
        controller = build_controller("vd", Gains(650.0), ControllerOptions())
        response = simulate_law(structure, None, controller, excitation, options, position=position)
        windows = values_between(response, np.array([1.0, 4.0, 8.0]), absolute=True)
        modes = limiting_modes(structure, position)
        amplitude = amplitude_for(structure, position, 650.0, 8.0, 0.0243)
        found.append((indices(response, excitation, **judged), windows, modes.top_0, amplitude))
    (plain, plain_windows, *plain_rest), (twisted, twisted_windows, *twisted_rest) = found
    assert spatial.top == 3 * n - 3
    for key in plain:
        if key.startswith(("rms_", "peak_", "damping_ratio")):
            assert twisted[key] == pytest.approx(plain[key], rel=1e-6), key
    np.testing.assert_allclose(twisted_windows, plain_windows, rtol=1e-6)
    assert twisted_rest == pytest.approx(plain_rest, rel=1e-6)


@pytest.mark.oracle
def test_passive_damper_equals_an_integrator_of_scipy(rig):
    """Bouc-Wen in time, (2.1), (2.2), by LSODA with tight tolerances."""
    numbers = rig.damper.parameters
    space = state_space(rig.frame, -rig.position)
    yielded, viscous = float(rig.damper.yield_force(0.0)), float(rig.damper.viscosity(0.0))

    def slope(t, y):
        v, zeta = y[5], y[10]
        ground = -0.5 * np.sin(8.0 * t)
        rate = (v - (0.5 * abs(v) * zeta * abs(zeta) + 0.5 * v * zeta**2)) / numbers["yield_displacement"]
        return np.append(space.A @ y[:10] + space.B @ [ground, yielded * zeta + viscous * v], rate)

    times = np.linspace(0.0, 4.0, 41)
    theirs = solve_ivp(slope, (0.0, 4.0), np.zeros(11), "LSODA", times, rtol=1e-9, atol=1e-12, max_step=0.002)
    excitation = harmonic(0.5, 8.0, cycles=6, settling_cycles=1, ramp_cycles=0.0)
    ours = simulate_law(
        rig.frame, rig.damper.chain(), passive(), excitation, LoopOptions(plant_rate_hz=8000.0, record_rate_hz=1000.0)
    )
    at = np.searchsorted(ours.time_s, times - 1e-9)
    difference = np.max(np.abs(ours.displacement[at] - theirs.y[:5].T))
    assert difference < 1e-4 * np.max(np.abs(theirs.y[:5]))


@pytest.mark.oracle
@pytest.mark.parametrize("request_form", ["steady", "history"])
@pytest.mark.parametrize("law", ["vd", "vdns", "fdns"])
def test_compiled_loop_equals_the_plain_one(rig, law, request_form):
    options = ControllerOptions(
        drive_limit=4.0, inverse_request=request_form, residual_force_n=18.0, friction_rounding_m_s=0.0125
    )
    network = random_network(("velocity", "force"), "drive", 3, True)
    gains = THESIS_GAINS[law]
    excitation = harmonic(0.7, 8.0, cycles=3, settling_cycles=1)
    loop = LoopOptions(plant_rate_hz=1000.0, record_rate_hz=1000.0)
    controller = build_controller(law, gains, options, inverse=network)
    ours = simulate_law(rig.frame, rig.damper.chain(), controller, excitation, loop)
    ground = excitation.at(ours.time_s)
    plain = ReferenceController(gains, options, network)
    displacement, force, drive = reference_loop(
        rig.frame, rig.damper, plain, ground, per_sample=5, position=rig.position
    )
    assert np.ptp(drive) > 0.5
    # ours is the drive that acted up to an instant, theirs the one that acts from it on; a switch that falls one sample
    # later in one of the two would show as a difference of amperes
    np.testing.assert_allclose(ours.drive[1:], drive[:-1], atol=1e-3 * rig.damper.drive_limit)
    np.testing.assert_allclose(ours.displacement, displacement, atol=2e-5 * np.max(np.abs(displacement)))
    np.testing.assert_allclose(ours.force[1:], force[1:], atol=1e-3 * np.max(np.abs(force)))


@pytest.mark.property
@pytest.mark.parametrize("delay", [0.0, 0.002, 0.007])
def test_delay_shifts_the_drive(rig, delay):
    options = LoopOptions(delay_s=delay, record_rate_hz=2000.0)
    response = simulate_law(rig.frame, rig.damper.chain(), rig.controller("vd"), rig.excitation(0.7, 6), options)
    commands = response.commands[:, 0]
    index = int(np.argmax(commands))
    at = response.command_time_s[index] + delay
    shown = response.drive[np.searchsorted(response.time_s, at + 1e-9)]
    assert shown == pytest.approx(commands[index])
    before = response.drive[np.searchsorted(response.time_s, at - 1e-9) - 1]
    assert before == pytest.approx(commands[index - 1])


@pytest.mark.property
def test_driver_lag_reaches_the_command_exponentially(rig):
    options = LoopOptions(driver_time_constant_s=0.01, record_rate_hz=2000.0)
    slow = simulate_law(rig.frame, rig.damper.chain(), rig.controller("vd"), rig.excitation(0.7, 6), options)
    change = np.diff(slow.drive)
    step = 1.0 - np.exp(-0.05)
    held = np.repeat(slow.commands[:, 0], 10)[: len(change)]
    np.testing.assert_allclose(change, step * (held - slow.drive[:-1]), atol=1e-9)


@pytest.mark.golden
def test_other_excitations(rig):
    swept = sweep(0.3, 0.5, 3.0, 20.0)
    response = simulate_law(rig.frame, rig.damper.chain(), rig.controller("vd"), swept, LoopOptions())
    assert response.energy_balance_error < 1e-4
    t = np.array([0.0, 1.0, 2.0])
    record = recorded(t + 5.0, np.array([0.0, 1.0, 0.0]), scale=2.0)
    assert record.duration_s == 2.0
    np.testing.assert_allclose(record.at(np.array([0.5, 1.0, 1.5])), [1.0, 2.0, 1.0])


@pytest.mark.golden
def test_unclipped_instability_is_told_as_divergence(rig):
    folded = Frame(rig.frame.mass, np.zeros((5, 5)), rig.frame.stiffness - 50000.0 * np.diag([1.0, 0, 0, 0, 0]))
    start = np.concatenate([np.full(5, 1e-3), np.zeros(5)])
    with pytest.raises(DivergedError, match="grows without bound"), np.errstate(all="ignore"):
        simulate_law(folded, nothing(), passive(), at_rest(12.0), LoopOptions(), initial_state=start)


@pytest.mark.golden
def test_bad_input_is_told_in_one_line(rig):
    singular = Frame(np.diag([1.0, 1, 1, 1, 0]), np.zeros((5, 5)), np.eye(5), "mine")
    viscous = rig.controller("vd")
    rest = at_rest(1.0)
    cases = [
        (lambda: simulate_law(rig.frame, None, viscous, rest), "damper: there is none"),
        (lambda: simulate_law(singular, nothing(), viscous, rest), "frame mine: mass: is singular"),
        (lambda: simulate_law(rig.frame, nothing(), viscous, rest, position=np.ones(3)), "has 3 entries"),
        (lambda: simulate_law(rig.frame, nothing(), viscous, rest, LoopOptions(delay_s=-1.0)), "is negative"),
        (lambda: simulate_law(rig.frame, None, rig.controller("fdns"), rest, LoopOptions(tracking="continuous")),
            "law fdns cannot run in continuous time"),
        (lambda: build_controller("vdx", Gains(), ControllerOptions()), "is not a control law"),
        (lambda: build_controller("fdns", Gains(), ControllerOptions()), "fdns: has no gains; calibrate it first"),
        (lambda: build_controller("nnc", Gains(), ControllerOptions()), "nnc: has no trained network"),
        (lambda: build_controller("lqg", Gains(), ControllerOptions()), "lqg: has no observer"),
        (lambda: build_controller("vd", Gains(1.0), ControllerOptions(low_pass_hz=120.0)), "is not below half of 200"),
        (lambda: rig.controller("lqg", rate_hz=200.0) and build_controller(
            "lqg", Gains(), ControllerOptions(rate_hz=500.0), observer=_observer(rig)), "made for another rate"),
    ]  # fmt: skip
    for call, words in cases:
        with pytest.raises(UserError, match=words) as caught:
            call()
        assert "\n" not in str(caught.value)


def _observer(rig):
    from mrpipe.control.lqg import Weights, lqg_observer

    return lqg_observer(rig.frame, rig.position, Weights(), 0.005)


@pytest.mark.property
def test_same_seed_same_numbers(rig):
    options = LoopOptions(noise=SensorNoise(2e-5, 0.1))
    first, _ = rig.run("fdns", options)
    second, _ = rig.run("fdns", options)
    assert np.array_equal(first.displacement, second.displacement)


@pytest.mark.property
@pytest.mark.parametrize("mark", [MISSING, ZERO, STUCK])
@pytest.mark.parametrize("length", [1, 12])
def test_sensor_faults_cost_little_and_never_break_the_loop(rig, mark, length):
    """One sample in a hundred is missing, zero or late, or gaps of 60 ms: the loop goes on and stays controlled."""
    _, values = rig.run("vd", LoopOptions())
    fault = SensorFault(mark, "all", 0.01 / length, length)
    response, faulty = rig.run("vd", LoopOptions(fault=fault))
    assert np.all(np.isfinite(response.commands))
    assert faulty["rms_x_top_m"] < 1.15 * values["rms_x_top_m"]
    assert (faulty["faulty_share"] > 0.002) == bool(np.isnan(mark))
    assert values["faulty_share"] == 0.0
