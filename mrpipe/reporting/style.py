"""The look that all figures share."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

MEASURED = "#444444"
"""Colour of what was measured."""
MODEL = "#c1432e"
"""Colour of what the model says."""
COLOURS = ("#1f5a99", "#c1432e", "#3f8f4f", "#8a5aa8", "#c98a1b", "#4f9da6", "#7a4b2a", "#9a9a9a")
"""Colours of several curves, in order; told apart by people who do not see red and green."""


def figure_with_axes(rows: int = 1, columns: int = 1, *, width: float = 9.0, height: float = 3.4) -> tuple[Figure, Any]:
    """Return a figure and an object array (rows, columns) of axes; `height` is that of one row, in inches."""
    figure = Figure(figsize=(width, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.ravel():
        polish(axis)
    return figure, axes


def polish(axis: Axes) -> None:
    """Give one axis the common look."""
    axis.grid(True, color="#e5e5e5", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.tick_params(labelsize=8)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)


def label(axis: Axes, x: str, y: str, title: str = "") -> None:
    """Set the labels (with units) and the title of one axis."""
    axis.set_xlabel(x, fontsize=8)
    axis.set_ylabel(y, fontsize=8)
    if title:
        axis.set_title(title, fontsize=9)
