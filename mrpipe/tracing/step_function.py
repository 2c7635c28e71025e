"""The share of a residual that a step function of one state explains, on the bench and in a structure."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray

BINS = 16
"""Numerical technique: number of steps of the step function of a state."""


def explained_share(residual: FloatArray, state: FloatArray, positive: BoolArray, half: BoolArray) -> float:
    """Return the share of the squared residual that a step function of a state explains, at least 0.

    The function has separate steps for both directions of motion. It is fitted to one half of the samples and judged on
    the other half, and then the halves are exchanged.

    Parameters
    ----------
    residual
        Shape (n,).
    state
        Value of the state at each sample, shape (n,).
    positive
        Whether the motion is in the positive direction, shape (n,).
    half
        Whether a sample belongs to the first half, shape (n,). Neighbouring samples depend on each other, so that the
        halves consist of blocks.
    """
    edges = np.unique(np.quantile(state, np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
    step = np.searchsorted(edges, state) * 2 + positive
    size = int(step.max()) + 1
    explained = 0.0
    for fitted, judged in ((half, ~half), (~half, half)):
        counts = np.bincount(step[fitted], minlength=size)
        mean = np.bincount(step[fitted], weights=residual[fitted], minlength=size) / np.maximum(counts, 1)
        left = residual[judged] - mean[step[judged]]
        explained += float(np.sum(residual[judged] ** 2) - np.sum(left**2))
    return max(0.0, explained / max(float(residual @ residual), 1e-300))
