"""Means of successive windows and their standard errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from mrpipe.simulation.windows import QUANTITIES, mean_values, standard_errors

RMS, LARGEST = QUANTITIES.index("rms_x_top_m"), QUANTITIES.index("max_x_top_m")


def windows(column: np.ndarray) -> np.ndarray:
    return np.tile(column[:, None], (1, len(QUANTITIES)))


@pytest.mark.property
def test_the_rms_value_of_a_run_is_not_the_mean_of_those_of_its_windows() -> None:
    found = mean_values(windows(np.array([3.0, 4.0])))
    assert found[RMS] == pytest.approx(np.sqrt(12.5))
    assert found[LARGEST] == 3.5


@pytest.mark.oracle
def test_the_standard_error_of_correlated_windows() -> None:
    """The variance of the mean of a first-order autoregression is 1 / (1 - a)^2 over the number of samples."""
    a, count = 0.9, 4096
    rng = np.random.default_rng(3)
    ratios, naive = [], []
    for _ in range(20):
        sample = 100.0 + lfilter([1.0], [1.0, -a], rng.standard_normal(count))
        exact = 1.0 / (1.0 - a) / np.sqrt(count)
        ratios.append(standard_errors(windows(sample)) / exact)
        naive.append(np.std(sample) / np.sqrt(count) / exact)
    # the largest over all block lengths is chosen, so that the error is rather too large
    assert 0.9 < np.mean(ratios, axis=0)[LARGEST] < 1.5
    assert np.mean(ratios, axis=0)[RMS] == pytest.approx(np.mean(ratios, axis=0)[LARGEST], rel=0.01)
    assert np.mean(naive) < 0.3


@pytest.mark.property
def test_two_windows_give_half_their_difference_and_no_response_has_no_error() -> None:
    assert standard_errors(windows(np.array([1.0, 1.02])))[LARGEST] == pytest.approx(0.01)
    assert np.all(standard_errors(windows(np.zeros(20))) == 0.0)


@pytest.mark.property
def test_runs_that_differ_tell_more_than_their_windows() -> None:
    low, high = windows(np.full(40, 1.0)), windows(np.full(40, 1.2))
    assert standard_errors(low, high)[LARGEST] == pytest.approx(0.1)
    # a run counts by its length
    assert standard_errors(low, low, high[:4])[LARGEST] < 0.02
