"""Largest error of a model that needs nothing more."""

from __future__ import annotations

import numpy as np

from mrpipe.fitting.engine import Fit
from mrpipe.tracing.rules import RaceRules


def nrmse_of_noise(found: Fit, noise: float) -> float:
    """Return the noise as a share of the RMS force.

    Parameters
    ----------
    found
        A fit, which gives weights and recordings.
    noise
        Mean squared weighted residual that noise leaves.
    """
    problem = found.problem
    used = problem.root_weight > 0.0
    deviation = np.sqrt(noise * np.mean(problem.root_weight[used] ** -2.0))
    return float(deviation / problem.recordings.force_rms)


def sufficient_chi_square(noise: float, noise_nrmse: float, rules: RaceRules) -> float:
    """Return the largest mean squared weighted residual of a model that needs nothing more.

    The noise is not known exactly, and a base form is never exact. The error may therefore exceed the noise by a share
    of it. If the noise is large, this share is as large as an effect, so that a share of the force limits the excess.

    Parameters
    ----------
    noise
        Mean squared weighted residual that noise leaves.
    noise_nrmse
        The noise as a share of the RMS force; 0 if it is not known, so that the force sets no limit.
    rules
        Decision thresholds.
    """
    excess = rules.sufficient**2 - 1.0
    if noise_nrmse > 0.0:
        excess = min(excess, (rules.sufficient_share / noise_nrmse) ** 2)
    return (1.0 + excess) * noise
