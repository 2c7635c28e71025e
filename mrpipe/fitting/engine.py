"""Fit of a base form with effects: simulate, project the linear coefficients out, search the few that are left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.dampers.plant import Chain, Step, build_chain
from mrpipe.fitting.kernel import (
    COLUMNS,
    CURRENT_AT,
    HYSTERESIS_AT,
    VELOCITY_AT,
    VISCOSITY_AT,
    YIELD_AT,
    run_recordings,
)
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.recordings import Recordings

OLDEST_JACOBIAN = 3
"""After so many steps the Jacobian is taken by differences again."""


@dataclass(frozen=True)
class Fit:
    """A fitted problem.

    Attributes
    ----------
    theta
        Searched values as the search sees them.
    linear
        Coefficients: yield force and viscosity (in powers of drive over its scale), then amplitudes.
    test_offsets
        Offset of each test [N].
    cost
        Sum of squared weighted residuals.
    residual
        Weighted residual, shape (n,), 0 where not compared.
    at_bound
        Names of searched parameters and amplitudes at a bound.
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
    def polynomials(self) -> tuple[FloatArray, FloatArray]:
        """Return yield force and viscosity in powers of the drive."""
        base, drive = self.problem.base, self.problem.scales.drive
        split = base.yield_order + 1
        forces = self.linear[:split] / drive ** np.arange(split)
        count = base.viscosity_order + 1
        return forces, self.linear[split : split + count] / drive ** np.arange(count)

    @property
    def term_values(self) -> list[dict[str, float]]:
        """Return the values of each term with its amplitudes."""
        values = self.problem.values(self.theta)[1:]
        first = self.problem.base.yield_order + self.problem.base.viscosity_order + 2
        for (index, parameter), value in zip(self.problem.amplitudes, self.linear[first:], strict=True):
            values[index][parameter.name] = float(value)
        return values

    @property
    def base_values(self) -> dict[str, float]:
        """Return the values of the base form."""
        return self.problem.values(self.theta)[0]

    def chain(self) -> Chain:
        """Return the chain with these numbers; amplitudes scale with the fit's own reference."""
        return build_chain(self.steps())

    def steps(self) -> list[Step]:
        """Return all steps of the fitted damper."""
        problem = self.problem
        steps = problem.base.steps(self.base_values, *self.polynomials)
        for term, values in zip(problem.terms, self.term_values, strict=True):
            steps.extend(term.form.steps(values))
        return steps


def chain_of(problem: Problem, theta: FloatArray) -> tuple[Chain, tuple[int, ...], list[int]]:
    """Return chain, tapped places (rising) and, for each amplitude, which of the taps is its."""
    values = problem.values(theta)
    steps = problem.base.steps(values[0], *problem.reference)
    for index, (term, given) in enumerate(zip(problem.terms, values[1:], strict=True)):
        made = term.form.steps(given)
        for name, place in term.form.amplitude_steps.items():
            made[place] = replace(made[place], name=f"tap:{index}:{name}")
        steps.extend(made)
    chain = build_chain(steps)
    places = [chain.names.index(f"tap:{index}:{p.name}") for index, p in problem.amplitudes]
    tapped = tuple(sorted(places))
    return chain, tapped, [tapped.index(place) for place in places]


def regressors(problem: Problem, theta: FloatArray) -> FloatArray:
    """Return the columns of all linear coefficients, shape (c, n), not weighted."""
    chain, tapped, order = chain_of(problem, theta)
    wires = run_recordings(chain, problem.recordings, tapped)
    share = wires[CURRENT_AT] / problem.scales.drive
    base = problem.base
    columns = np.empty((base.yield_order + base.viscosity_order + 2 + len(order), wires.shape[1]))
    column = wires[HYSTERESIS_AT] * wires[YIELD_AT]
    row = 0
    for _ in range(base.yield_order + 1):
        columns[row] = column
        column = column * share
        row += 1
    column = wires[VELOCITY_AT] * wires[VISCOSITY_AT]
    for _ in range(base.viscosity_order + 1):
        columns[row] = column
        column = column * share
        row += 1
    for place in order:
        columns[row] = wires[COLUMNS + place]
        row += 1
    if problem.window_share > 0.0:
        columns = moving_average(columns, problem.recordings, problem.window_share)
    return columns


