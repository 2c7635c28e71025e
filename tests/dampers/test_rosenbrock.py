"""Order and damping of the Rosenbrock method, on the linear equation whose solution is known."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.rosenbrock import LONGEST, MOST_PARTS, damping_factor, parts_of_step

pytestmark = pytest.mark.property


def _end(rate: float, parts: int) -> float:
    """Return z(1) of z' = -rate (z - sin t) from z(0) = 1, with equal parts of a step."""
    h, z = 1.0 / parts, 1.0
    for k in range(parts):
        factor = damping_factor(h, -rate)
        k1 = factor * -rate * (z - np.sin(k * h))
        k2 = factor * (-rate * (z + h * k1 - np.sin((k + 1) * h)) - 2.0 * k1)
        z += h * (1.5 * k1 + 0.5 * k2)
    return z


def test_second_order() -> None:
    exact = np.exp(-1.0) + 0.5 * (np.sin(1.0) - np.cos(1.0) + np.exp(-1.0))
    errors = [abs(_end(1.0, parts) - exact) for parts in (20, 40, 80)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.1)


def test_the_fastest_solution_vanishes_within_one_step() -> None:
    factor = damping_factor(1.0, -1e12)
    k1 = factor * -1e12
    k2 = factor * (-1e12 * (1.0 + k1) - 2.0 * k1)
    assert abs(1.0 + 1.5 * k1 + 0.5 * k2) < 1e-8


@pytest.mark.parametrize(("decay", "parts"), [(0.0, 1), (0.9, 2), (2.1, 5), (1e6, MOST_PARTS)])
def test_parts_are_shorter_than_the_longest_until_there_are_too_many(decay: float, parts: int) -> None:
    assert parts_of_step(decay / 1e-3, 1e-3) == parts
    assert parts == MOST_PARTS or decay / parts <= LONGEST
