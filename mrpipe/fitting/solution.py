"""The force of a damper model on the tests, and the solution for its linear coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
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
from mrpipe.fitting.weighting import Weighting, centred


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
    return solve_rows(problem, *centred(regressors(problem, theta), w), w)


def solve_rows(problem: Problem, rows: FloatArray, means: FloatArray, w: Weighting) -> Solved:
    """Return the solution for the linear coefficients.

    Parameters
    ----------
    problem
        Problem, which gives the bounds of the coefficients.
    rows, means
        Weighted regressors without their means in each test, and these means, as :func:`centred` returns them.
    w
        Samples and weights.
    """
    # one value that is not finite would make the mean of its test not finite
    if not np.all(np.isfinite(means)):
        return unstable(len(rows), w)
    low, high = problem.linear_bounds
    linear, at_bound = bounded_solution(rows @ rows.T, rows @ w.target, low, high)
    return Solved(w.target - linear @ rows, linear, w.target_means - linear @ means, at_bound)


def unstable(count: int, w: Weighting) -> Solved:
    """Return a solution whose error is larger than that of any stable model; `count` is its number of coefficients."""
    return Solved(np.full(len(w.at), 1e6), np.zeros(count), np.zeros(len(w.sums)), np.ones(count, bool))


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