def moving_average(columns: FloatArray, recordings: Recordings, window_share: float) -> FloatArray:
    """Return rows averaged over a share of each test's period, centred; tests without a period are left alone."""
    result = columns.copy()
    for test in range(recordings.tests):
        half = 0.5 * window_share * recordings.period_s[test] / recordings.dt[test]
        if half < 0.05:
            continue
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        values = columns[..., piece]
        length = values.shape[-1]
        # integral of the straight-line signal between shifted limits, so that the window may be any fraction of samples
        total = np.zeros((*values.shape[:-1], length))
        total[..., 1:] = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1)
        at = np.arange(length)
        low, high = np.maximum(at - half, 0.0), np.minimum(at + half, length - 1.0)
        result[..., piece] = (_at(total, high) - _at(total, low)) / (high - low)
    return result


def _at(total: FloatArray, place: FloatArray) -> FloatArray:
    whole = np.minimum(place.astype(np.int64), total.shape[-1] - 2)
    part = place - whole
    return np.asarray(total[..., whole] * (1.0 - part) + total[..., whole + 1] * part)


@dataclass(frozen=True)
class Weighting:
    """The samples compared, their weights, and where each test begins among them."""

    at: IntArray
    root: FloatArray
    starts: IntArray
    sums: FloatArray
    test: IntArray


def weighting(problem: Problem) -> Weighting:
    """Return the samples compared."""
    at = np.flatnonzero(problem.root_weight)
    root = problem.root_weight[at]
    test = problem.recordings.test[at] if problem.offsets else np.zeros(len(at), dtype=np.int64)
    present, starts = np.unique(test, return_index=True)
    del present
    sums = np.add.reduceat(root**2, starts)
    return Weighting(at, root, starts.astype(np.int64), sums, test)


def centred(rows: FloatArray, w: Weighting) -> tuple[FloatArray, FloatArray]:
    """Return weighted rows without their weighted mean in each test, and the means (tests present in columns)."""
    means = np.add.reduceat(rows * w.root**2, w.starts, axis=-1) / w.sums
    lengths = np.diff([*w.starts, rows.shape[-1]])
    return (rows - np.repeat(means, lengths, axis=-1)) * w.root, means


def solve(problem: Problem, theta: FloatArray, w: Weighting) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return weighted residual at the samples compared, coefficients, means of each test, and what sits at a bound."""
    columns = regressors(problem, theta)[:, w.at]
    if not np.all(np.isfinite(columns)):
        return np.full(len(w.at), 1e6), np.zeros(len(columns)), np.zeros(len(w.starts)), np.ones(len(columns), bool)
    rows, means = centred(columns, w)
    target, target_means = centred(problem.recordings.force[w.at][None], w)
    low, high = linear_bounds(problem)
    linear, at_bound = bounded_solution(rows @ rows.T, rows @ target[0], low, high)
    return target[0] - linear @ rows, linear, target_means[0] - linear @ means, at_bound


def linear_bounds(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return bounds of the linear coefficients."""
    free = problem.base.yield_order + problem.base.viscosity_order + 2
    bounds = [parameter.bounds(problem.scales) for _, parameter in problem.amplitudes]
    low = np.concatenate([np.full(free, -np.inf), [item[0] for item in bounds]])
    return low, np.concatenate([np.full(free, np.inf), [item[1] for item in bounds]])


