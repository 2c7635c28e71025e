"""What a device does in one step: sliding, reversal within the step, sticking; friction against its closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.case_studies.devices import dissipative_force, sliding_force


def friction_decay(push: float, steps: int) -> tuple[list[float], float]:
    """Free oscillator of 1 kg and 1 N/m from 1 m with dry friction; turning points [m] and the resting place [m]."""
    dt = 2.0 * np.pi / steps
    c, s = np.cos(dt), np.sin(dt)
    x, v, turns = 1.0, 0.0, [1.0]
    for _ in range(6 * steps):
        free = -s * x + c * v
        force = dissipative_force(push, push, 0.0, 1e30, v, free, s)
        before = v
        x, v = c * x + s * v - (1.0 - c) * force, free - s * force
        if before * v < 0.0:
            # the extremum lies within the step: the energy of both parts tells it
            turns.append(float(np.sign(x)) * float(np.hypot(x, before)))
    return turns, x


@pytest.mark.literature
def test_dry_friction_takes_its_share_each_half_cycle() -> None:
    # Coulomb: every half cycle loses 2F/k
    turns, _ = friction_decay(0.07, 400)
    expected = [(1.0 - 0.14 * n) * (-1.0) ** n for n in range(len(turns))]
    np.testing.assert_allclose(turns, expected, atol=2e-4)


@pytest.mark.property
def test_reversals_within_a_step_converge_with_its_square() -> None:
    exact = friction_decay(0.07, 25600)[1]
    # averages over places of the step grid: where a reversal falls in a step must not matter to first order
    errors = [np.mean([abs(friction_decay(0.07, n + j)[1] - exact) for j in range(5)]) for n in (100, 400)]
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 8.0


@pytest.mark.property
@given(
    velocity=st.floats(-1.0, 1.0), free=st.floats(-1.0, 1.0), push=st.floats(0.0, 5.0), viscosity=st.floats(0.0, 20.0)
)
def test_a_passive_device_never_drives_the_rod(velocity: float, free: float, push: float, viscosity: float) -> None:
    compliance = 0.3
    force = dissipative_force(push, push, viscosity, 4.0, velocity, free, compliance)
    end = free - compliance * force
    assert abs(force) <= 4.0
    assert abs(end) <= max(abs(velocity), abs(free)) + 1e-12
    if velocity * free >= 0.0:
        # a rod that sticks is held at rest to rounding: the force may then have either sign
        assert force * free >= -1e-15


@pytest.mark.property
def test_a_rod_that_is_held_stands_still() -> None:
    for velocity, free in ((0.2, -0.05), (-0.2, 0.1), (0.0, 0.3), (1e-18, -0.2), (0.0, -0.4)):
        force = dissipative_force(9.0, 9.0, 0.0, 1e30, velocity, free, 0.1)
        assert free - 0.1 * force == pytest.approx(0.0, abs=1e-15)


@pytest.mark.golden
def test_sliding_force_only_resists() -> None:
    assert sliding_force(1.0, 2.0, 3.0, 0.5, 1e30) == 3.5
    assert sliding_force(-1.0, -2.0, 3.0, -0.5, 1e30) == -3.5
    assert sliding_force(1.0, -2.0, 3.0, 0.5, 1e30) == 0.0, "a negative stiffness would push"
    assert sliding_force(-1.0, -2.0, 3.0, -0.5, 1.5) == -1.5
