"""The loop with several dampers, against the loop with one, against exact linear responses, and by its energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mrpipe.artifacts import load_parameter_set
from mrpipe.control.central import CENTRAL, Sensors, central_regulator
from mrpipe.control.controller import Controller, build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import inverse_table
from mrpipe.control.kernel import (
    COMMAND_DISPLACEMENT,
    COMMAND_FORCE,
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_GROUND,
)
from mrpipe.control.lqg import Weights, lqg_observer
from mrpipe.control.together import LinearDevice, loop_matrix
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.dampers.plant import Phase, Step, build_chain
from mrpipe.effects.inertia import mass_step
from mrpipe.errors import UserError
from mrpipe.signals.discretisation import discretise_first_order
from mrpipe.simulation.excitation import recorded
from mrpipe.simulation.loop import LoopOptions, simulate_law
from mrpipe.simulation.sensors import SensorNoise
from mrpipe.simulation.several_dampers import LoopDamper, _noise, simulate_dampers
from mrpipe.simulation.windows import QUANTITIES, values_between
from mrpipe.structures import shear_frame
from mrpipe.structures.places import device_position
from mrpipe.structures.response import linear_response

FRAME = shear_frame([25.0] * 3, [3.0e4] * 3, np.full(3, 0.01), name="three storeys", source="test")
FIRST, SECOND = device_position(FRAME, 1), device_position(FRAME, 3, 2)
MODEL = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
INTERVAL = 0.02
TIME = np.arange(0.0, 4.0 + INTERVAL / 2, INTERVAL)
GROUND = np.random.default_rng(5).standard_normal(TIME.size) * np.exp(-(((TIME - 1.5) / 1.0) ** 2))
SHAKING = recorded(TIME, 2.0 * GROUND)
WEIGHTS = Weights(force=1e-4, force_noise_n=20.0)


def controller(law: str, gains: Gains | None = None, rate: float = 200.0) -> Controller:
    options = ControllerOptions(rate_hz=rate, residual_force_n=18.0, friction_rounding_m_s=0.01)
    return build_controller(law, gains or Gains(), options, inverse=inverse_table(MODEL), position=FIRST)


@pytest.mark.property
@pytest.mark.parametrize("form", ["bouc-wen", "dahl"])
@pytest.mark.parametrize("law", ["vd", "fdns"])
def test_one_damper_is_the_loop_with_one_damper(law: str, form: str) -> None:
    """The plain chain has a separate path in the loop with one damper; any other chain is run step by step."""
    gains = {"vd": Gains(c_n_s_m=300.0), "fdns": Gains(alpha_n_m=4000.0)}[law]
    chosen = controller(law, gains)
    chain = replace(MODEL, form=form).chain()
    options = LoopOptions(delay_s=0.005, driver_time_constant_s=0.01)
    expected = simulate_law(FRAME, chain, chosen, SHAKING, options, position=FIRST)
    found = simulate_dampers(FRAME, [LoopDamper("only", FIRST, chain, chosen)], SHAKING, options).first
    # both searches for the force end at the same difference, so that only their last corrections differ
    np.testing.assert_allclose(found.displacement, expected.displacement, atol=1e-6 * np.ptp(expected.displacement))
    np.testing.assert_allclose(found.force, expected.force, atol=1e-5 * np.ptp(expected.force))
    assert found.work_damper[-1] == pytest.approx(expected.work_damper[-1], rel=1e-5)


@pytest.mark.oracle
def test_two_linear_devices_are_a_linear_structure() -> None:
    dampers = [
        LoopDamper("a", FIRST, None, controller("vd", Gains(c_n_s_m=300.0))),
        LoopDamper("b", SECOND, None, controller("vdps", Gains(c_n_s_m=150.0, k_n_m=2000.0))),
    ]
    options = LoopOptions(plant_rate_hz=4000.0, tracking="unclipped", record_rate_hz=50.0)
    found = simulate_dampers(FRAME, dampers, SHAKING, options)
    first, second = np.outer(FIRST, FIRST), np.outer(SECOND, SECOND)
    inside = replace(
        FRAME,
        damping=FRAME.damping + 300.0 * first + 150.0 * second,
        stiffness=FRAME.stiffness + 2000.0 * second,
    )
    expected = linear_response(inside, 2.0 * GROUND, INTERVAL).displacement
    np.testing.assert_allclose(found.first.displacement, expected, atol=2e-5 * np.abs(expected).max())
    assert found.energy_balance_error < 1e-5


@pytest.mark.oracle
def test_two_dampers_at_different_drives_equal_an_integrator_of_scipy() -> None:
    """Structure, Bouc-Wen (2.1), (2.2) and lag of the drive of each damper, written out and integrated with LSODA."""
    drives = (0.0, 1.0)
    dampers = [
        LoopDamper(name, position, MODEL.chain(), build_controller(law, Gains(), ControllerOptions(drive_limit=1.0)))
        for name, law, position in (("a", "passive-off", FIRST), ("b", "passive-on", SECOND))
    ]
    options = LoopOptions(plant_rate_hz=8000.0, record_rate_hz=50.0)
    found = simulate_dampers(FRAME, dampers, SHAKING, options)
    numbers = MODEL.parameters

    def force(z: float, u: float, v: float) -> float:
        yielded = sum(numbers[f"yield_force_{letter}"] * u**power for power, letter in enumerate("abcd"))
        return float(yielded * z + (numbers["c0_a"] + numbers["c0_b"] * u) * v)

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        x, v, z, u = y[:3], y[3:6], y[6:8], y[8:10]
        strokes = (v[0], v[2] - v[1])  # damper a stands on the ground, b between floors 2 and 3
        of_a, of_b = (force(z[k], u[k], strokes[k]) for k in range(2))
        pull = np.array([-of_a, of_b, -of_b])
        ground = 2.0 * np.interp(t, TIME, GROUND)
        acceleration = np.linalg.solve(FRAME.mass, pull - FRAME.damping @ v - FRAME.stiffness @ x) - ground
        rates = [
            (w - 0.5 * abs(w) * z[k] * abs(z[k]) - 0.5 * w * z[k] ** 2) / numbers["yield_displacement"]
            for k, w in enumerate(strokes)
        ]
        return np.concatenate([v, acceleration, rates, numbers["eta"] * (np.array(drives) - u)])

    times = TIME[TIME <= 2.0]
    theirs = solve_ivp(slope, (0.0, 2.0), np.zeros(10), "LSODA", times, rtol=1e-8, atol=1e-10, max_step=0.002)
    ours = found.first.displacement[: times.size]
    assert np.ptp([item.force for item in found.dampers.values()], axis=1).min() > 20.0, "both dampers yield"
    np.testing.assert_allclose(found.first.time_s[: times.size], times, atol=1e-12)
    np.testing.assert_allclose(ours, theirs.y[:3].T, atol=2e-4 * np.abs(ours).max())


@pytest.mark.oracle
def test_a_brace_is_a_spring_in_series() -> None:
    """A dashpot behind a spring, against the exact step of the matrix with the dashpot's displacement as a state."""
    brace, c = 2.0e4, 300.0
    dampers = [LoopDamper("a", FIRST, None, controller("vd", Gains(c_n_s_m=c)), brace_n_m=brace)]
    options = LoopOptions(plant_rate_hz=4000.0, tracking="unclipped", record_rate_hz=50.0)
    found = simulate_dampers(FRAME, dampers, SHAKING, options).first
    A = loop_matrix(FRAME, [LinearDevice(FIRST, c, brace_n_m=brace)]).real
    B = np.zeros((A.shape[0], 1))
    B[3:6, 0] = -1.0
    step, now, after = discretise_first_order(A, B, INTERVAL)
    state, states = np.zeros(A.shape[0]), []
    for k in range(TIME.size):
        states.append(state)
        if k + 1 < TIME.size:
            state = step @ state + 2.0 * (now[:, 0] * GROUND[k] + after[:, 0] * GROUND[k + 1])
    expected = np.array(states)
    scale = np.abs(expected[:, 0]).max()
    np.testing.assert_allclose(found.displacement, expected[:, :3], atol=1e-4 * np.abs(expected[:, :3]).max())
    np.testing.assert_allclose(found.damper_displacement, expected[:, 6], atol=1e-3 * scale)
    assert found.energy_balance_error < 1e-5
    np.testing.assert_allclose(found.force, brace * (expected[:, 0] - expected[:, 6]), atol=2e-3 * np.ptp(found.force))


