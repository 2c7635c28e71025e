"""Yield velocity over drive: the compiled function and the one for arrays agree, and have the limits of the formula."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.drive import polynomial_coefficients
from mrpipe.dampers.form import Strength
from mrpipe.dampers.library import base_form
from mrpipe.dampers.plant import FORCE, build_chain, run_chain
from mrpipe.dampers.yield_velocity import growth_of, width_of, yield_velocity
from mrpipe.effects.library import all_effects

pytestmark = pytest.mark.property

VALUES = {"yield_velocity": 0.02, "rest_share": 0.4, "bend": 1.5, "largest_drive": 2.0}
DRIVES = np.array([-2.0, 0.0, 0.5, 1.0, 2.0, 3.0])


def _at(drive: np.ndarray) -> Strength:
    return Strength(np.zeros_like(drive), drive, np.ones_like(drive), np.zeros_like(drive), np.zeros_like(drive))


@pytest.mark.parametrize("rest", [0.4, 1.0, 1.8])
def test_compiled_and_array_functions_agree(rest: float) -> None:
    values = {**VALUES, "rest_share": rest}
    compiled = [yield_velocity(0.02, drive, 0.0, *growth_of(values)) for drive in DRIVES]
    assert width_of(values, _at(DRIVES)) == pytest.approx(np.array(compiled), rel=1e-14)


def test_limits() -> None:
    rest, half, largest = width_of(VALUES, _at(np.array([0.0, 1.0, 2.0])))
    assert rest == pytest.approx(0.4 * 0.02)
    assert half == pytest.approx(0.02 * (0.4 + 0.6 * 0.5**1.5))
    assert largest == pytest.approx(0.02)


def test_a_falling_yield_velocity_stays_positive_beyond_the_largest_drive() -> None:
    values = {**VALUES, "rest_share": 1.8}
    assert width_of(values, _at(np.array([20.0])))[0] == pytest.approx(0.02 * 0.9)


def test_without_growth_the_drive_does_not_matter() -> None:
    assert np.ptp(width_of({"yield_velocity": 0.02}, _at(DRIVES))) == 0.0


@pytest.mark.parametrize("name", ["biviscous", "hysteretic-biviscous"])
def test_warm_fluid_keeps_the_viscosity_before_yield(name: str) -> None:
    form = base_form(name)
    given = {"yield_velocity": 0.05, "rest_share": 1e-9, "bend": 1.0, "largest_drive": 2.0}
    values = {p.name: given.get(p.name, 1e-12) for p in form.parameters}
    base = [polynomial_coefficients([0.0, 500.0], [0.0]), *form.steps(values)]
    warm = all_effects()["heating"].form("curved")
    steps = warm.steps({"loss": 1e-3, "cooling_time": 1e9, "curvature": 0.0, "viscosity_exponent": 0.0})
    t = np.arange(20_000) / 1000.0
    speed = 0.2 * np.cos(2.0 * np.pi * t)
    motion = 0.2 / (2.0 * np.pi) * np.sin(2.0 * np.pi * t), speed, -0.4 * np.pi * np.sin(2.0 * np.pi * t)
    force = run_chain(build_chain([*base, *steps]), *motion, np.full_like(t, 2.0), 1e-3)[:, FORCE]
    cold = run_chain(build_chain(base), *motion, np.full_like(t, 2.0), 1e-3)[:, FORCE]
    late, slow = t > 15.0, np.abs(speed) < 0.01
    assert np.max(np.abs(force[late])) < 0.5 * np.max(np.abs(cold[late]))
    assert force[late & slow] == pytest.approx(cold[late & slow], rel=1e-6, abs=1e-6)
