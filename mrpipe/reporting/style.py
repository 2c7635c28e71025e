"""The look that all figures share: one colour scheme that colour-blind readers can distinguish, and vector graphics.

The colours are those of Okabe and Ito, "Color Universal Design" (2008).
"""

from __future__ import annotations

import io
import re
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

MEASURED = "#333333"
"""Colour of what was measured."""
MODEL = "#d55e00"
"""Colour of a model, and of the model before an effect is added."""
AFTER = "#0072b2"
"""Colour of the model after the effects are added."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999")
"""Colours of several curves, in order."""

LAYOUT: Literal["constrained"] | None = "constrained"
"""How the axes of a figure are placed. `constrained` keeps texts apart, and takes half of the time of a figure."""

_SVG = {"svg.fonttype": "none", "svg.hashsalt": "mrpipe", "path.simplify_threshold": 0.5}


class ShownFigure(Figure):
    """A figure that a notebook draws also where pyplot was not imported."""

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=90)
        return image.getvalue()


def figure_with_axes(rows: int = 1, columns: int = 1, *, width: float = 9.0, height: float = 3.4) -> tuple[Figure, Any]:
    """Return a figure and an object array (rows, columns) of axes; `height` is that of one row, in inches."""
    figure = ShownFigure(figsize=(width, height * rows), layout=LAYOUT)
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


_DRAWN_IN = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3)}
"""SI unit -> unit of a damper's motion in figures, and its number in one SI unit."""


def drawn_in(unit: str) -> tuple[str, float]:
    """Return the unit in which figures show a channel of this SI unit, and the factor of its numbers."""
    return _DRAWN_IN.get(unit, (unit, 1.0))


MOST_POINTS = 20_000
"""Points of a figure up to which the best place of a legend is searched; the search is slow for more."""


def place_legends(figure: Figure) -> None:
    """Put the legends of figures with very many points into the upper right corner."""
    for axis in figure.axes:
        legend = axis.get_legend()
        points = sum(np.size(line.get_xdata(orig=False)) for line in axis.lines)
        if legend is not None and points > MOST_POINTS:
            legend.set_loc("upper right")


def as_svg(figure: Figure) -> str:
    """Return a figure as an SVG element without time stamp, so that the same figure is the same text.

    Texts stay texts (searchable, small). Coordinates are cut to a hundredth of a point: these are the numbers in the
    attributes of elements, because the content of an element is a text that a reader sees.
    """
    buffer = io.StringIO()
    place_legends(figure)
    with matplotlib.rc_context(_SVG):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\d+\.\d{2})\d+", r"\1", tag[0]), text)
    return re.sub(r"\n\s*", "\n", text)
