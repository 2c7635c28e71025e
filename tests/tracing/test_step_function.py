"""The share of a residual that a step function of a state explains."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.tracing.step_function import explained_share

pytestmark = pytest.mark.property


def samples() -> tuple[FloatArray, BoolArray, BoolArray, FloatArray]:
    """Return a state, the direction of motion, the halves, and noise of unit variance that depends on neither."""
    rng = np.random.default_rng(2)
    state, positive = rng.uniform(-1.0, 1.0, 4000), rng.random(4000) > 0.5
    return state, positive, np.arange(4000) // 50 % 2 == 0, rng.standard_normal(4000)


def test_a_function_of_the_state_is_explained_and_noise_is_not() -> None:
    state, positive, half, noise = samples()
    assert explained_share(np.sin(3.0 * state), state, positive, half) > 0.97
    assert explained_share(noise, state, positive, half) < 0.01
    # half of the variance is that of a function of the state
    mixed = np.sign(state) + noise
    assert explained_share(mixed, state, positive, half) == pytest.approx(0.5, abs=0.05)


def test_a_function_that_differs_between_the_directions_of_motion_is_explained() -> None:
    state, positive, half, _ = samples()
    residual = np.where(positive, state, -state)
    assert explained_share(residual, state, positive, half) > 0.97
    assert explained_share(residual, state, np.zeros_like(positive), half) < 0.01


def test_a_relation_that_holds_in_one_half_alone_is_not_explained() -> None:
    state, positive, half, _ = samples()
    assert explained_share(np.where(half, state, -state), state, positive, half) == 0.0


def test_the_result_does_not_depend_on_which_half_is_the_first() -> None:
    state, positive, half, noise = samples()
    residual = state**2 + 0.3 * noise
    assert explained_share(residual, state, positive, half) == explained_share(residual, state, positive, ~half)
