"""Operation of one of several dampers: forces at the expected amplitude, weights and warnings."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mrpipe.control.calibration import balanced_weights
from mrpipe.control.calibration_settings import RegulatorSettings
from mrpipe.control.operation import PlacedOperation, operation_of
from mrpipe.control.placed import PlacedCalibration
from mrpipe.dampers.model import DamperModel
from tests.control.placed import AMPLITUDE_M, FRAME, calibrated

pytestmark = pytest.mark.property

FRICTION = {"yield_force_a": 18.0, "yield_force_b": 30.0, "c0_a": 0.0, "yield_displacement": 1e-6, "eta": 80.0}


def operation(item: PlacedCalibration, *, wanted_mode: int = 1, drive_limit: float = 2.0) -> PlacedOperation:
    return operation_of(
        FRAME,
        item,
        DamperModel("bouc-wen", FRICTION, "A", drive_limit=drive_limit),
        AMPLITUDE_M,
        wanted_mode=wanted_mode,
        rounding_share=0.05,
        regulator=RegulatorSettings(),
    )


def test_the_force_without_drive_is_that_at_the_expected_amplitude() -> None:
    item = calibrated()[0]
    found = operation(item)
    assert found.summary["expected_amplitude_m"] == AMPLITUDE_M
    assert found.summary["residual_force_n"] == pytest.approx(18.0, rel=1e-3)
    assert found.summary["friction_rounding_m_s"] == pytest.approx(0.05 * AMPLITUDE_M * item.modes.omega_0)
    assert found.weights == balanced_weights(FRAME, item.damper.position, item.modes, found.summary["residual_force_n"])


def test_a_damper_of_another_mode_gives_a_warning() -> None:
    item = calibrated()[0]
    assert not any("does not move" in line for line in operation(item).warnings)
    other = replace(item, damper=replace(item.damper, mode=2))
    assert "low: mode 1 does not move this damper, so that it is calibrated for mode 2" in operation(other).warnings


def test_a_damper_that_is_too_weak_gives_a_warning() -> None:
    item = calibrated()[0]
    strong, weak = operation(item, drive_limit=100.0), operation(item, drive_limit=0.0)
    assert len(weak.warnings) > len(strong.warnings)
    assert all(line.startswith("low: ") for line in weak.warnings)
    assert weak.summary["force_demand"]["exceeds_damper"] and not strong.summary["force_demand"]["exceeds_damper"]
    # with the gain for all dampers together, with which it runs
    needed = item.together.c_n_s_m * item.modes.omega_0 * AMPLITUDE_M
    assert f"low: vd: needs {needed:.0f} N, but the damper gives at most 18 N" in weak.warnings
    assert f"{needed:.0f}" != f"{item.alone.c_n_s_m * item.modes.omega_0 * AMPLITUDE_M:.0f}"
