"""The laws that the field compares with: compiled forces against their formulas in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from mrpipe.control import COMMAND_SIZE, ControllerOptions, Gains, build_controller, controller_step, inverse_table
from mrpipe.control.controller import Controller
from mrpipe.control.kernel import (
    COMMAND_AMPLITUDE,
    COMMAND_DRIVE,
    COMMAND_FORCE,
    COMMAND_UNCLIPPED,
    COMMAND_VELOCITY,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
)
from mrpipe.control.laws import law_named
from mrpipe.control.laws.fdns_bounded import bounded_slope
from mrpipe.control.laws.lyapunov import lyapunov_observer
from mrpipe.control.lqg import Weights, lqg_observer
from mrpipe.errors import UserError
from mrpipe.structures import Frame, frame_from_parameter_set, state_space

LIMIT = 4.0
DT = 1.0 / 200.0
RNG = np.random.default_rng(8)
SIGNAL = np.zeros((600, MEASURED_FLOORS + 5))
TIME = DT * np.arange(len(SIGNAL))
SIGNAL[:, 0] = 0.009 * np.sin(8.0 * TIME) * np.exp(-0.3 * TIME)
SIGNAL[:, 2] = np.gradient(SIGNAL[:, 0], TIME)
SIGNAL[:, 1] = np.gradient(SIGNAL[:, 2], TIME)
SIGNAL[:, MEASURED_GROUND] = 0.5 * np.sin(7.0 * TIME)
SIGNAL[:, MEASURED_FORCE] = 40.0 * np.sin(8.0 * TIME + 1.3) + 5.0 * RNG.standard_normal(len(SIGNAL))
SIGNAL[:, MEASURED_FLOORS:] = np.sin(8.0 * TIME[:, None] + np.arange(5.0)) + 0.2


def controller(law: str, gains: Gains | None = None, **parts) -> Controller:
    frame, position = frame_from_parameter_set("thesis"), np.eye(5)[0]
    entry = law_named(law)
    options = {"velocity": "measured", "low_pass_hz": None, "drive_limit": LIMIT, **parts}
    observer = None if entry.observer is None else entry.observer(frame, position, Weights(), DT)
    return build_controller(law, gains or Gains(), ControllerOptions(**options), observer=observer, position=position)


def run(built: Controller) -> np.ndarray:
    commands, state = np.zeros((len(SIGNAL), COMMAND_SIZE)), built.new_state()
    for row, command in zip(SIGNAL, commands, strict=True):
        controller_step(*built.arguments, state, np.ascontiguousarray(row[: built.measured_size]), command)
    return commands


def observed(observer, force: np.ndarray) -> np.ndarray:
    """Return -k z at every sample."""
    z, found = np.zeros(10), []
    y = np.column_stack([SIGNAL[:, 0], SIGNAL[:, MEASURED_GROUND], SIGNAL[:, MEASURED_FLOORS:]])
    for sample, f in zip(y, force, strict=True):
        z = observer.transition @ z + observer.force_input * f + observer.innovation @ sample
        found.append(-observer.gain @ z)
    return np.array(found)


def integrated(corner: float, w: np.ndarray) -> np.ndarray:
    acceleration, velocity, last, found = SIGNAL[:, MEASURED_FLOORS:] @ w, 0.0, 0.0, []
    for a in acceleration:
        velocity = np.exp(-corner * DT) * (velocity + 0.5 * DT * (a + last))
        last = a
        found.append(velocity)
    return np.array(found)


@pytest.mark.literature
def test_clipped_optimal_switches_by_force_feedback(thesis_frame, floor_one):
    """Dyke et al. (1996): v = Vmax H((fc - f) f)."""
    found, f = run(controller("clipped-optimal")), SIGNAL[:, MEASURED_FORCE]
    wanted = observed(lqg_observer(thesis_frame, floor_one, Weights(), DT), f)
    np.testing.assert_allclose(found[:, COMMAND_UNCLIPPED], wanted, rtol=1e-9, atol=1e-9)
    on = ((wanted - f) * f > 0.0).astype(float)
    assert 0.05 < on.mean() < 0.95
    np.testing.assert_array_equal(found[:, COMMAND_DRIVE], LIMIT * on)


@pytest.mark.literature
@pytest.mark.parametrize("observer_force", ["measured", "desired"])
def test_lqg_observes_with_the_measured_force_or_the_last_desired_one(thesis_frame, floor_one, observer_force):
    """Thesis (E.8): the observer takes the force that acts on the structure, which a load cell measures."""
    found = run(controller("lqg", observer_force=observer_force))
    f = SIGNAL[:, MEASURED_FORCE]
    if observer_force == "desired":
        f = np.concatenate([[0.0], found[:-1, COMMAND_FORCE]])
    wanted = observed(lqg_observer(thesis_frame, floor_one, Weights(), DT), f)
    assert 0.02 < np.mean(found[:, COMMAND_FORCE] == 0.0) < 0.95
    np.testing.assert_allclose(found[:, COMMAND_UNCLIPPED], wanted, rtol=1e-9, atol=1e-9)


@pytest.mark.literature
def test_lyapunov_lowers_its_function(thesis_frame, floor_one):
    """Jansen and Dyke (2000): v = Vmax H(-z'P B f) for the force f on the structure, which is minus the damper's."""
    found, f = run(controller("lyapunov")), SIGNAL[:, MEASURED_FORCE]
    observer = lyapunov_observer(thesis_frame, floor_one, Weights(), DT)
    space = state_space(thesis_frame, floor_one)
    Q = np.zeros((10, 10))
    Q[:5, :5], Q[5:, 5:] = 0.5 * (thesis_frame.stiffness + thesis_frame.stiffness.T), thesis_frame.mass
    P = solve_continuous_lyapunov(space.A.T, -Q)
    np.testing.assert_allclose(space.A.T @ P + P @ space.A, -Q, atol=1e-6 * np.abs(Q).max())
    assert np.all(np.linalg.eigvalsh(0.5 * (P + P.T)) > 0.0)
    np.testing.assert_allclose(observer.gain, -(P @ space.B[:, 1]), rtol=1e-9, atol=1e-12)
    on = (observed(observer, f) * f > 0.0).astype(float)
    assert 0.05 < on.mean() < 0.95
    np.testing.assert_array_equal(found[:, COMMAND_DRIVE], LIMIT * on)
    with pytest.raises(UserError, match="undamped mode"):
        bare = Frame(thesis_frame.mass, np.zeros((5, 5)), thesis_frame.stiffness)
        lyapunov_observer(bare, floor_one, Weights(), DT)


@pytest.mark.literature
def test_maximum_energy_dissipation_follows_the_relative_velocity():
    found = run(controller("energy-dissipation"))
    on = (SIGNAL[:, 2] * SIGNAL[:, MEASURED_FORCE] > 0.0).astype(float)
    np.testing.assert_array_equal(found[:, COMMAND_DRIVE], LIMIT * on)


@pytest.mark.literature
def test_bang_bang_and_sky_hook_follow_the_absolute_velocity():
    velocity = integrated(0.8, np.eye(5)[0])
    on = (velocity * SIGNAL[:, MEASURED_FORCE] > 0.0).astype(float)
    found = run(controller("bang-bang", Gains(corner_rad_s=0.8)))
    np.testing.assert_array_equal(found[:, COMMAND_DRIVE], LIMIT * on)
    hooked = run(controller("sky-hook", Gains(c_n_s_m=500.0, corner_rad_s=0.8)))
    np.testing.assert_allclose(hooked[:, COMMAND_UNCLIPPED], 500.0 * velocity, rtol=1e-9, atol=1e-12)
    # a constant bias of the accelerometer does not run away
    assert np.abs(integrated(0.8, np.eye(5)[0])).max() < 0.2 / 0.8 + 1.3 / 8.0


@pytest.mark.literature
def test_homogeneous_friction_holds_the_force_at_the_last_extremum():
    """Inaudi (1997): the friction force is g |P|, P the displacement at its last extremum."""
    found = run(controller("homogeneous-friction", Gains(alpha_n_m=4000.0)))
    on = (4000.0 * found[:, COMMAND_AMPLITUDE] > np.abs(SIGNAL[:, MEASURED_FORCE])).astype(float)
    assert 0.05 < on.mean() < 0.95
    np.testing.assert_array_equal(found[:, COMMAND_DRIVE], LIMIT * on)
    extrema = np.abs(SIGNAL[np.flatnonzero(np.diff(np.sign(SIGNAL[:, 2]))) + 1, 0])
    assert found[-1, COMMAND_AMPLITUDE] in [pytest.approx(value, rel=0.01) for value in extrema]


@pytest.mark.property
@pytest.mark.parametrize("residual,largest", [(10.0, 300.0), (25.0, 40.0), (5.0, 20.0), (0.0, 1e300)])
def test_bounded_fdns_dissipates_what_the_law_demands(residual, largest):
    """The energy over a half cycle is 2 alpha X^2, by quadrature, wherever the damper can give it."""
    alpha = 3000.0
    for amplitude in (0.002, 0.005, 0.009, 0.02):
        slope = bounded_slope(alpha, amplitude, residual, largest)
        x = np.linspace(-amplitude, amplitude, 20001)
        force = np.clip(slope * (amplitude - x), residual, min(largest, 1e12))
        energy, wanted = np.trapezoid(force, x), 2.0 * alpha * amplitude**2
        if 2.0 * residual * amplitude >= wanted:
            assert slope == 0.0
        elif 2.0 * largest * amplitude <= 1.02 * wanted:
            assert slope > 5.0 * alpha
        else:
            assert energy == pytest.approx(wanted, rel=1e-3)
    assert bounded_slope(alpha, 0.009, 0.0, 1e300) == pytest.approx(alpha, rel=1e-9)


@pytest.mark.property
def test_bounded_fdns_is_fdns_without_bounds(set_c):
    plain = {"residual_force_n": 0.0, "saturation_force_n": None}
    gains = Gains(alpha_n_m=3000.0)
    forces = [run(controller(law, gains, **plain))[:, COMMAND_UNCLIPPED] for law in ("fdns", "fdns-bounded")]
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-9, atol=1e-9)
    assert inverse_table(set_c).largest_drive == LIMIT
    assert np.ptp(run(controller("fdns", gains))[:, COMMAND_VELOCITY]) > 0.05
