"""LQG with mended signs, against python-control and by what it must do."""

from __future__ import annotations

import control
import numpy as np
import pytest

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.lqg import (
    Outputs,
    output_observer_gain,
    output_regulator_gain,
    sampled_controller,
)
from mrpipe.control.riccati import regulator_gain


def plant(seed: int = 5, n: int = 4, k: int = 2, p: int = 3, m: int = 2) -> tuple[FloatArray, ...]:
    rng = np.random.default_rng(seed)
    omega = np.diag(rng.uniform(2.0, 12.0, n))
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -(omega**2)
    A[n:, n:] = -0.02 * omega
    B = np.vstack([np.zeros((n, k)), rng.standard_normal((n, k))])
    E = np.vstack([np.zeros((n, m)), rng.standard_normal((n, m))])
    C = rng.standard_normal((p, 2 * n))
    return A, B, E, C, rng.standard_normal((p, k)), rng.standard_normal((p, m))


@pytest.mark.oracle
@pytest.mark.parametrize("seed", range(4))
def test_regulator_with_cross_term_agrees_with_python_control(seed: int) -> None:
    A, B, _, C, D, _ = plant(seed)
    Q, R = np.diag([3.0, 1.0, 2.0]), np.diag([0.5, 2.0])
    ours = output_regulator_gain(A, B, Outputs(C, D, np.zeros((3, 1))), Q, R)
    weight, cost = C.T @ Q @ C, D.T @ Q @ D + R
    theirs, _, _ = control.lqr(A, B, 0.5 * (weight + weight.T), 0.5 * (cost + cost.T), C.T @ Q @ D)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.oracle
@pytest.mark.parametrize("seed", range(4))
def test_observer_agrees_with_python_control(seed: int) -> None:
    A, _, E, C, D, _ = plant(seed)
    Sw, Sv = np.diag([2.0, 0.5]), np.diag([0.1, 0.2, 0.3])
    ours = output_observer_gain(A, E, Outputs(C, D, np.zeros((3, 2))), Sw, Sv)
    theirs, _, _ = control.lqe(A, E, C, Sw, Sv)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.oracle
def test_observer_with_correlated_noise_is_the_decorrelated_problem() -> None:
    # process noise E w and measurement noise F w + v: subtract S R^-1 y from the plant, and the noises are independent
    A, _, E, C, D, F = plant(7)
    Sw, Sv = np.diag([2.0, 0.5]), np.diag([0.1, 0.2, 0.3])
    ours = output_observer_gain(A, E, Outputs(C, D, F), Sw, Sv)
    R = Sv + F @ Sw @ F.T
    S = E @ Sw @ F.T
    shift = S @ np.linalg.inv(R)
    Q = E @ Sw @ E.T - shift @ S.T
    theirs, _, _ = control.lqe(A - shift @ C, np.eye(8), C, 0.5 * (Q + Q.T), R)
    np.testing.assert_allclose(ours, theirs + shift, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.literature
def test_the_printed_sign_is_unstable_and_ours_is_not() -> None:
    # errata row 18: u = -K x with K = -R^-1(B'P + S')
    A, B, _, _, _, _ = plant()
    K = regulator_gain(A, B, np.eye(8), np.eye(2), np.zeros((8, 2)))
    assert np.linalg.eigvals(A - B @ K).real.max() < 0.0
    assert np.linalg.eigvals(A + B @ K).real.max() > 0.0


@pytest.mark.property
def test_separation_principle_and_sampling() -> None:
    A, B, E, C, D, F = plant()
    outputs = Outputs(C, D, F)
    K = output_regulator_gain(A, B, outputs, np.eye(3), np.eye(2))
    L = output_observer_gain(A, E, outputs, np.eye(2), 0.1 * np.eye(3))
    # plant and observer together
    joint = np.sort_complex(np.linalg.eigvals(np.block([[A, -B @ K], [L @ C, A - B @ K - L @ C]])))
    apart = np.sort_complex(np.concatenate([np.linalg.eigvals(A - B @ K), np.linalg.eigvals(A - L @ C)]))
    np.testing.assert_allclose(joint.real.sum(), apart.real.sum(), rtol=1e-8)
    assert joint.real.max() < 0.0
    sampled = sampled_controller(A, B, outputs, K, L, 1e-6)
    np.testing.assert_allclose((sampled.step - np.eye(8)) / 1e-6, A - L @ C, rtol=1e-3, atol=1e-2)
