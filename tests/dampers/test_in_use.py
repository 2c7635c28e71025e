"""The force at constant speed and drive by simulation, against the closed form of the base form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.dampers.in_use import HALF_PERIOD_S, held_force, steady_force
from tests.dampers.test_forms import DRIVE, STROKE, model

pytestmark = pytest.mark.property


@pytest.mark.parametrize("name", ["bouc-wen", "power-yield"])
@pytest.mark.parametrize("speed", [0.03, 0.08])
def test_without_memory_it_is_the_post_yield_force(name: str, speed: float) -> None:
    damper = model(name)
    found = held_force(damper.chain(), speed, DRIVE, DRIVE, STROKE, HALF_PERIOD_S)
    assert found == pytest.approx(float(damper.quasi_static_force(speed, DRIVE)), rel=0.02)


def test_a_lag_of_the_drive_has_died_out() -> None:
    damper = model("bouc-wen")
    lagging = replace(damper, parameters={**damper.parameters, "eta": 80.0})
    steady = held_force(lagging.chain(), 0.05, DRIVE, DRIVE, STROKE, HALF_PERIOD_S)
    after = held_force(lagging.chain(), 0.05, DRIVE, 0.0, STROKE, HALF_PERIOD_S)
    assert after == pytest.approx(steady, rel=1e-3)


def test_grid_and_interpolation() -> None:
    damper = model("bouc-wen")
    velocity, drive = np.array([-0.06, -0.031, 0.021, 0.06]), np.array([0.0, 0.37, 1.41, 2.0])
    found = steady_force(damper.chain(), velocity, drive, STROKE, 2.0)
    assert found.shape == (4,)
    assert np.array_equal(np.sign(found), np.sign(velocity))
    assert np.abs(found) == pytest.approx(damper.quasi_static_force(np.abs(velocity), drive), rel=0.03)


def test_speeds_and_drives_broadcast() -> None:
    damper = model("bouc-wen")
    grid = steady_force(damper.chain(), np.array([[0.02], [0.06]]), np.array([0.0, 1.0, 2.0]), STROKE, 2.0)
    assert grid.shape == (2, 3)
    assert np.all(np.diff(grid, axis=0) > 0.0) and np.all(np.diff(grid, axis=1) > 0.0)
