"""Fast screening: share of the residual that each effect could explain to first order, beyond a refit of the model."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.fitting.engine import Fit, linear_derivatives, searched_derivatives
from mrpipe.fitting.problem import Problem, Term
from mrpipe.fitting.solution import bounded_solution, regressors
from mrpipe.fitting.weighting import Weighting, centred, weighting


@dataclass(frozen=True)
class Screened:
    """One form of an effect at one point of its grid of starts.

    Attributes
    ----------
    term
        The effect in the form that was tried.
    gain
        Share of the sum of squares of the residual that the form explains to first order.
    values
        Start values for a joint fit.
    """

    term: Term
    gain: float
    values: dict[str, float]


@dataclass(frozen=True)
class Tangent:
    """Tangent space of the present model: changes of the force that a refit can produce.

    Attributes
    ----------
    fit
        The present model.
    basis
        Orthonormal basis of its weighted tangent, shape (t, m).
    weighting
        The m samples that are compared.
    residual
        Weighted residual without its part in the tangent space, shape (m,).
    force
        Force of the present model at all samples, without offsets, shape (n,) [N].
    """

    fit: Fit
    basis: FloatArray
    weighting: Weighting
    residual: FloatArray
    force: FloatArray


def tangent_of(found: Fit) -> Tangent:
    """Return the tangent space of a fit at its optimum."""
    problem = found.problem
    w = weighting(problem)
    residual = found.residual[w.at]
    columns = regressors(problem, found.theta)
    rows = np.concatenate([linear_derivatives(found, columns), searched_derivatives(found)])
    norms = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[norms[:, 0] > 0] / norms[norms[:, 0] > 0]
    values, vectors = np.linalg.eigh(rows @ rows.T)
    keep = values > 1e-9 * values[-1]
    basis = (vectors[:, keep] / np.sqrt(values[keep])).T @ rows
    return Tangent(found, basis, w, residual - basis.T @ (basis @ residual), found.linear @ columns)


def grid(term: Term, problem: Problem) -> Iterable[dict[str, float]]:
    """Yield start values of a form: every combination of the starts of its shapes, with small strengths."""
    names = [item.name for item in term.form.searched]
    choices = [
        item.start_values(problem.scales)[: 1 if item.role == "strength" else None] for item in term.form.searched
    ]
    for combination in itertools.product(*choices):
        yield dict(zip(names, combination, strict=True))


def sensitivity(term: Term, values: dict[str, float], tangent: Tangent) -> Screened:
    """Return the gain of a form, to first order, at one point of its grid.

    Parameters
    ----------
    term
        The effect in the form that is tried.
    values
        Parameter -> value at this point of the grid.
    tangent
        Tangent space of the present model. Only the part of the force of the form outside of this space counts,
        because a refit of the model produces the rest.
    """
    found, w = tangent.fit, tangent.weighting
    problem = replace(found.problem, terms=(*found.problem.terms, term))
    scales = problem.scales
    extended = np.concatenate([found.theta, _encode(term, values, problem)])
    columns = regressors(problem, extended)
    before = len(found.linear)
    count = len(term.form.amplitudes)
    level = False
    low = np.array([item.bounds(scales)[0] for item in term.form.amplitudes])
    high = np.array([item.bounds(scales)[1] for item in term.form.amplitudes])
    if count:
        rows = columns[len(columns) - count :]
        if any(item.role == "strength" for item in term.form.searched):
            low, high = np.zeros(count), np.full(count, np.inf)
    else:
        strengths = [item for item in term.form.searched if item.role in ("strength", "level")]
        level = strengths[0].role == "level"
        start = 1.0 if level else values[strengths[0].name]
        rows = ((found.linear @ columns[:before]) - tangent.force)[None] / start
        low, high = (np.array([item]) for item in ((0.0, 3.0) if level else strengths[0].bounds(scales)))
    rows, means = centred(rows, w)
    if not np.all(np.isfinite(means)):
        return Screened(term, 0.0, values)
    rows = rows - (rows @ tangent.basis.T) @ tangent.basis
    gram, right = rows @ rows.T, rows @ tangent.residual
    if not np.all(np.diag(gram) > 0.0):
        return Screened(term, 0.0, values)
    solution, _ = bounded_solution(gram, right, low, high)
    total = float(found.residual @ found.residual)
    gain = float(2.0 * solution @ right - solution @ gram @ solution) / max(total, 1e-300)
    started = dict(values)
    if not count and not level:
        limit = high[0]
        started[strengths[0].name] = float(np.clip(solution[0], 0.2 * start if low[0] >= 0 else low[0], 0.7 * limit))
    return Screened(term, gain, started)


def _encode(term: Term, values: dict[str, float], problem: Problem) -> FloatArray:
    return np.array(
        [
            np.log(values[p.name]) if p.logarithmic else values[p.name] / problem.scales.of(p.scale)
            for p in term.form.searched
        ]
    )


def screen(found: Fit, terms: Sequence[Term], *, jobs: int = 1) -> list[Screened]:
    """Return the best grid point of every form, best first."""
    tangent = tangent_of(found)
    points = [(term, values) for term in terms for values in grid(term, found.problem)]
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        results = list(pool.map(lambda item: sensitivity(item[0], item[1], tangent), points))
    best: dict[str, Screened] = {}
    for item in results:
        if item.term.key not in best or item.gain > best[item.term.key].gain:
            best[item.term.key] = item
    return sorted(best.values(), key=lambda item: -item.gain)
