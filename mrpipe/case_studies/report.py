"""Figures and tables of the benchmark structures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.style import COLOURS, MEASURED, figure_with_axes, label

Table = Mapping[str, Mapping[str, float]]
"""Law -> index -> value."""

_POINTS = 4000


def _thinned(count: int) -> slice:
    return slice(None, None, max(1, count // _POINTS))


def histories(
    time_s: FloatArray,
    curves: Mapping[str, FloatArray],
    reference: FloatArray,
    *,
    quantity: str,
    title: str = "",
    until_s: float | None = None,
    reference_name: str = "uncontrolled",
) -> Figure:
    """Return the history of one quantity under several laws, the uncontrolled one in grey.

    Parameters
    ----------
    time_s
        Shape (n,).
    curves
        Law -> shape (n,).
    reference
        Uncontrolled, shape (n,).
    quantity
        Label with unit.
    title
        Title of the figure.
    until_s
        Time shown; all if left out.
    reference_name
        Legend of the grey curve.
    """
    figure, axes = figure_with_axes(1, 1, width=9.0, height=3.2)
    axis = axes[0, 0]
    shown = _thinned(len(time_s))
    axis.plot(time_s[shown], reference[shown], color=MEASURED, linewidth=0.5, alpha=0.6, label=reference_name)
    for colour, (law, values) in zip(COLOURS, curves.items(), strict=False):
        axis.plot(time_s[shown], values[shown], color=colour, linewidth=0.8, label=law)
    if until_s is not None:
        axis.set_xlim(0.0, until_s)
    axis.legend(fontsize=7, ncols=4, loc="upper right")
    label(axis, "time [s]", quantity, title)
    return figure


def loops(
    strokes: Mapping[str, FloatArray], velocities: Mapping[str, FloatArray], forces: Mapping[str, FloatArray]
) -> Figure:
    """Return force against displacement and against velocity of the device under each law.

    Parameters
    ----------
    strokes, velocities, forces
        Law -> shape (n,); m, m/s, N.
    """
    figure, axes = figure_with_axes(2, max(len(forces), 1), width=2.6 * max(len(forces), 2), height=2.6)
    for column, law in enumerate(forces):
        shown = _thinned(len(forces[law]))
        for row, (values, unit, factor) in enumerate(
            ((strokes[law], "displacement [mm]", 1e3), (velocities[law], "velocity [m/s]", 1.0))
        ):
            axes[row, column].plot(values[shown] * factor, forces[law][shown] * 1e-3, color=COLOURS[0], linewidth=0.5)
            label(axes[row, column], unit, "force [kN]", law if row == 0 else "")
    return figure


def floor_profiles(
    floors: Sequence[int],
    displacement: Mapping[str, FloatArray],
    acceleration: Mapping[str, FloatArray],
) -> Figure:
    """Return peak displacement and acceleration of the floors, one line a law; `uncontrolled` in grey.

    Parameters
    ----------
    floors
        Floor numbers, shape (n,).
    displacement, acceleration
        Law -> peaks, shape (n,); m, m/s^2.
    """
    figure, axes = figure_with_axes(1, 2, width=8.0, height=3.6)
    for axis, peaks, name in (
        (axes[0, 0], displacement, "displacement [m]"),
        (axes[0, 1], acceleration, "acceleration [m/s²]"),
    ):
        for number, (law, values) in enumerate(peaks.items()):
            colour = MEASURED if law == "uncontrolled" else COLOURS[(number - 1) % 8]
            axis.plot(values, floors, color=colour, marker="o", markersize=2.5, linewidth=0.9, label=law)
        label(axis, f"peak {name}", "floor")
    axes[0, 0].legend(fontsize=7)
    return figure


def index_bars(indices: Table, thesis: Table) -> Figure:
    """Return the indices of each law as bars, the thesis' as marks.

    Parameters
    ----------
    indices, thesis
        Law -> index -> value; indices with units (powers) are left out.
    """
    laws = list(indices)
    names = [name for name in next(iter(indices.values())) if name.startswith("J")]
    shown = [*indices.values(), *(thesis[law] for law in laws if law in thesis)]
    names = [name for name in names if max(abs(values.get(name, 0.0)) for values in shown) < 10.0]
    figure, axes = figure_with_axes(1, 1, width=9.0, height=3.4)
    axis = axes[0, 0]
    width = 0.8 / max(len(laws), 1)
    places = np.arange(len(names))
    for number, law in enumerate(laws):
        at = places + (number - 0.5 * (len(laws) - 1)) * width
        axis.bar(at, [indices[law].get(name, np.nan) for name in names], width, color=COLOURS[number % 8], label=law)
        if law in thesis:
            marks = [thesis[law].get(name, np.nan) for name in names]
            axis.plot(at, marks, linestyle="none", marker="_", markersize=9, color="black")
    axis.axhline(1.0, color=MEASURED, linewidth=0.7)
    axis.set_xticks(places, names)
    axis.legend(fontsize=7, ncols=4)
    label(axis, "", "index [1]", "Indices; black marks: the thesis")
    return figure


def sensitivity(
    capacities: Sequence[float], indices: Mapping[str, Sequence[float]], *, unit: str, title: str
) -> Figure:
    """Return each index against the capacity of the dampers.

    Parameters
    ----------
    capacities
        Shape (n,), in `unit`.
    indices
        Index -> values, shape (n,).
    unit
        Unit of the capacity, for the label.
    title
        Title of the figure.
    """
    figure, axes = figure_with_axes(1, 1, width=7.0, height=3.4)
    axis = axes[0, 0]
    for number, (name, values) in enumerate(indices.items()):
        style = "-" if number < len(COLOURS) else "--"
        axis.semilogx(capacities, values, style, color=COLOURS[number % 8], marker="o", markersize=3, label=name)
    axis.set_xticks(list(capacities), [f"{value:g}" for value in capacities])
    axis.set_xticks([], minor=True)
    axis.legend(fontsize=7, ncols=3)
    label(axis, unit, "index [1]", title)
    return figure


def beside_thesis(indices: Table, thesis: Table, model: str) -> pd.DataFrame:
    """Return a table with a row an index and, for each law, our value and the printed one.

    Parameters
    ----------
    indices, thesis
        Law -> index -> value.
    model
        `published` or `surrogate`, shown in a separate column.
    """
    rows = []
    for name in next(iter(indices.values())):
        row: dict[str, object] = {"index": name, "model": model}
        for law, values in indices.items():
            row[law] = values.get(name, float("nan"))
            if law in thesis and name in thesis[law]:
                row[f"{law} (thesis)"] = thesis[law][name]
        rows.append(row)
    return pd.DataFrame(rows)