@pytest.mark.oracle
def test_masses_in_two_dampers_are_part_of_the_structure() -> None:
    """A force m w'x'' adds m w w' to the mass; the accelerations of one damper contain the force of the other."""
    low, high = device_position(FRAME, 2, 1), SECOND
    passive = build_controller("passive-off", Gains(), ControllerOptions(drive_limit=1.0))
    dampers, mass = [], FRAME.mass.copy()
    for name, position, kilograms in (("low", low, 3.0), ("high", high, 5.0)):
        step = Step("mass", Phase.FORCE_EFFECT, mass_step, np.array([kilograms, 0.0, 0.0]), 1)
        dampers.append(LoopDamper(name, position, build_chain([step]), passive))
        mass += kilograms * np.outer(position, position)
    options = LoopOptions(plant_rate_hz=4000.0, record_rate_hz=50.0)
    found = simulate_dampers(FRAME, dampers, SHAKING, options).first.displacement
    expected = linear_response(replace(FRAME, mass=mass), 2.0 * GROUND, INTERVAL).displacement
    np.testing.assert_allclose(found, expected, atol=2e-5 * np.abs(expected).max())


@pytest.mark.property
def test_energy_balance_with_braces_delay_and_noise() -> None:
    dampers = [
        LoopDamper("a", FIRST, MODEL.chain(), controller("vd", Gains(c_n_s_m=300.0)), brace_n_m=1.0e6),
        LoopDamper("b", SECOND, MODEL.chain(), controller("fdns", Gains(alpha_n_m=3000.0)), brace_n_m=5.0e5),
    ]
    options = LoopOptions(delay_s=0.01, driver_time_constant_s=0.01, noise=SensorNoise(20e-6, 0.1))
    found = simulate_dampers(FRAME, dampers, SHAKING, options, rng=np.random.default_rng(1))
    assert found.energy_balance_error < 1e-3
    assert all(item.work_damper[-1] > 0.0 for item in found.dampers.values())


