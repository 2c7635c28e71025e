"""A flexible model shows how much of a residual can be learned at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.tracing.bench.residuals.ceiling import MOST_ROWS, Ceiling, _trees, flexible_chi_square, lagged_states
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def test_most_of_a_missing_effect_can_be_learned_and_noise_cannot() -> None:
    found = plain_fit("accumulator")
    assert flexible_chi_square(found) < 0.2 * found.chi_square
    used = found.problem.root_weight > 0.0
    noise = np.where(used, np.random.default_rng(3).standard_normal(len(used)), 0.0)
    left = flexible_chi_square(replace(found, residual=noise, cost=float(noise @ noise)))
    assert 0.95 < left < 1.3


def test_the_past_that_the_flexible_model_sees_does_not_cross_tests() -> None:
    found = plain_fit("accumulator")
    recordings = found.problem.recordings
    columns = lagged_states(found, recordings)
    first = recordings.starts[1]
    # the last column is the drive of a while ago: at the first sample of a test it is the drive of that sample
    assert columns[first, -1] == recordings.drive[first]
    assert columns.shape[0] == len(recordings.force)


def test_the_trees_draw_no_random_number() -> None:
    rng = np.random.default_rng(4)
    states = rng.standard_normal((2 * MOST_ROWS, 2))
    target = np.sin(states[:, 0]) + 0.1 * rng.standard_normal(len(states))
    first, second = (_trees(3).set_params(random_state=seed).fit(states, target) for seed in (0, 1))
    np.testing.assert_array_equal(first.predict(states), second.predict(states))


def test_the_interval_of_the_error_is_drawn_from_the_generator_that_is_passed() -> None:
    recordings = plain_fit("accumulator").problem.recordings
    rng = np.random.default_rng(5)
    size = len(recordings.force)
    pieces = np.arange(size) * 30 // size
    found = Ceiling(recordings, np.ones(size), (1.0 + 0.05 * pieces) * rng.standard_normal(size), pieces)
    error, (low, high) = found.nrmse(recordings.used, np.random.default_rng(6))
    assert low < error < high
    assert found.nrmse(recordings.used, np.random.default_rng(6)) == (error, (low, high))
    assert found.nrmse(recordings.used, np.random.default_rng(7)) != (error, (low, high))
