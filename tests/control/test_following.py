"""An eigenvalue is followed past others that come near to it, and out of pairs of equal frequency."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from mrpipe.control import exact, limits
from mrpipe.control.calibration import CalibrationOptions, calibrate
from mrpipe.control.following import followed_pole
from mrpipe.control.laws import law_named
from mrpipe.control.placed import PlacedDamper, calibrate_placed, modes_together
from mrpipe.control.placed_storage import placed_dampers
from mrpipe.structures import Frame, shear_frame
from mrpipe.structures.options import DamperSettings

STOREYS = shear_frame([20.0, 20.0, 15.0], [3.0e4, 3.0e4, 2.0e4], 0.0)
BOTTOM = np.array([1.0, 0.0, 0.0])


def square(angle: float = 0.0, interleaved: bool = False) -> Frame:
    """Return the frame with equal properties in two directions, with axes that are turned by an angle [rad]."""
    mass, stiffness = (block_diag(item, item) for item in (STOREYS.mass, STOREYS.stiffness))
    turn = np.kron(np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), np.eye(3))
    order = [0, 3, 1, 4, 2, 5] if interleaved else list(range(6))
    mass, stiffness = ((turn.T @ item @ turn)[np.ix_(order, order)] for item in (mass, stiffness))
    return Frame(mass, np.zeros((6, 6)), 0.5 * (stiffness + stiffness.T))


@pytest.mark.property
@pytest.mark.parametrize("swirl", [0.02, -0.02])
def test_steps_are_divided_where_eigenvalues_nearly_meet(swirl: float) -> None:
    """Two eigenvalues turn half way around each other within a few steps."""

    def both(share: float) -> np.ndarray:
        angle = np.pi / (1.0 + np.exp(-(share - 0.48) / 0.02))
        offset = swirl * np.exp(1j * angle)
        return np.array([offset, -offset]) + 1j

    assert followed_pole(both, 1j + swirl, 0.0) == pytest.approx(1j - swirl, abs=1e-9)


@pytest.mark.property
def test_rounding_of_two_equal_eigenvalues_divides_no_step() -> None:
    """A device that is almost zero separates two equal eigenvalues by less than the rounding error."""
    rng = np.random.default_rng(4)
    shares = []

    def both(share: float) -> np.ndarray:
        shares.append(share)
        return 20j + np.array([0.0, -1e-12 * share]) + 1e-13 * rng.standard_normal(2)

    assert followed_pole(both, 20j, -1e-12) == pytest.approx(20j, abs=1e-9)
    assert len(shares) == 25


@pytest.mark.property
def test_equal_eigenvalues_that_move_together_divide_no_step() -> None:
    """Equal devices in the two directions of a square building keep the eigenvalues of both directions equal."""
    shares = []

    def pole(share: float) -> complex:
        return 20j + 2j * share - 3.0 * share**2

    def both(share: float) -> np.ndarray:
        shares.append(share)
        return pole(share) + np.array([0.0, 1e-12j, 9j])

    assert followed_pole(both, 20j, 2j) == pytest.approx(pole(1.0), abs=1e-9)
    assert len(shares) == 25


@pytest.mark.oracle
def test_the_pole_of_a_strongly_coupled_damper_is_that_of_a_fine_continuation() -> None:
    # two storeys of which the lower one has the damper: mode 1 becomes overdamped, and mode 2 the locked mode
    rng = np.random.default_rng(11)
    floors = int(rng.integers(2, 9))
    frame = shear_frame(rng.uniform(5.0, 40.0, floors), rng.uniform(2e4, 9e4, floors), 0.0)
    position = np.eye(floors)[int(rng.integers(0, floors))]
    modes = limits.limiting_modes(frame, position, 1)
    viscosity = 3.0 * limits.optimal_viscosity(modes)
    pole = complex(0.0, modes.omega_0)
    for share in np.linspace(0.0, 1.0, 3001):
        damping = share * viscosity * np.outer(position, position)
        poles = np.linalg.eigvals(np.block([
            [np.zeros((floors, floors)), np.eye(floors)],
            [-np.linalg.solve(frame.mass, frame.stiffness), -np.linalg.solve(frame.mass, damping)],
        ]))  # fmt: skip
        upper = poles[poles.imag >= -1e-9]
        pole = complex(upper[np.argmin(np.abs(upper - pole))])
    assert pole.imag == pytest.approx(0.0, abs=1e-9)
    assert exact.exact_damping(frame, position, modes, viscosity, 0.0).damping_ratio == pytest.approx(1.0, abs=1e-9)


@pytest.mark.property
@pytest.mark.parametrize("interleaved", [False, True])
@pytest.mark.parametrize("law", ["vd", "vdns", "fdns", "lqg", "homogeneous-friction"])
def test_a_square_building_has_the_gains_of_one_direction(law: str, interleaved: bool) -> None:
    one = calibrate(STOREYS, BOTTOM, CalibrationOptions(), [law_named(law)])
    frame = square(interleaved=interleaved)
    both = calibrate(frame, np.eye(6)[0], CalibrationOptions(), [law_named(law)])
    assert both.modes.omega_inf == pytest.approx(one.modes.omega_inf, rel=1e-9)
    expected, found = one.laws[law], both.laws[law]
    assert found.damping_ratio_exact == pytest.approx(expected.damping_ratio_exact, rel=1e-6)
    for name, value in expected.gains.items():
        assert found.gains[name] == pytest.approx(value, rel=1e-4)


@pytest.mark.property
def test_a_damper_across_the_axes_of_a_square_building_moves_one_mode_of_each_pair() -> None:
    one = calibrate(STOREYS, BOTTOM, CalibrationOptions(), [law_named("vd")])
    turned = calibrate(square(angle=0.7), np.eye(6)[0], CalibrationOptions(), [law_named("vd")])
    # the solver of the eigenvalue problem may mix the two modes of a pair
    mixed = np.zeros(6)
    mixed[[0, 3]] = np.cos(0.4), np.sin(0.4)
    across = calibrate(square(), mixed, CalibrationOptions(), [law_named("vd")])
    for found in (turned, across):
        assert found.modes.omega_inf == pytest.approx(one.modes.omega_inf, rel=1e-6)
        assert found.laws["vd"].gains.c_n_s_m == pytest.approx(one.laws["vd"].gains.c_n_s_m, rel=1e-3)


@pytest.mark.property
def test_two_dampers_of_a_square_building_have_the_gains_of_one() -> None:
    frame = square()
    entries = [DamperSettings(between=(1, "ground")), DamperSettings(between=(4, "ground"))]
    found = calibrate_placed(frame, placed_dampers(frame, entries, 1), CalibrationOptions())
    one = calibrate_placed(STOREYS, [PlacedDamper("bottom", BOTTOM, "vd")], CalibrationOptions())[0]
    assert {item.damper.mode for item in found} == {1, 2}
    for item in found:
        assert item.together.c_n_s_m == pytest.approx(one.together.c_n_s_m, rel=1e-2)
    expected = modes_together(STOREYS, [one], [1]).damping_ratios[0]
    np.testing.assert_allclose(modes_together(frame, found, [1, 2]).damping_ratios, expected, rtol=1e-3)
