"""Gains from Riccati equations, against the library control."""

from __future__ import annotations

import control
import numpy as np
import pytest

from mrpipe.control.riccati import kalman_bucy_gain, predictor_gain, regulator_gain

pytestmark = pytest.mark.oracle

RNG = np.random.default_rng(4)
A, B, C = RNG.standard_normal((4, 4)), RNG.standard_normal((4, 2)), RNG.standard_normal((3, 4))
Q, R, S = 3.0 * np.eye(4), np.diag([1.0, 2.0]), 0.1 * RNG.standard_normal((4, 2))
NOISE = np.diag([0.1, 0.2, 0.3])


@pytest.mark.parametrize("mixed", [None, S])
def test_regulator(mixed: np.ndarray | None) -> None:
    expected = control.lqr(A, B, Q, R, np.zeros((4, 2)) if mixed is None else mixed)[0]
    np.testing.assert_allclose(regulator_gain(A, B, Q, R, mixed), expected, rtol=1e-8)


def test_continuous_filter() -> None:
    expected = control.lqe(A, np.eye(4), C, Q, NOISE)[0]
    np.testing.assert_allclose(kalman_bucy_gain(A, C, Q, NOISE, np.zeros((4, 3))), expected, rtol=1e-8)


def test_discrete_predictor() -> None:
    # the library returns the gain of the filter, which the predictor multiplies by A
    expected = control.dlqe(0.3 * A, np.eye(4), C, Q, NOISE)[0]
    np.testing.assert_allclose(predictor_gain(0.3 * A, C, Q, NOISE), expected, rtol=1e-8)