def bounded_solution(
    gram: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Solve the normal equations within bounds: what leaves them is put on the bound and the rest solved again."""
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram / np.outer(scale, scale)
    scaled[np.diag_indices_from(scaled)] += 1e-10
    target = right / scale
    solution = np.zeros(len(right))
    fixed = np.zeros(len(right), dtype=np.bool_)
    for _ in range(len(right) + 1):
        free = ~fixed
        rest = target[free] - scaled[np.ix_(free, fixed)] @ solution[fixed]
        solution[free] = np.linalg.solve(scaled[np.ix_(free, free)], rest)
        outside = free & ((solution < low * scale - 1e-12) | (solution > high * scale + 1e-12))
        if not outside.any():
            break
        solution[outside] = np.clip(solution[outside], (low * scale)[outside], (high * scale)[outside])
        fixed |= outside
    return solution / scale, fixed


def fit(problem: Problem, start: FloatArray, *, iterations: int = 15, tolerance: float = 2e-4) -> Fit:
    """Fit from a start by Levenberg-Marquardt on the projected residual."""
    w = weighting(problem)
    low, high = problem.bounds()
    theta = np.clip(start, low, high)
    residual, linear, means, fixed = solve(problem, theta, w)
    cost = float(residual @ residual)
    damping, done, jacobian, age = 1e-3, 0, np.zeros((len(theta), len(residual))), OLDEST_JACOBIAN
    for done in range(1, iterations + 1):  # noqa: B007 - counted for the report
        if age >= OLDEST_JACOBIAN:
            jacobian, age = jacobian_of(problem, theta, residual, w, low, high), 0
        gram, gradient = jacobian @ jacobian.T, jacobian @ residual
        diagonal = np.maximum(np.diag(gram), 1e-12 * max(float(np.max(np.diag(gram))), 1e-300))
        before, improved = cost, False
        for _ in range(5 if age == 0 else 2):
            free = ~(((theta <= low) & (gradient > 0)) | ((theta >= high) & (gradient < 0)))
            step = np.zeros(len(theta))
            if free.any():
                matrix = gram[np.ix_(free, free)] + damping * np.diag(diagonal[free])
                step[free] = -np.linalg.lstsq(matrix, gradient[free], rcond=None)[0]
            trial = np.clip(theta + np.clip(step, -1.0, 1.0), low, high)
            found = solve(problem, trial, w)
            new = float(found[0] @ found[0])
            if new < cost:
                moved = trial - theta
                missed = found[0] - residual - moved @ jacobian
                # a run for every parameter is dear: between two Jacobians by differences Broyden's update will do
                jacobian += np.outer(moved / max(float(moved @ moved), 1e-300), missed)
                theta, cost, improved = trial, new, True
                residual, linear, means, fixed = found
                damping = max(damping * 0.2, 1e-9)
                break
            damping *= 8.0
        if improved and before - cost >= tolerance * before:
            age += 1
        elif age == 0:
            break
        else:
            age = OLDEST_JACOBIAN
    return _finish(problem, theta, w, (residual, linear, means, fixed), done)


def jacobian_of(
    problem: Problem, theta: FloatArray, residual: FloatArray, w: Weighting, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the derivative of the projected residual by the searched values, shape (p, m), by differences."""
    rows = np.empty((len(theta), len(residual)))
    for k in range(len(theta)):
        width = 1e-3 * max(1.0, 0.02 * (high[k] - low[k])) if problem.searched[k][1].logarithmic else 0.0
        if width == 0.0:
            width = max(2e-5, 2e-3 * abs(theta[k]))
        width = -width if theta[k] + width > high[k] else width
        moved = theta.copy()
        moved[k] += width
        rows[k] = (solve(problem, moved, w)[0] - residual) / width
    return rows


def _finish(
    problem: Problem,
    theta: FloatArray,
    w: Weighting,
    found: tuple[FloatArray, FloatArray, FloatArray, BoolArray],
    iterations: int,
) -> Fit:
    residual, linear, means, fixed = found
    low, high = problem.bounds()
    margin = 1e-3 * (high - low)
    names = [
        parameter.name
        for (index, parameter), t, a, b, m in zip(problem.searched, theta, low, high, margin, strict=True)
        if index >= 0 and (t <= a + m or t >= b - m) and parameter.upper / max(parameter.lower, 1e-12) > 1.01
    ]
    first = problem.base.yield_order + problem.base.viscosity_order + 2
    names += [p.name for (_, p), stuck in zip(problem.amplitudes, fixed[first:], strict=True) if stuck]
    full = np.zeros(len(problem.recordings.force))
    full[w.at] = residual
    offsets = np.zeros(problem.recordings.tests)
    if problem.offsets:
        offsets[np.unique(w.test)] = means
    else:
        offsets[:] = means[0]
    return Fit(problem, theta, linear, offsets, float(residual @ residual), full, tuple(names), iterations)


def predict(found: Fit, recordings: Recordings) -> FloatArray:
    """Return the force [N] of a fitted damper on other tests, free-run, without their offsets, shape (n,)."""
    problem = replace(found.problem, recordings=recordings, root_weight=np.zeros(len(recordings.force)))
    return np.asarray(found.linear @ regressors(problem, found.theta))


def start_of(problem: Problem, base: Mapping[str, float], terms: Sequence[Mapping[str, float]]) -> FloatArray:
    """Return a start: base values, and values of each term; those left out take their first start."""
    given = [base, *terms]
    values = []
    for index, parameter in problem.searched:
        default = parameter.start_values(problem.scales)[0]
        values.append(float(given[index + 1].get(parameter.name, default)))
    low, high = problem.bounds()
    return np.clip(problem.encode(values), low, high)
