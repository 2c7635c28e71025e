"""The loop of several dampers under sampled, clipped laws, against an integration that shares no code with it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.control.central import CENTRAL, Sensors, central_regulator
from mrpipe.control.controller import Controller, build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import inverse_table
from mrpipe.control.kernel import COMMAND_DRIVE, COMMAND_FORCE
from mrpipe.control.lqg import Weights
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.simulation.excitation import recorded
from mrpipe.simulation.loop import LoopOptions
from mrpipe.simulation.several_dampers import DampersResponse, LoopDamper, simulate_dampers
from mrpipe.structures import Frame

from .independent_control import Central, Friction, Linear, Perfect, Requested, Sampled
from .independent_loop import BoucWen, Device, Histories, integrate

SET_C = BoucWen(alpha=(19.92, 5.03, 20.03, -1.785), c0=(50.0, 75.0), A=3000.0, gamma=1230.0, beta=1230.0, eta=100.0)
"""Numbers of configs/dampers/set-c.yaml, in the notation of the thesis."""
MASSES, SPRINGS = (25.0, 20.0, 15.0), (3.0e4, 2.4e4, 1.8e4)
M = np.diag(MASSES)
K = np.diag(np.array(SPRINGS) + np.array([*SPRINGS[1:], 0.0]))
K -= np.diag(SPRINGS[1:], 1) + np.diag(SPRINGS[1:], -1)
C = 0.6 * M + 2e-4 * K
PLACES = (np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 1.0]))
DURATION, INTERVAL, RATE, LIMIT, SWITCH = 1.6, 0.02, 200.0, 1.2, 40.0
TIME = np.arange(0.0, DURATION + INTERVAL / 2, INTERVAL)
GROUND = 6.0 * np.random.default_rng(5).standard_normal(TIME.size) * np.exp(-(((TIME - 0.8) / 0.6) ** 2))
LINEAR = (("vdps", 400.0, 3000.0), ("vdns", 250.0, -2500.0))
"""Law, c [N s/m] and k [N/m] of the damper on the ground, and of the one between floors 2 and 3."""
FRICTION = ((4000.0, 0.05, 0.1525), (3000.0, 0.04, 0.1025))
"""alpha [N/m], speed over which the friction changes its sign [m/s], and memory of an extremum [s] of both."""
REGULATED = ((3e-4, 20.0), (6e-4, 30.0))
"""Weight [1/N^2] and noise [N] of the force of both."""
ACCELEROMETERS, EXTREMUM_STEP = (0, 2), 1e-4


@dataclass(frozen=True)
class Case:
    laws: tuple[str, str] = ("linear", "linear")
    velocity: tuple[str, str] = ("kalman", "difference")
    brace: float = math.inf
    delay: float = 0.0
    driver: float = 0.0
    perfect: bool = False
    observer_force: str = "measured"

    @property
    def braces(self) -> tuple[float, float]:
        return math.inf, self.brace

    @property
    def regulated(self) -> list[int]:
        return [d for d in (0, 1) if self.laws[d] == "lqg"]


def controller_of(case: Case, d: int) -> Controller:
    model = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    # so fine that the linear interpolation between its points does not count here
    table = None if case.perfect else inverse_table(model, drive_limit=LIMIT, speeds=1001, drives=1601)
    alpha, rounding, memory = FRICTION[d]
    options = ControllerOptions(
        rate_hz=RATE,
        velocity=case.velocity[d],  # type: ignore[arg-type]
        observer_force=case.observer_force,  # type: ignore[arg-type]
        residual_force_n=SWITCH,
        drive_limit=LIMIT,
        friction_rounding_m_s=rounding,
        extremum_step_m=EXTREMUM_STEP,
        extremum_memory_s=memory,
    )
    name, c, k = LINEAR[d]
    law, gains = {
        "linear": (name, Gains(c_n_s_m=c, k_n_m=k)),
        "fdns": ("fdns", Gains(alpha_n_m=alpha)),
        "lqg": (CENTRAL, Gains()),
    }[case.laws[d]]
    return build_controller(law, gains, options, inverse=table, position=PLACES[d])


def by_package(case: Case, plant_rate: float) -> DampersResponse:
    model = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    dampers = [
        LoopDamper(
            f"damper {d}",
            PLACES[d],
            None if case.perfect else model.chain(),
            controller_of(case, d),
            brace_n_m=case.braces[d],
            central=d in case.regulated,
        )
        for d in (0, 1)
    ]
    options = LoopOptions(
        tracking="ideal" if case.perfect else "damper",
        plant_rate_hz=plant_rate,
        record_rate_hz=RATE,
        delay_s=case.delay,
        driver_time_constant_s=case.driver,
    )
    frame, regulator = Frame(M, C, K), None
    if case.regulated:
        regulator = central_regulator(
            frame,
            np.column_stack([PLACES[d] for d in case.regulated]),
            [Weights(force=REGULATED[d][0], force_noise_n=REGULATED[d][1]) for d in case.regulated],
            Sensors(ACCELEROMETERS, tuple(range(len(case.regulated)))),
            1.0 / RATE,
            flexibilities=[1.0 / case.braces[d] for d in case.regulated],
        )
    return simulate_dampers(frame, dampers, recorded(TIME, GROUND), options, regulator=regulator)


def independently(case: Case) -> Histories:
    def law(d: int) -> Linear | Friction | Requested:
        if case.laws[d] == "lqg":
            return Requested()
        if case.laws[d] == "fdns":
            alpha, rounding, memory = FRICTION[d]
            return Friction(alpha, rounding, EXTREMUM_STEP, memory, RATE)
        return Linear(*LINEAR[d][1:])

    damper = Perfect() if case.perfect else SET_C
    devices = [
        Device(w, damper, Sampled(damper, law(d), RATE, LIMIT, SWITCH, 60.0, case.velocity[d]), case.braces[d])
        for d, w in enumerate(PLACES)
    ]
    central = None
    if case.regulated:
        weights, noise = zip(*(REGULATED[d] for d in case.regulated), strict=True)
        central = Central(
            M,
            C,
            K,
            np.array([PLACES[d] for d in case.regulated]),
            1.0 / RATE,
            weights=weights,
            floors=ACCELEROMETERS,
            force_noise=noise,
            flexibilities=[1.0 / case.braces[d] for d in case.regulated],
        )
    return integrate(
        M,
        C,
        K,
        devices,
        lambda t: float(np.interp(t, TIME, GROUND)),
        DURATION,
        delay=case.delay,
        driver_s=case.driver,
        central=central,
        load_cells=case.observer_force == "measured",
        **({"rtol": 1e-10, "atol": 1e-13} if case.perfect else {}),
    )


def differences(found: DampersResponse, expected: Histories) -> np.ndarray:
    """Return the largest differences of floors, strokes, forces, drives, commands and desired forces.

    Each is relative to the largest value of the quantity; that of drives and commands is their limit.
    """
    items = list(found.dampers.values())

    def error(name: str, ours: list[np.ndarray], scale: float = 0.0) -> float:
        theirs = getattr(expected, name)
        difference = np.abs(np.column_stack(ours)[1:] - theirs[1:])
        return float((difference.max(axis=0) / (scale or np.abs(theirs).max(axis=0))).max())

    np.testing.assert_allclose(found.first.time_s, expected.time, atol=1e-12)
    return np.array(
        [
            error("displacement", [found.first.displacement]),
            error("stroke", [item.damper_displacement for item in items]),
            error("force", [item.force for item in items]),
            error("drive", [item.drive for item in items], LIMIT),
            error("command", [item.commands[:, COMMAND_DRIVE] for item in items], LIMIT),
            error("desired", [item.commands[:, COMMAND_FORCE] for item in items]),
        ]
    )


@pytest.mark.oracle
@pytest.mark.parametrize(
    "case",
    [Case(), Case(delay=0.003, driver=0.01), Case(velocity=("kalman", "difference"), brace=5e4)],
    ids=["at once", "delay and driver", "brace"],
)
def test_two_dampers_under_sampled_laws_equal_an_independent_integration(case: Case) -> None:
    """The loop is of second order: half the step leaves a quarter of the difference, which is small already."""
    expected = independently(case)
    assert np.any(expected.command[:, 0] == LIMIT) and np.any(expected.command[:, 1] > 0.5), "the drive is limited"
    assert 0.05 < np.mean(expected.desired == 0.0) < 0.5, "the laws are clipped"
    coarse, fine = (differences(by_package(case, rate), expected) for rate in (4000.0, 8000.0))
    assert np.all(fine < 0.3 * coarse)
    assert np.all(fine < [2e-6, 4e-6, 3e-5, 3e-5, 3e-5, 3e-5])


@pytest.mark.oracle
def test_the_kalman_filter_of_a_braced_damper_reads_the_acceleration_of_the_rod() -> None:
    """Force and rod of a braced damper move more abruptly, so that single samples have larger differences.

    The acceleration of the rod is a difference over four steps, which is of first order where the rod reverses within.
    It contains the error of the force over the square of the step. The differences had grown from 16 kHz on.
    """
    case = Case(velocity=("kalman", "kalman"), brace=5e4)
    expected = independently(case)
    coarse, fine, finest = (differences(by_package(case, rate), expected) for rate in (8000.0, 16000.0, 32000.0))
    assert np.all(coarse < [2e-5, 8e-5, 4e-4, 2e-3, 2e-3, 1e-3])
    assert np.all(finest < 0.3 * fine)
    assert np.all(finest < [4e-7, 1e-6, 6e-6, 1.2e-5, 1.2e-5, 2.5e-5])


@pytest.mark.oracle
@pytest.mark.parametrize(
    "case",
    [
        Case(("fdns", "fdns"), brace=5e4, delay=0.003, driver=0.01),
        Case(("lqg", "lqg"), brace=5e4, delay=0.003, driver=0.01),
        Case(("fdns", "lqg")),
        Case(("fdns", "lqg"), observer_force="desired"),
    ],
    ids=["fdns", "lqg", "fdns and lqg", "without a load cell"],
)
def test_friction_and_regulator_with_several_dampers_equal_an_independent_integration(case: Case) -> None:
    """Both laws have a memory: the last extremum of each damper, and an observer that the dampers share."""
    expected = independently(case)
    assert np.any(expected.command[:, 0] > 0.9 * LIMIT) and np.any(expected.command[:, 1] > 0.2), "the drive matters"
    assert 0.02 < np.mean(expected.desired == 0.0) < 0.5, "the laws are clipped"
    coarse, fine = (differences(by_package(case, rate), expected) for rate in (4000.0, 8000.0))
    assert np.all(fine < 0.3 * coarse)
    assert np.all(fine < [2e-6, 4e-6, 3e-5, 3e-5, 3e-5, 3e-5])


@pytest.mark.oracle
def test_friction_and_regulator_with_perfect_dampers_equal_an_independent_integration() -> None:
    """The forces are held between samples, so that the step of the structure is exact."""
    case = Case(("fdns", "lqg"), ("measured", "measured"), delay=0.003, perfect=True)
    displacement, stroke, force, _, _, desired = differences(by_package(case, 2000.0), independently(case))
    assert max(displacement, stroke, force, desired) < 3e-8