@pytest.mark.property
def test_the_largest_values_of_a_run_count_every_damper() -> None:
    """The lower damper has the larger stroke and drive, the upper one the larger force."""
    dampers = [
        LoopDamper("a", FIRST, MODEL.chain(), controller("vd", Gains(c_n_s_m=1500.0)), brace_n_m=1.0e4),
        LoopDamper("b", SECOND, MODEL.chain(), controller("vd", Gains(c_n_s_m=1500.0))),
    ]
    found = simulate_dampers(FRAME, dampers, SHAKING, LoopOptions())
    edges = np.array([0.0, 2.0, 4.0])
    own = np.array([values_between(item, edges, False) for item in found.dampers.values()])
    np.testing.assert_array_equal(values_between(found.together, edges, False), own.max(axis=0))
    differ = [name for name, column in zip(QUANTITIES, np.moveaxis(own, 2, 0), strict=True) if np.ptp(column, 0).any()]
    assert differ == ["rms_stroke_m", "rms_drive", "max_stroke_m", "max_force_n"]
    largest = own[:, 0].argmax(axis=0)
    assert [largest[QUANTITIES.index(name)] for name in differ] == [0, 0, 0, 1]


@pytest.mark.property
def test_dampers_share_the_noise_of_the_accelerometers_and_have_their_own_of_the_displacement() -> None:
    dampers = [LoopDamper(name, FIRST, None, controller("vd", Gains(c_n_s_m=300.0))) for name in ("a", "b")]
    options = LoopOptions(noise=SensorNoise(20e-6, 0.1))
    first, second = _noise(dampers, options, 500, 3, np.random.default_rng(4))
    np.testing.assert_array_equal(first[:, MEASURED_FLOORS:], second[:, MEASURED_FLOORS:])
    np.testing.assert_array_equal(first[:, MEASURED_GROUND], second[:, MEASURED_GROUND])
    for channel, size in ((MEASURED_DISPLACEMENT, 20e-6), (MEASURED_ACCELERATION, 0.1)):
        both = np.array([first[:, channel], second[:, channel]])
        assert np.std(both) == pytest.approx(size, rel=0.5)
        assert abs(np.corrcoef(both)[0, 1]) < 0.2
    perfect = ControllerOptions(velocity="measured")
    dampers = [
        LoopDamper(name, place, None, build_controller("vd", Gains(c_n_s_m=c), perfect))
        for name, place, c in (("a", FIRST, 300.0), ("b", SECOND, 150.0))
    ]
    options = LoopOptions(tracking="ideal", record_rate_hz=200.0, noise=SensorNoise(20e-6, 0.1))
    response = simulate_dampers(FRAME, dampers, SHAKING, options, rng=np.random.default_rng(4)).dampers.values()
    read = np.array([item.commands[:, COMMAND_DISPLACEMENT] - item.damper_displacement for item in response])
    assert np.std(read) == pytest.approx(20e-6, rel=0.1) and abs(np.corrcoef(read)[0, 1]) < 0.1
    # each history of the desired force is that of its own damper
    for item in response:
        np.testing.assert_array_equal(item.desired_force, item.commands[:, COMMAND_FORCE])


