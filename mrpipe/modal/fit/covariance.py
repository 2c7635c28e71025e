"""Covariance of fitted poles."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.projected import ProjectedFit


def pole_covariance(fit: ProjectedFit, theta: FloatArray) -> FloatArray:
    """Return the covariance of theta with noise of the excitation, which reaches all outputs through H.

    A lightly damped peak has too few lines to estimate their scatter. The larger one of this scatter and the variance
    predicted from the noise of the whole band is taken.
    """
    jacobian, residual = fit.jacobian(theta), fit.residual(theta)
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    parameters = theta.size
    predicted, observed = np.zeros_like(inverse), np.zeros_like(inverse)
    start = 0
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        total, outputs = group.problem.total, len(group.sensors)
        part = slice(start, start + state.residual.size)
        start = part.stop
        own = jacobian[part].reshape(2, total, outputs, parameters)
        error = residual[part].reshape(2, total, outputs)
        scores = np.einsum("clop,clo->lp", own, error)
        observed += scores.T @ scores
        line = group.weight**2
        predicted += np.einsum("clop,cloq,l->pq", own, own, line, optimize=True)
        response = fit.steady(group, state) / np.sqrt(fit.input_power(group))[:, None]
        common = (group.weight * group.input_noise)[:, None] * response / group.sigma
        carried = np.einsum("lop,lo->lp", own[0] - 1j * own[1], common)
        predicted += 0.5 * (carried.real.T @ carried.real + carried.imag.T @ carried.imag)
    both = np.stack([inverse @ predicted @ inverse, inverse @ observed @ inverse])
    spread = np.sqrt(np.max(np.diagonal(both, axis1=1, axis2=2), axis=0))
    own_spread = np.sqrt(np.diag(both[0]))
    return np.asarray(both[0] * np.outer(spread / own_spread, spread / own_spread))


def clustered_covariance(fit: ProjectedFit, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of theta with errors of a sensor that are the same at all lines of a peak in one test.

    Errors of the clock of a sensor, or cross-talk, are the same from line to line, and the scatter of single lines does
    not show them. Each sensor in each test is therefore one cluster of the robust covariance (Liang and Zeger 1986).
    The larger variance of this and of :func:`pole_covariance` counts.

    Returns
    -------
    Covariance, shape (2r, 2r), and the degrees of freedom of each standard error, shape (2r,): number of clusters minus
    one if the clusters determine the error (Cameron and Miller 2015), else infinite.
    """
    covariance = pole_covariance(fit, theta)
    freedom = np.full(theta.size, np.inf)
    jacobian, residual = fit.jacobian(theta), fit.residual(theta)
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    scores, start = [], 0
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        part = slice(start, start + state.residual.size)
        start = part.stop
        rows, outputs = group.problem.rows, len(group.sensors)
        # real parts of the lines of all tests of the group, then their imaginary parts
        shape = (2, group.problem.total, outputs)
        products = jacobian[part].reshape(*shape, -1) * residual[part].reshape(*shape, 1)
        edges = np.concatenate([[0], np.cumsum(rows)[:-1]])
        by_test = np.add.reduceat(products.sum(axis=0), edges, axis=0)
        scores.append(by_test.reshape(len(rows) * outputs, -1))
    spread = np.vstack(scores) @ inverse
    clusters = spread.shape[0]
    if clusters < 2:
        return covariance, freedom
    variance = np.sum(spread**2, axis=0) * clusters / (clusters - 1)
    ratio = np.sqrt(np.maximum(variance / np.diag(covariance), 1.0))
    freedom[ratio > 1.0] = clusters - 1.0
    return np.asarray(covariance * np.outer(ratio, ratio)), freedom
