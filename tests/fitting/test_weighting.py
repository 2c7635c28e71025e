"""Weighted rows without their means."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.fitting.weighting import Weighting, centred


def _weighting(rng: np.random.Generator, tests: int, used: float) -> Weighting:
    lengths = rng.integers(3, 30, tests)
    test = np.repeat(np.arange(tests), lengths)
    root = rng.uniform(0.1, 2.0, test.size)
    chosen = rng.random(test.size) < used
    chosen[np.unique(test, return_index=True)[1]] = True
    at = np.flatnonzero(chosen)
    first = np.unique(test[at], return_index=True)[1]
    sums = np.bincount(test[at], weights=root[at] ** 2)
    nothing = np.zeros(0)
    return Weighting(at, root[at], np.append(first, at.size), sums, test[at], test.size, nothing, nothing)


@pytest.mark.property
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(0.1, 1.0))
def test_rows_have_the_weighted_mean_of_each_test_taken_off(seed: int, tests: int, used: float) -> None:
    """The same as numpy's weighted averages, and orthogonal to an offset of each test."""
    rng = np.random.default_rng(seed)
    w = _weighting(rng, tests, used)
    columns = rng.normal(size=(4, w.samples))
    rows, means = centred(columns, w)
    for test in range(tests):
        own = w.test == test
        picked, root = columns[:, w.at[own]], w.root[own]
        mean = np.average(picked, axis=1, weights=root**2)
        np.testing.assert_allclose(means[:, test], mean, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(rows[:, own], (picked - mean[:, None]) * root, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(rows[:, own] @ root, 0.0, atol=1e-9)


@pytest.mark.property
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_shows_in_the_mean_of_its_test(value: float) -> None:
    """A fit recognises a model that diverged by the means alone; a sample that is not compared does not count."""
    w = _weighting(np.random.default_rng(1), 3, 0.7)
    columns = np.ones((2, w.samples))
    columns[1, w.at[5]] = value
    columns[0, np.setdiff1d(np.arange(w.samples), w.at)] = value
    means = centred(columns, w)[1]
    assert np.isfinite(means[0]).all()
    assert not np.isfinite(means[1, w.test[5]])


@pytest.mark.property
def test_rows_at_the_samples_compared_alone_are_refused() -> None:
    """Compiled code would read beyond their end."""
    w = _weighting(np.random.default_rng(1), 3, 0.5)
    with pytest.raises(ValueError, match="samples"):
        centred(np.ones((2, w.samples))[:, w.at], w)
