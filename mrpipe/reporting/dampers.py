"""Figures of parametric dampers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.style import COLOURS, MEASURED, MODEL, figure_with_axes, label


class DrawnLoop(Protocol):
    """One test: displacement [m], velocity [m/s], measured and modelled force [N], shape (n,)."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def displacement(self) -> FloatArray: ...  # noqa: D102
    @property
    def velocity(self) -> FloatArray: ...  # noqa: D102
    @property
    def measured(self) -> FloatArray: ...  # noqa: D102
    @property
    def modelled(self) -> FloatArray: ...  # noqa: D102


def damper_loops(loops: Sequence[DrawnLoop]) -> Figure:
    """Draw force over displacement (above) and over velocity (below), measured and modelled, a column a test."""
    columns = max(len(loops), 1)
    figure, axes = figure_with_axes(2, columns, width=max(3.0 * columns, 5.0), height=2.8)
    for column, loop in enumerate(loops):
        for axis, x, name in (
            (axes[0, column], 1e3 * loop.displacement, "displacement [mm]"),
            (axes[1, column], 1e3 * loop.velocity, "velocity [mm/s]"),
        ):
            axis.plot(x, loop.measured, color=MEASURED, linewidth=0.8, label="measured")
            axis.plot(x, loop.modelled, color=MODEL, linewidth=0.8, label="model")
            label(axis, name, "force [N]" if column == 0 else "", loop.name if axis is axes[0, column] else "")
    if loops:
        axes[0, 0].legend(fontsize=7, frameon=False)
    return figure


def comparison_bars(rows: Sequence[tuple[str, float, float]]) -> Figure:
    """Draw (form, training NRMSE, validation NRMSE) as bars, in the order given from above."""
    figure, axes = figure_with_axes(1, 1, width=7.0, height=0.8 + 0.42 * max(len(rows), 1))
    axis = axes[0, 0]
    place = np.arange(len(rows))
    axis.barh(place - 0.2, [row[1] for row in rows], height=0.36, color=COLOURS[7], label="training")
    axis.barh(place + 0.2, [row[2] for row in rows], height=0.36, color=COLOURS[0], label="validation")
    axis.set_yticks(place, [row[0] for row in rows])
    axis.invert_yaxis()
    figure.legend(loc="outside upper center", ncols=2, fontsize=8, frameon=False)
    label(axis, "NRMSE [1]", "")
    return figure


def yield_force_curves(drive: FloatArray, curves: Sequence[tuple[str, FloatArray]], drive_unit: str) -> Figure:
    """Draw the post-yield force [N] of each model over the drive (both of shape (n,))."""
    figure, axes = figure_with_axes(1, 1, width=6.0)
    axis = axes[0, 0]
    for place, (name, force) in enumerate(curves):
        axis.plot(drive, force, color=COLOURS[place % len(COLOURS)], label=name)
    axis.legend(fontsize=7, frameon=False)
    label(axis, f"drive [{drive_unit}]", "post-yield force [N]")
    return figure
