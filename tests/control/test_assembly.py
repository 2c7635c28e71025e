"""What a controller takes from the calibration, the damper and the settings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrpipe.control.assembly import ControllerFactory, expected_amplitude
from mrpipe.control.gains import Gains
from mrpipe.control.limits import limiting_modes
from mrpipe.control.lqg import Weights
from mrpipe.control.settings import ControllerSettings
from mrpipe.control.storage import Calibrated
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import UserError
from mrpipe.structures import Frame

pytestmark = pytest.mark.property

OMEGA, AMPLITUDE, ROUNDING = 8.0, 0.01, 0.012


def factory(frame: Frame, damper: DamperModel, settings: ControllerSettings | None = None) -> ControllerFactory:
    calibrated = Calibrated(
        position=np.eye(5)[0],
        omega_0=OMEGA,
        u_0=0.1,
        top_0=0.2,
        amplitude_m=AMPLITUDE,
        residual_force_n=18.0,
        friction_rounding_m_s=ROUNDING,
        weights=Weights(),
        gains={"fdns": Gains(alpha_n_m=3000.0)},
        reference=None,
        path="",
    )
    return ControllerFactory(frame, damper, calibrated, settings or ControllerSettings(inverse="model"))


def test_times_and_speeds_follow_from_the_target_mode(thesis_frame: Frame, set_c: DamperModel) -> None:
    """An extremum is valid for three quarters of a period; a perfect damper has more rounding."""
    made = factory(thesis_frame, set_c)
    real, perfect = made.options(), made.options(perfect=True)
    assert real.extremum_memory_s == pytest.approx(0.75 * 2.0 * math.pi / OMEGA)
    assert (real.friction_rounding_m_s, perfect.friction_rounding_m_s) == pytest.approx((ROUNDING, 1.5 * ROUNDING))
    assert (real.rate_hz, perfect.rate_hz) == (200.0, 500.0)
    assert (real.velocity, perfect.velocity) == ("kalman", "measured")
    assert real.extremum_step_m == pytest.approx(5.0 * 20e-6)


def test_a_perfect_damper_has_a_load_cell(thesis_frame: Frame, set_c: DamperModel) -> None:
    """Its force is the desired one, without a residual or a largest force."""
    made = factory(thesis_frame, set_c, ControllerSettings(inverse="model", observer_force="expected"))
    assert made.options().observer_force == "expected" and made.options(perfect=True).observer_force == "measured"


def test_settings_come_before_the_calibration(thesis_frame: Frame, set_c: DamperModel) -> None:
    own = ControllerSettings(
        inverse="model",
        rate_hz=150.0,
        residual_force_n=5.0,
        friction_rounding_m_s=0.03,
        drive_limit=1.5,
        safe_drive=2.0,
        extremum_memory_periods=0.5,
    )
    options = factory(thesis_frame, set_c, own).options()
    assert (options.rate_hz, options.residual_force_n, options.friction_rounding_m_s) == (150.0, 5.0, 0.03)
    assert (options.drive_limit, options.safe_drive) == (1.5, 1.5)
    assert options.extremum_memory_s == pytest.approx(math.pi / OMEGA)
    # the largest force is that at the limited drive and the peak speed of the expected amplitude
    largest = float(set_c.quasi_static_force(AMPLITUDE * OMEGA, 1.5))
    assert options.saturation_force_n == pytest.approx(largest)
    assert options.largest_force_n == pytest.approx(10.0 * largest)
    assert factory(thesis_frame, set_c, own).build("fdns").gains.alpha_n_m == 3000.0


def test_a_calibration_of_another_structure_is_refused(set_c: DamperModel) -> None:
    with pytest.raises(UserError, match="has 3 floors; calibrated for 5"):
        factory(Frame(np.eye(3), np.zeros((3, 3)), np.eye(3)), set_c)


def test_the_expected_amplitude_is_half_the_stroke_of_the_tests_or_needs_three_residual_forces(
    thesis_frame: Frame, set_c: DamperModel
) -> None:
    modes = limiting_modes(thesis_frame, np.eye(5)[0])
    assert expected_amplitude(set_c, {"displacement": 0.02}, modes) == pytest.approx(0.01)
    amplitude = expected_amplitude(set_c, {}, modes)
    # c of optimal viscous damping is (omega_inf^2 - omega_0^2)/(u_0^2 omega_0)
    force = (modes.omega_inf**2 - modes.omega_0**2) / modes.u_0**2 * amplitude
    residual = float(set_c.quasi_static_force(amplitude * modes.omega_0, 0.0))
    assert force == pytest.approx(3.0 * residual, rel=1e-6)
