"""Poles fitted with residues of each test, where tests contradict shared residues.

Cross-talk, cables and mounts differ between tests. Residues that two tests are made to share then leave a part of every
strong mode in the residual. That part is not noise. It moves a hidden mode next to a strong one by more than the
intervals say. With residues of each test the contradiction disappears from the poles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.covariance import clustered_covariance
from mrpipe.modal.fit.multimode import collected, fitted_poles
from mrpipe.modal.fit.projected import ProjectedFit
from mrpipe.modal.fit.result import MultiModeFit

_PASSES = 2
_EVALUATIONS = 10
_SAME = 0.005
"""Relative change of a frequency up to which a fit has found the same mode again."""


def with_own_residues(fit: MultiModeFit) -> MultiModeFit:
    """Return the fit with poles that give each test separate residues, and the errors of all poles by clusters.

    Residues of each test are taken by the Bayesian information criterion. The shapes remain those that the tests share
    at these poles. Without several tests, or without evidence, the poles stay as they are.

    Parameters
    ----------
    fit
        A fit with shared residues.
    """
    modes = fit.angular_frequencies.size
    start = np.concatenate([np.log(fit.angular_frequencies), np.log(fit.damping_ratios)])
    shared, own = (ProjectedFit(fit.spectra, modes, separate) for separate in (False, True))
    for item in (shared, own):
        item.renew_weights(start)
        item.renew_weights(start)
    chosen, theta = shared, start
    if len(fit.spectra) > 1 and information(own, start) < information(shared, start):
        moved = fitted_poles(own, start, _PASSES, _EVALUATIONS)
        if np.abs(moved[:modes] - start[:modes]).max() <= _SAME:
            chosen, theta = own, moved
    covariance, freedom = clustered_covariance(chosen, theta)
    return replace(collected(shared, fit.spectra, theta), covariance=covariance, freedom=freedom)


def information(fit: ProjectedFit, theta: FloatArray) -> float:
    """Return the Bayesian information criterion of a fit with free noise of each sensor: smaller is better."""
    found = 0.0
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        rows = 2 * group.problem.total
        variance = np.mean(state.residual.reshape(rows, -1) ** 2, axis=0) * group.sigma**2
        # the weights scale the noise of each line
        found += rows * float(np.sum(np.log(np.maximum(variance, 1e-300))))
        found -= 4.0 * len(group.sensors) * float(np.sum(np.log(group.weight)))
        found += state.coefficients.size * float(np.log(rows))
    return found
