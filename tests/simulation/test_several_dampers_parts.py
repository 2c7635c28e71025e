"""Parts of the compiled loop of several dampers: implicit force of a linear law, and what the sensors read."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrpipe.control.kernel import (
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
    MEASURED_VELOCITY,
)
from mrpipe.simulation.several_dampers_parts import (
    D_C,
    D_CLIPPED,
    D_K,
    D_SIZE,
    STATE_SIZE,
    Central,
    F,
    V,
    X,
    law_force,
    read_sensors,
    regulate,
)

pytestmark = pytest.mark.property


def _device(c: float, k: float, clipped: float) -> np.ndarray:
    device = np.zeros(D_SIZE)
    device[D_C], device[D_K], device[D_CLIPPED] = c, k, clipped
    return device


@pytest.mark.parametrize(("x", "v"), [(0.01, 0.2), (-0.01, 0.2), (0.02, -0.001)])
def test_the_force_of_a_law_belongs_to_the_motion_that_it_leaves(x: float, v: float) -> None:
    end_x, end_v = -1e-8, -2e-5
    force = law_force(_device(300.0, -4000.0, 0.0), x, v, end_x, end_v)
    assert force == pytest.approx(300.0 * (v + end_v * force) - 4000.0 * (x + end_x * force))
    clipped = law_force(_device(300.0, -4000.0, 1.0), x, v, end_x, end_v)
    assert clipped == (force if force * (v + end_v * force) >= 0.0 else 0.0)


def _read(noise: np.ndarray, before: np.ndarray) -> np.ndarray:
    known = np.zeros(STATE_SIZE)
    known[X], known[V], known[F] = 0.003, 0.05, 40.0
    accelerations, influence, w = np.array([1.0, 2.0]), np.ones(2), np.array([-1.0, 1.0])
    measured = before.copy()
    read_sensors(accelerations, influence, w, known, 0.5, 0.25, noise, measured)
    return measured


def test_sensors_read_the_motion_of_the_damper_and_of_the_floors() -> None:
    measured = _read(np.zeros(MEASURED_FLOORS + 2), np.zeros(MEASURED_FLOORS + 2))
    assert (measured[MEASURED_DISPLACEMENT], measured[MEASURED_VELOCITY]) == (0.003, 0.05)
    assert (measured[MEASURED_FORCE], measured[MEASURED_GROUND]) == (40.0, 0.5)
    # absolute accelerations of the floors; relative acceleration across the damper, with that of the brace
    assert measured[MEASURED_FLOORS:].tolist() == [1.0, 2.0]
    assert measured[MEASURED_ACCELERATION] == pytest.approx(0.25 + 2.0 - 1.0)


def test_faulty_readings_repeat_or_vanish() -> None:
    noise, before = np.zeros(MEASURED_FLOORS + 2), np.full(MEASURED_FLOORS + 2, 7.0)
    noise[MEASURED_FORCE], noise[MEASURED_GROUND], noise[MEASURED_VELOCITY] = math.inf, -math.inf, math.nan
    measured = _read(noise, before)
    assert measured[MEASURED_FORCE] == 7.0 and measured[MEASURED_GROUND] == 0.0
    assert math.isnan(measured[MEASURED_VELOCITY]) and measured[MEASURED_DISPLACEMENT] == 0.003


def test_the_observer_is_its_equation_and_replaces_missing_readings_by_the_last_good_ones() -> None:
    """A missing reading had counted as a reading of 0."""
    rng = np.random.default_rng(2)
    F_, G, H, K = (rng.standard_normal(shape) for shape in ((4, 4), (4, 2), (4, 2), (2, 4)))
    sensors = np.array([[0.0, MEASURED_DISPLACEMENT], [1.0, MEASURED_FLOORS + 1.0]])
    measured = rng.standard_normal((2, MEASURED_FLOORS + 2))
    good = np.array([measured[0, MEASURED_DISPLACEMENT], measured[1, MEASURED_FLOORS + 1]])
    central = Central(
        (F_, G, H, K, sensors), np.arange(2), rng.standard_normal(4), np.zeros(2), rng.standard_normal(2), np.zeros(2)
    )
    for missing in (False, True):
        if missing:
            measured[1, MEASURED_FLOORS + 1] = math.nan
            measured[0, MEASURED_DISPLACEMENT] = good[0] = 3.0
        expected = F_ @ central.estimate + G @ central.forces + H @ good
        regulate(central, measured)
        assert central.estimate == pytest.approx(expected)
        assert central.wanted == pytest.approx(-K @ expected)
