"""Fit of a base form with effects: simulate, solve for the linear coefficients, search the nonlinear ones.

The residual depends on the searched parameters only, after the linear coefficients are solved for at each trial
(variable projection; Golub and Pereyra 1973, SIAM J. Numer. Anal. 10, 413-432).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.dampers.laws import Law
from mrpipe.dampers.plant import Chain, Step, build_chain
from mrpipe.fitting.averaging import moving_average
from mrpipe.fitting.kernel import (
    COLUMNS,
    CURRENT_AT,
    HYSTERESIS_AT,
    KNOWN_AT,
    PART_AT,
    SUM_VELOCITY_AT,
    VISCOSITY_AT,
    YIELD_AT,
    filter_parts,
    run_recordings,
)
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.weighting import Weighting, centred, weighting

COUPLING_PASSES = 6
"""Number of times that the laws which a coupled form reads are updated at the end of a fit."""

OLDEST_JACOBIAN = 3
"""Number of steps after which the Jacobian is computed by finite differences again."""


@dataclass(frozen=True)
class Fit:
    """A fitted problem.

    Attributes
    ----------
    problem
        Problem that was fitted.
    theta
        Searched parameters in the coordinates of the search, see :meth:`Problem.encode`, shape (p,).
    linear
        Linear coefficients, shape (c,): of the laws of the drive (in the basis of their shapes), then amplitudes.
    test_offsets
        Offset of each test [N].
    cost
        Sum of squared weighted residuals.
    residual
        Weighted residual, shape (n,); 0 at samples that are not compared.
    at_bound
        Names of searched parameters and amplitudes of terms at a bound.
    iterations
        Iterations of the search.
    """

    problem: Problem
    theta: FloatArray
    linear: FloatArray
    test_offsets: FloatArray
    cost: float
    residual: FloatArray
    at_bound: tuple[str, ...] = ()
    iterations: int = 0

    @property
    def chi_square(self) -> float:
        """Return the mean squared weighted residual."""
        return self.cost / max(int(np.count_nonzero(self.problem.root_weight)), 1)

    @property
    def laws(self) -> tuple[Law, ...]:
        """Return the laws of the drive: yield force, viscosity and, if present, the force of the second part."""
        return self.problem.base.laws_of(self.linear, self.base_values, self.problem.scales.drive)

    @property
    def term_values(self) -> list[dict[str, float]]:
        """Return the parameter values of each term, amplitudes included."""
        return self._all_values()[1:]

    @property
    def base_values(self) -> dict[str, float]:
        """Return the parameter values of the base form, amplitudes included."""
        return self._all_values()[0]

    def _all_values(self) -> list[dict[str, float]]:
        values = self.problem.values(self.theta)
        first = self.problem.base.columns
        for (index, parameter), value in zip(self.problem.amplitudes, self.linear[first:], strict=True):
            values[index + 1][parameter.name] = float(value)
        return values

    def chain(self) -> Chain:
        """Return the chain of steps with the fitted numbers."""
        return build_chain(self.steps())

    def steps(self) -> list[Step]:
        """Return all steps of the fitted damper."""
        problem = self.problem
        steps = problem.base.steps(self.base_values, *self.laws)
        for term, values in zip(problem.terms, self.term_values, strict=True):
            steps.extend(term.form.steps(values))
        return steps


def chain_of(problem: Problem, theta: FloatArray) -> tuple[Chain, tuple[int, ...], list[int]]:
    """Return the chain, the tapped places in rising order, and for each amplitude the index of its tap."""
    values = problem.values(theta)
    steps = _with_taps(problem.base.steps(values[0], *problem.reference), problem.base.form.amplitude_steps, -1, 1)
    for index, (term, given) in enumerate(zip(problem.terms, values[1:], strict=True)):
        steps.extend(_with_taps(term.form.steps(given), term.form.amplitude_steps, index, 0))
    chain = build_chain(steps)
    places = [chain.names.index(f"tap:{index}:{p.name}") for index, p in problem.amplitudes]
    tapped = tuple(sorted(places))
    return chain, tapped, [tapped.index(place) for place in places]


def _with_taps(steps: list[Step], amplitude_steps: Mapping[str, int], index: int, first: int) -> list[Step]:
    for name, place in amplitude_steps.items():
        steps[first + place] = replace(steps[first + place], name=f"tap:{index}:{name}")
    return steps


def regressors(problem: Problem, theta: FloatArray) -> FloatArray:
    """Return the regressors of all linear coefficients, shape (c, n), without weights."""
    chain, tapped, order = chain_of(problem, theta)
    wires = run_recordings(chain, problem.recordings, tapped)
    base, drive = problem.base, problem.scales.drive
    share = wires[CURRENT_AT] / drive
    signals = (
        wires[HYSTERESIS_AT] * wires[YIELD_AT],
        wires[SUM_VELOCITY_AT] * wires[VISCOSITY_AT],
        wires[PART_AT],
    )
    columns = np.empty((base.columns + len(order), wires.shape[1]))
    row = 0
    scales = base.scale_shares(problem.values(theta)[0], drive)
    for law, signal, scale in zip(base.laws, signals, scales, strict=False):
        np.multiply(law.basis(share, scale), signal, out=columns[row : row + law.count])
        row += law.count
    if base.form.known:
        columns[row] = wires[KNOWN_AT]
        row += 1
    for place in order:
        columns[row] = wires[COLUMNS + place]
        row += 1
    if chain.filters:
        columns = filter_parts(chain, columns, problem.recordings)
    if problem.window_share > 0.0:
        columns = moving_average(columns, problem.recordings, problem.window_share)
    return columns


@dataclass(frozen=True)
class Solved:
    """Solution of a problem for its linear coefficients, at given searched parameters.

    Attributes
    ----------
    residual
        Weighted residual at the m samples that are compared, shape (m,).
    linear
        Coefficients.
    means
        Offset of each test present [N].
    at_bound
        Whether each coefficient lies at a bound, shape (c,).
    """

    residual: FloatArray
    linear: FloatArray
    means: FloatArray
    at_bound: BoolArray

    @property
    def cost(self) -> float:
        """Sum of squared weighted residuals."""
        return float(self.residual @ self.residual)


def solve(problem: Problem, theta: FloatArray, w: Weighting) -> Solved:
    """Return the solution for the linear coefficients; a coupled form reads the laws of the problem's reference."""
    rows, means = centred(regressors(problem, theta), w)
    count = len(rows)
    # one value that is not finite would make the mean of its test not finite
    if not np.all(np.isfinite(means)):
        wrong = np.full(len(w.at), 1e6)
        return Solved(wrong, np.zeros(count), np.zeros(len(w.sums)), np.ones(count, bool))
    low, high = problem.linear_bounds
    linear, at_bound = bounded_solution(rows @ rows.T, rows @ w.target, low, high)
    return Solved(w.target - linear @ rows, linear, w.target_means - linear @ means, at_bound)


