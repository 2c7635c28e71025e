"""Gains of the filter that runs at samples, against those of the continuous filter."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.control.kalman import discrete_kalman_gains
from mrpipe.signals.kalman import continuous_kalman_gains

DT = 1e-5


@pytest.mark.literature
def test_sampled_fast_the_filter_is_the_continuous_one_of_the_thesis() -> None:
    np.testing.assert_allclose(discrete_kalman_gains(20e-6, 0.1, DT)[:2] / DT, [100.0, 5000.0], rtol=2e-3)
    gains = continuous_kalman_gains(20e-6, 0.1)
    assert (gains.k, gains.l) == (pytest.approx(100.0), pytest.approx(5000.0))


@pytest.mark.property
@pytest.mark.parametrize("drift", [1e-3, 0.1])
def test_the_drift_of_the_bias_is_the_same_quantity_in_both_filters(drift: float) -> None:
    discrete = discrete_kalman_gains(20e-6, 0.1, DT, drift) / DT
    gains = continuous_kalman_gains(20e-6, 0.1, drift, 1.0 / DT)
    np.testing.assert_allclose(discrete, [gains.k, gains.l, -gains.m], rtol=5e-3)
