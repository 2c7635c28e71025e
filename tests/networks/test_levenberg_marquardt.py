"""Jacobian, exact compression and stopping rules."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from mrpipe.networks.levenberg_marquardt import fit
from mrpipe.networks.problem import CHUNK_ROWS, Problem, pack, unpack
from mrpipe.networks.stopping import StoppingRules


def common_problem(rows: int = 300, *, biases: bool = True, layers: tuple[int, ...] = (4, 5, 3, 1)) -> Problem:
    rng = np.random.default_rng(5)
    inputs = rng.normal(size=(layers[0], rows))
    target = np.tanh(1.5 * inputs[0] - inputs[1]) + 0.3 * inputs[2] * inputs[3] + 0.01 * rng.normal(size=rows)
    return Problem(inputs, target, layers, biases)


@pytest.mark.oracle
@pytest.mark.parametrize("biases", [False, True])
@pytest.mark.parametrize("layers", [(4, 1), (4, 3, 1), (4, 5, 3, 1), (4, 3, 3, 3, 1)])
def test_jacobian_agrees_with_differences(layers: tuple[int, ...], biases: bool) -> None:
    problem = common_problem(40, biases=biases, layers=layers)
    parameters = np.random.default_rng(1).uniform(-0.7, 0.7, problem.size)
    exact = problem.jacobian(parameters)
    for index in range(problem.size):
        step = np.zeros(problem.size)
        step[index] = 1e-6
        slope = (problem.residual(parameters + step) - problem.residual(parameters - step)) / 2e-6
        np.testing.assert_allclose(exact[:, index], slope, atol=1e-8)


@pytest.mark.property
@pytest.mark.parametrize("biases", [False, True])
def test_packing_is_undone_by_unpacking(biases: bool) -> None:
    parameters = np.arange(float(common_problem(biases=biases).size))
    weights, offsets = unpack(parameters, (4, 5, 3, 1), biases)
    np.testing.assert_array_equal(pack(weights, offsets, biases), parameters)


@pytest.mark.property
@pytest.mark.parametrize("rows", [7, 300, CHUNK_ROWS, 2 * CHUNK_ROWS + 13])
def test_compression_keeps_norm_gradient_and_curvature(rows: int) -> None:
    problem = common_problem(rows)
    parameters = np.random.default_rng(2).uniform(-1.0, 1.0, problem.size)
    residual, jacobian = problem.residual(parameters), problem.jacobian(parameters)
    small, matrix = problem.compressed(parameters)
    assert matrix.shape == (problem.size + 1, problem.size)
    assert small @ small == pytest.approx(residual @ residual / rows, rel=1e-12)
    np.testing.assert_allclose(matrix.T @ small, jacobian.T @ residual / rows, atol=1e-13)
    np.testing.assert_allclose(matrix.T @ matrix, jacobian.T @ jacobian / rows, atol=1e-12)
    assert problem.mean_square(parameters) == pytest.approx(small @ small, rel=1e-12)


@pytest.mark.property
@pytest.mark.parametrize("single", [False, True])
def test_threads_do_not_change_the_gram_matrix(single: bool) -> None:
    problem = replace(common_problem(5 * CHUNK_ROWS + 3), single=single)
    parameters = np.random.default_rng(2).uniform(-1.0, 1.0, problem.size)
    np.testing.assert_array_equal(replace(problem, threads=3).gram(parameters), problem.gram(parameters))


@pytest.mark.oracle
def test_a_gram_matrix_in_single_precision_trains_as_well() -> None:
    problem = replace(common_problem(CHUNK_ROWS + 13), weight_decay=1e-5)
    single = replace(problem, single=True)
    parameters = np.random.default_rng(2).uniform(-1.0, 1.0, problem.size)
    exact, rounded = problem.gram(parameters), single.gram(parameters)
    size = np.sqrt(np.diag(exact))
    assert np.max(np.abs(rounded - exact) / np.outer(size, size)) < 2e-6
    assert not np.array_equal(rounded, exact)
    rules = StoppingRules(iterations=40)
    start = np.random.default_rng(3).uniform(-0.5, 0.5, problem.size)
    ends = [fit(item, start, method="mu-identity", rules=rules) for item in (problem, single)]
    assert ends[1].mean_square == pytest.approx(ends[0].mean_square, rel=1e-3)
    # what is reported, and what accepts a step, is in double precision
    assert ends[1].mean_square == problem.mean_square(ends[1].parameters)
    assert np.all(np.diff(ends[1].path) < 0.0)


@pytest.mark.oracle
@pytest.mark.parametrize("method", ["trf", "lm"])
def test_compressed_least_squares_takes_the_path_of_the_plain_one(method: str) -> None:
    """Issue: the exactly compressed problem is proven equal to the plain one on a common problem."""
    problem = common_problem()
    start = np.random.default_rng(3).uniform(-0.5, 0.5, problem.size)
    scale = np.sqrt(problem.rows)
    paths: dict[str, list[np.ndarray]] = {"plain": [], "compressed": []}

    def plain_jacobian(parameters: np.ndarray) -> np.ndarray:
        paths["plain"].append(parameters.copy())
        return problem.jacobian(parameters) / scale

    def compressed_jacobian(parameters: np.ndarray) -> np.ndarray:
        paths["compressed"].append(parameters.copy())
        return problem.compressed(parameters)[1]

    options = {"method": method, "x_scale": "jac", "max_nfev": 25}
    plain = least_squares(lambda p: problem.residual(p) / scale, start, jac=plain_jacobian, **options)
    compressed = least_squares(lambda p: problem.compressed(p)[0], start, jac=compressed_jacobian, **options)
    assert plain.nfev == compressed.nfev
    assert len(paths["plain"]) == len(paths["compressed"]) > 8
    # compression squares the condition number, so rounding may reach eps cond^2 along the path and no more
    bound = 10.0 * np.finfo(float).eps * np.linalg.cond(problem.jacobian(plain.x)) ** 2
    assert bound < 1e-3
    for one, other in zip(paths["plain"], paths["compressed"], strict=True):
        np.testing.assert_allclose(other, one, rtol=bound, atol=bound)
    assert compressed.cost == pytest.approx(plain.cost, rel=max(bound, 1e-12))


@pytest.mark.oracle
@pytest.mark.parametrize("method", ["least-squares", "minpack", "mu-identity", "mu-diagonal"])
def test_all_methods_solve_a_linear_problem_as_the_normal_equations_do(method: str) -> None:
    problem = common_problem(layers=(4, 1))
    outcome = fit(problem, np.zeros(problem.size), method=method, rules=StoppingRules(iterations=60))  # type: ignore[arg-type]
    design = np.vstack([problem.inputs, np.ones(problem.rows)]).T
    exact = np.linalg.lstsq(design, problem.target, rcond=None)[0]
    np.testing.assert_allclose(outcome.parameters, exact, atol=1e-5)


@pytest.mark.property
@pytest.mark.parametrize("method", ["least-squares", "minpack", "mu-identity", "mu-diagonal"])
def test_the_error_never_rises_along_the_path(method: str) -> None:
    problem = common_problem()
    start = np.random.default_rng(4).uniform(-0.5, 0.5, problem.size)
    outcome = fit(problem, start, method=method, rules=StoppingRules(iterations=40))  # type: ignore[arg-type]
    assert np.all(np.diff(outcome.path) < 0.0)
    assert outcome.mean_square == outcome.path[-1] == pytest.approx(problem.mean_square(outcome.parameters), rel=1e-9)
    assert outcome.path[-1] < 0.2 * outcome.path[0]


@pytest.mark.property
def test_six_held_out_failures_end_training_with_the_best_parameters() -> None:
    problem = common_problem(30, layers=(4, 8, 1))
    held_out = common_problem(200, layers=(4, 8, 1))
    start = np.random.default_rng(6).uniform(-0.5, 0.5, problem.size)
    outcome = fit(problem, start, method="mu-diagonal", held_out=held_out)
    assert outcome.reason == "held-out failures"
    assert outcome.held_out_mean_square == pytest.approx(held_out.mean_square(outcome.parameters), rel=1e-9)
    longer = fit(
        problem, start, method="mu-diagonal", held_out=held_out, rules=StoppingRules(iterations=outcome.iterations - 6)
    )
    np.testing.assert_array_equal(longer.parameters, outcome.parameters)


@pytest.mark.property
@pytest.mark.parametrize(
    ("rules", "reason"),
    [
        (StoppingRules(iterations=3), "iterations"),
        (StoppingRules(gradient=1e3), "gradient"),
        (StoppingRules(improvement=0.9999), "improvement"),
        (StoppingRules(gradient=0.0, mu_maximum=1e4), "mu"),
    ],
)
def test_every_rule_can_end_training(rules: StoppingRules, reason: str) -> None:
    problem = common_problem(layers=(4, 1) if reason == "mu" else (4, 5, 3, 1))
    start = np.random.default_rng(7).uniform(-0.5, 0.5, problem.size)
    if reason == "mu":
        # at the optimum no step is better, so the damping grows to its limit
        start = fit(problem, start, method="mu-identity").parameters
    assert fit(problem, start, method="mu-identity", rules=rules).reason == reason


@pytest.mark.oracle
@pytest.mark.parametrize("method", ["least-squares", "minpack", "mu-identity"])
def test_weight_decay_is_ridge_regression_where_the_network_is_linear(method: str) -> None:
    from dataclasses import replace

    from sklearn.linear_model import Ridge

    problem = replace(common_problem(layers=(4, 1), biases=False), weight_decay=0.3)
    outcome = fit(problem, np.zeros(problem.size), method=method, rules=StoppingRules(gradient=1e-12))  # type: ignore[arg-type]
    oracle = Ridge(alpha=0.3 * problem.rows, fit_intercept=False).fit(problem.inputs.T, problem.target)
    np.testing.assert_allclose(outcome.parameters, oracle.coef_, atol=1e-6)


@pytest.mark.oracle
def test_minpack_is_the_method_lm_of_scipy() -> None:
    """Started close to a minimum, so that no rule of ours ends the fit before MINPACK does."""
    problem = common_problem(200, layers=(4, 2, 1))
    near = fit(problem, np.random.default_rng(3).uniform(-0.5, 0.5, problem.size), method="mu-identity").parameters
    rules = StoppingRules(iterations=500, gradient=0.0, improvement=0.0)
    ours = fit(problem, near + 1e-3, method="minpack", rules=rules)
    plain = least_squares(problem.residual, near + 1e-3, jac=problem.jacobian, method="lm", x_scale="jac")
    assert ours.mean_square == pytest.approx(2.0 * plain.cost / problem.rows, rel=1e-8)
    assert ours.reason == "step"
