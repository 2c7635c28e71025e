"""A flexible model shows how much of a residual can be learned at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.tracing.bench.residuals.ceiling import flexible_chi_square, lagged_states
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
