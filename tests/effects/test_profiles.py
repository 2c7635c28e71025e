"""Free profiles follow laws that no formula of the library holds, and keep the sign that the physics gives them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import nnls

from mrpipe.dampers.drive import polynomial_coefficients
from mrpipe.dampers.hysteresis import hysteresis
from mrpipe.dampers.plant import FORCE, HYSTERETIC_FORCE, SLIP, VELOCITY, build_chain, run_chain
from mrpipe.effects.contract import EffectForm
from mrpipe.effects.library import damper_effects

DT = 1e-3
TIME = np.arange(0.0, 6.0, DT)
STROKE, SPEED = 0.01, 0.12
X = STROKE * (0.7 * np.sin(7.0 * TIME) + 0.3 * np.sin(17.0 * TIME))
V = STROKE * (4.9 * np.cos(7.0 * TIME) + 5.1 * np.cos(17.0 * TIME))
BASE = [polynomial_coefficients([90.0], [200.0]), hysteresis(4e-4)]
Law = Callable[[np.ndarray], np.ndarray]


def wires(form: EffectForm | None = None, **values: float) -> np.ndarray:
    steps = [] if form is None else form.steps(values)
    return run_chain(build_chain([*BASE, *steps]), X, V, np.gradient(V, DT), np.ones_like(X), DT)


def missed(form: EffectForm, scale: float, wanted: np.ndarray) -> float:
    """Return the share of a force that the profile with the best coefficients cannot follow."""
    names = [item.name for item in form.amplitudes]
    plain = wires()[:, FORCE]
    searched = {item.name: scale for item in form.searched}
    columns = [
        wires(form, **searched, **{other: float(other == name) for other in names})[:, FORCE] - plain for name in names
    ]
    return float(nnls(np.stack(columns, axis=1), wanted)[1] / np.linalg.norm(wanted))


@pytest.mark.planted
@pytest.mark.parametrize(
    "law",
    [lambda v: np.maximum(v - 0.03, 0.0) ** 2, lambda v: v**2.6, lambda v: np.maximum(v - 0.05, 0.0)],
    ids=["onset", "power", "knee"],
)
def test_a_drag_that_rises_in_its_own_way_is_followed(law: Law) -> None:
    form = damper_effects()["quadratic-drag"].form("profile")
    assert missed(form, SPEED, np.sign(V) * law(np.abs(V))) < 0.03


@pytest.mark.planted
@pytest.mark.parametrize(
    "law", [lambda v: 1.0 / np.cosh(v / 0.02), lambda v: np.exp(-np.sqrt(v / 0.01))], ids=["bell", "cusp"]
)
def test_a_friction_that_falls_in_its_own_way_is_followed(law: Law) -> None:
    form, calm = damper_effects()["stribeck"].form("profile"), wires()
    assert missed(form, 0.5 * SPEED, calm[:, HYSTERETIC_FORCE] * law(np.abs(calm[:, VELOCITY]))) < 0.08


@pytest.mark.planted
def test_a_force_that_comes_back_over_two_lengths_is_followed() -> None:
    form, calm = damper_effects()["migration"].form("profile"), wires()
    slip = calm[:, SLIP]
    law = 0.5 * (1.0 - np.exp(-slip / 8e-4)) + 0.5 * (1.0 - np.exp(-slip / 7e-3))
    assert missed(form, STROKE, calm[:, HYSTERETIC_FORCE] * law) < 0.02


@pytest.mark.property
def test_a_profile_cannot_take_the_opposite_sign() -> None:
    """A force that falls with the speed is no drag: the best coefficients of its profile are zero."""
    form = damper_effects()["quadratic-drag"].form("profile")
    assert missed(form, SPEED, -np.sign(V) * V**2) == pytest.approx(1.0)
    assert all(item.lower == 0.0 for item in form.amplitudes)
