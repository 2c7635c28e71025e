"""Search for a force whose motion gives the same force back: smooth, steep and jumping answers."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from mrpipe.simulation.implicit_force import (
    ITERATIONS,
    narrowed,
    nearly_settled,
    next_guess,
    secant,
    settled,
    slope_between,
)

pytestmark = pytest.mark.property


def search(answer: Callable[[float], float], guess: float, slope: float = 0.0) -> tuple[float, int]:
    """Run the search as the compiled loops do; return the force and the number of answers."""
    low, high, last_guess, last_found = -math.inf, math.inf, 0.0, 0.0
    for iteration in range(ITERATIONS):
        found = answer(guess)
        if settled(found, guess):
            return found, iteration + 1
        if iteration > 0 and guess != last_guess:
            slope = slope_between(found, guess, last_found, last_guess)
        if nearly_settled(found, guess):
            return secant(found, guess, slope), iteration + 1
        low, high = narrowed(low, high, found, guess)
        last_guess, last_found = guess, found
        guess = next_guess(iteration, found, guess, slope, low, high)
        if guess == last_guess:
            break
    return guess, ITERATIONS


@pytest.mark.parametrize("slope", [0.8, -0.01, -0.9, -3.0, -200.0])
def test_a_linear_answer_is_found_at_once_at_any_slope(slope: float) -> None:
    force, answers = search(lambda guess: 40.0 + slope * guess, 0.0)
    assert force == pytest.approx(40.0 / (1.0 - slope), rel=1e-6)
    assert answers <= 3


@pytest.mark.parametrize("slope", [0.0, -0.5, -50.0])
@pytest.mark.parametrize("start", [-300.0, 0.0, 300.0])
def test_a_yielding_answer_is_found_from_any_start(slope: float, start: float) -> None:
    def answer(guess: float) -> float:
        return 60.0 * math.tanh((5.0 - 0.4 * guess) / 2.0) + slope * guess / 10.0

    force, answers = search(answer, start, slope=-0.2)
    assert answer(force) == pytest.approx(force, rel=1e-3)
    assert answers < 30


@pytest.mark.parametrize("start", [-500.0, 3.0, 500.0])
def test_at_a_jump_the_force_is_the_one_of_the_jump(start: float) -> None:
    # dry friction that holds: 50 N to either side, and the motion turns at a force of 20 N
    force, _ = search(lambda guess: math.copysign(50.0, 20.0 - guess), start)
    assert force == pytest.approx(20.0, abs=1e-9)


def test_a_guess_stays_in_the_bracket_and_halves_it_late() -> None:
    assert next_guess(0, 10.0, 0.0, 0.0, 0.0, math.inf) == 10.0
    assert next_guess(0, 10.0, 0.0, 0.9, 0.0, 20.0) == 10.0
    assert next_guess(30, 1.0, 0.0, 0.0, 0.0, 20.0) == 10.0
    assert narrowed(-math.inf, math.inf, 3.0, 1.0) == (1.0, math.inf)
    assert narrowed(1.0, math.inf, 3.0, 5.0) == (1.0, 5.0)
    assert slope_between(np.inf, 1.0, 0.0, 0.0) == 0.9