def regulated(positions: np.ndarray, sensors: Sensors, rate: float = 500.0) -> tuple[list[LoopDamper], object]:
    options = ControllerOptions(rate_hz=rate, velocity="measured")
    weights = [WEIGHTS] * positions.shape[1]
    regulator = central_regulator(FRAME, positions, weights, sensors, 1.0 / rate)
    dampers = [
        LoopDamper(
            f"damper {place}", positions[:, place], None, build_controller(CENTRAL, Gains(), options), central=True
        )
        for place in range(positions.shape[1])
    ]
    return dampers, regulator


@pytest.mark.property
def test_central_regulator_of_one_damper_is_lqg() -> None:
    rate = 500.0
    options = ControllerOptions(rate_hz=rate, velocity="measured")
    observer = lqg_observer(FRAME, FIRST, WEIGHTS, 1.0 / rate)
    single = build_controller("lqg", Gains(), options, observer=observer, position=FIRST)
    ideal = LoopOptions(tracking="ideal")
    expected = simulate_law(FRAME, None, single, SHAKING, ideal, position=FIRST)
    dampers, regulator = regulated(FIRST[:, None], Sensors((0, 1, 2), (0,)))
    found = simulate_dampers(FRAME, dampers, SHAKING, ideal, regulator=regulator).first  # type: ignore[arg-type]
    np.testing.assert_allclose(found.displacement, expected.displacement, atol=1e-8 * np.ptp(expected.displacement))


@pytest.mark.property
def test_two_dampers_under_lqg_with_one_accelerometer_damp_the_response() -> None:
    ideal = LoopOptions(tracking="ideal")
    dampers, regulator = regulated(np.column_stack([FIRST, SECOND]), Sensors((2,), (0, 1)))
    found = simulate_dampers(FRAME, dampers, SHAKING, ideal, regulator=regulator).first  # type: ignore[arg-type]
    free = linear_response(FRAME, 2.0 * GROUND, INTERVAL).displacement[:, -1]
    tail = found.displacement[found.time_s > 2.5, -1]
    assert np.sqrt(np.mean(tail**2)) < 0.5 * np.sqrt(np.mean(free[TIME > 2.5] ** 2))


@pytest.mark.property
def test_a_brace_with_perfect_tracking_is_refused() -> None:
    damper = LoopDamper("a", FIRST, None, controller("vd", Gains(c_n_s_m=300.0)), brace_n_m=1e6)
    with pytest.raises(UserError, match="brace"):
        simulate_dampers(FRAME, [damper], SHAKING, LoopOptions(tracking="ideal"))
