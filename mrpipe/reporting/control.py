"""Figures of the calibration: damping over the gains, as in the literature."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.style import COLOURS, figure_with_axes, label


def damping_over_gain(
    gain: FloatArray, exact: FloatArray, estimate: FloatArray, marks: Mapping[str, tuple[float, float]], axis_label: str
) -> Figure:
    """Return exact and estimated damping ratio over one gain.

    Parameters
    ----------
    gain, exact, estimate
        Shape (m,).
    marks
        Name -> (gain, damping ratio) of points to be marked.
    axis_label
        Label of the axis of the gain, with its unit.
    """
    figure, axes = figure_with_axes()
    axis = axes[0, 0]
    axis.plot(gain, exact, color=COLOURS[0], label="complex eigenvalue")
    axis.plot(gain, estimate, "--", color=COLOURS[1], label="closed form")
    for index, (name, (x, y)) in enumerate(marks.items()):
        axis.plot(x, y, "o", color=COLOURS[(index + 2) % len(COLOURS)], label=name)
    axis.set_ylim(bottom=0.0)
    axis.legend(fontsize=8)
    label(axis, axis_label, "damping ratio [1]")
    return figure


def damping_over_gains(
    c: FloatArray, k: FloatArray, damping_ratio: FloatArray, marks: Mapping[str, tuple[float, float]], limit_n_m: float
) -> Figure:
    """Return the map of exact damping over viscosity and stiffness.

    Parameters
    ----------
    c, k
        Shapes (m,), (l,) [N s/m], [N/m].
    damping_ratio
        Shape (l, m), NaN where the structure is statically unstable.
    marks
        Law -> (c, k).
    limit_n_m
        Static stiffness at the damper; below minus this the structure is statically unstable.
    """
    figure, axes = figure_with_axes(height=4.2)
    axis = axes[0, 0]
    filled = axis.contourf(c, k, np.ma.masked_invalid(damping_ratio), levels=np.linspace(0.0, 1.0, 21), cmap="viridis")
    figure.colorbar(filled, ax=axis, label="damping ratio [1]")
    axis.axhline(-limit_n_m, color=COLOURS[1], linestyle="--", label="static limit")
    for index, (name, (x, y)) in enumerate(marks.items()):
        axis.plot(x, y, "o", markeredgecolor="white", color=COLOURS[(index + 1) % len(COLOURS)], label=name)
    axis.legend(fontsize=8)
    label(axis, "c [N s/m]", "k [N/m]", "unclipped f = c v + k x")
    return figure


def law_loops(loops: Mapping[str, tuple[FloatArray, FloatArray]]) -> Figure:
    """Return desired force over displacement of each law in harmonic motion (thesis Figure 5.5).

    Parameters
    ----------
    loops
        Law -> (displacement [m], force [N]), each of shape (m,).
    """
    figure, axes = figure_with_axes(1, max(len(loops), 1), height=2.8)
    for axis, (law, (x, force)) in zip(axes[0], loops.items(), strict=False):
        axis.plot(1e3 * x, force, color=COLOURS[0])
        label(axis, "displacement [mm]", "force [N]", law)
    return figure