def bounded_solution(
    gram: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Solve the normal equations within bounds by an active-set method; also return which coefficients are at a bound.

    A coefficient that leaves its bounds is fixed at the bound, and the others are solved for again. A bound is released
    if the gradient points away from it (Lawson and Hanson 1974, Solving Least Squares Problems, chapter 23).
    """
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram / (scale[:, None] * scale)
    scaled.flat[:: len(scale) + 1] += 1e-10
    target = right / scale
    low, high = low * scale, high * scale
    solution = np.zeros(len(right))
    fixed = low == high
    solution[fixed] = low[fixed]
    for _ in range(3 * len(right) + 1):
        free = ~fixed
        if fixed.any():
            rest = target[free] - scaled[np.ix_(free, fixed)] @ solution[fixed]
            solution[free] = np.linalg.solve(scaled[np.ix_(free, free)], rest)
        else:
            solution = np.linalg.solve(scaled, target)
        outside = free & ((solution < low - 1e-12) | (solution > high + 1e-12))
        if outside.any():
            solution[outside] = np.clip(solution[outside], low[outside], high[outside])
            fixed |= outside
            continue
        if not fixed.any():
            break
        slope = target - scaled @ solution
        inward = fixed & (low < high) & np.where(solution <= low, slope > 1e-9, slope < -1e-9)
        if not inward.any():
            break
        fixed[int(np.argmax(np.where(inward, np.abs(slope), 0.0)))] = False
    return solution / scale, fixed


def fit(problem: Problem, start: FloatArray, *, iterations: int = 15, tolerance: float = 2e-4) -> Fit:
    """Fit from a starting point by the Levenberg-Marquardt method on the projected residual.

    The steps of a coupled form read the laws of the drive, which are themselves fitted. The post-yield forces determine
    these laws almost independently of the motion before yielding. The search is therefore repeated with the laws of the
    search before, until they agree.
    """
    if not problem.base.form.coupled:
        return _search(problem, start, iterations, tolerance)
    each = max(3, iterations // 3)
    best = found = _search(problem, start, each, tolerance)
    idle = 0
    for _ in range(max(1, min(COUPLING_PASSES, iterations // 2))):
        before = best.cost
        found = _search(replace(problem, reference=found.laws), found.theta, each, tolerance)
        best = min(best, found, key=lambda item: item.cost)
        idle = idle + 1 if best.cost > 0.99 * before else 0
        if idle == 2:
            break
    return best


def _search(problem: Problem, start: FloatArray, iterations: int, tolerance: float) -> Fit:
    w = weighting(problem)
    low, high = problem.bounds()
    theta = np.clip(start, low, high)
    found = solve(problem, theta, w)
    cost = found.cost
    damping, done, jacobian, age = 1e-3, 0, np.zeros((len(theta), len(found.residual))), OLDEST_JACOBIAN
    for done in range(1, iterations + 1):  # noqa: B007 - counted for the report
        if age >= OLDEST_JACOBIAN:
            jacobian, age = jacobian_of(problem, theta, found.residual, w, low, high), 0
        gram, gradient = jacobian @ jacobian.T, jacobian @ found.residual
        diagonal = np.maximum(np.diag(gram), 1e-12 * max(float(np.max(np.diag(gram), initial=0.0)), 1e-300))
        before, improved = cost, False
        for _ in range(5 if age == 0 else 2):
            free = ~(((theta <= low) & (gradient > 0)) | ((theta >= high) & (gradient < 0)))
            step = np.zeros(len(theta))
            if free.any():
                matrix = gram[np.ix_(free, free)] + damping * np.diag(diagonal[free])
                step[free] = -np.linalg.lstsq(matrix, gradient[free], rcond=None)[0]
            trial = np.clip(theta + np.clip(step, -1.0, 1.0), low, high)
            tried = solve(problem, trial, w)
            if tried.cost < cost:
                moved = trial - theta
                missed = tried.residual - found.residual - moved @ jacobian
                # a simulation for every parameter is expensive: Broyden's update is used between two Jacobians by
                # differences
                jacobian += np.outer(moved / max(float(moved @ moved), 1e-300), missed)
                theta, cost, improved, found = trial, tried.cost, True, tried
                damping = max(damping * 0.2, 1e-9)
                break
            damping *= 8.0
        if improved and before - cost >= tolerance * before:
            age += 1
        elif age == 0:
            break
        else:
            age = OLDEST_JACOBIAN
    return finish(problem, theta, w, found, done)


def jacobian_of(
    problem: Problem, theta: FloatArray, residual: FloatArray, w: Weighting, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the derivative of the projected residual with respect to theta, shape (p, m), by finite differences."""
    rows = np.empty((len(theta), len(residual)))
    for k in range(len(theta)):
        width = 1e-3 * max(1.0, 0.02 * (high[k] - low[k])) if problem.searched[k][1].logarithmic else 0.0
        if width == 0.0:
            width = max(2e-5, 2e-3 * abs(theta[k]))
        width = -width if theta[k] + width > high[k] else width
        rows[k] = 0.0  # if the damper is unstable on both sides of a value, the value is kept
        for side in (width, -width):
            moved = theta.copy()
            moved[k] += side
            row = (solve(problem, moved, w).residual - residual) / side
            if np.isfinite(row @ row):
                rows[k] = row
                break
    return rows


def finish(problem: Problem, theta: FloatArray, w: Weighting, found: Solved, iterations: int = 0) -> Fit:
    """Return the fit at these searched parameters; a coupled form then reads the laws of the fit itself."""
    if problem.base.form.coupled and np.any(found.linear):
        for _ in range(COUPLING_PASSES):
            laws = problem.base.laws_of(found.linear, problem.values(theta)[0], problem.scales.drive)
            problem = replace(problem, reference=laws)
            found = solve(problem, theta, w)
    low, high = problem.bounds()
    margin = 1e-3 * (high - low)
    names = [
        parameter.name
        for (index, parameter), t, a, b, m in zip(problem.searched, theta, low, high, margin, strict=True)
        if index >= 0 and (t <= a + m or t >= b - m)
    ]
    first = problem.base.columns
    names += [
        p.name for (k, p), stuck in zip(problem.amplitudes, found.at_bound[first:], strict=True) if stuck and k >= 0
    ]
    full = np.zeros(len(problem.recordings.force))
    full[w.at] = found.residual
    offsets = np.zeros(problem.recordings.tests)
    if problem.offsets:
        offsets[np.unique(w.test)] = found.means
    else:
        offsets[:] = found.means[0]
    return Fit(problem, theta, found.linear, offsets, found.cost, full, tuple(names), iterations)


def predict(found: Fit, recordings: Recordings) -> FloatArray:
    """Return the force [N] of a fitted damper on other tests, shape (n,), in a free run and without test offsets."""
    problem = replace(found.problem, recordings=recordings, root_weight=np.zeros(len(recordings.force)))
    return np.asarray(found.linear @ regressors(problem, found.theta))


def start_of(problem: Problem, base: Mapping[str, float], terms: Sequence[Mapping[str, float]]) -> FloatArray:
    """Return a starting point from values of the base and of each term; parameters left out take their first start."""
    given = [base, *terms]
    values = []
    for index, parameter in problem.searched:
        default = parameter.start_values(problem.scales)[0]
        values.append(float(given[index + 1].get(parameter.name, default)))
    low, high = problem.bounds()
    return np.clip(problem.encode(values), low, high)
