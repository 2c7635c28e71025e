"""Tables and figures of the frame's identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.modal.decays.decay import DecayResult
from mrpipe.modal.spectra import FrequencyResponses
from mrpipe.modal.verification import FrequencyVerification, TimeVerification
from mrpipe.reporting.places import ROTATION, by_direction, floor_names
from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, MEASURED, MODEL, figure_with_axes, label
from mrpipe.structures import Frame
from mrpipe.words import in_percent

_MOST_POINTS = 4000
_MOST_SHAPES = 12


def mode_rows(values: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row a mode from the stage's summary."""
    rows = []
    for index, frequency in enumerate(values["frequencies_hz"]):
        low, high = values["damping_ratio_intervals"][index]
        rows.append(
            {
                "mode": values["mode_numbers"][index],
                "frequency [Hz]": frequency,
                "± [Hz]": 0.5 * float(np.diff(values["frequency_intervals_hz"][index])[0]),
                "omega [rad/s]": 2.0 * np.pi * frequency,
                "damping ratio": values["damping_ratios"][index],
                "low": low,
                "high": high,
                "from": values["damping_source"][index],
                "by the sweep": values["second_method_damping_ratios"][index],
                "MAC": values["mac"][index],
                "coherence": values["coherence_at_peaks"][index],
            }
        )
    return rows


def frequency_responses(
    result: FrequencyVerification, averaged: FrequencyResponses, band_hz: tuple[float, float]
) -> Figure:
    """Draw magnitude of every floor, measured and of the model, and the coherence of averaged spectra."""
    floors = result.measured.shape[1]
    figure, axes = figure_with_axes(2, 1, height=3.2)
    step = max(1, result.frequency_hz.size // _MOST_POINTS)
    for floor in range(floors):
        colour = COLOURS[floor % len(COLOURS)]
        axes[0, 0].semilogy(
            result.frequency_hz[::step],
            np.abs(result.measured[::step, floor]),
            color=colour,
            linewidth=0.6,
            alpha=0.55,
            label=f"floor {result.floors[floor]}",
        )
        axes[0, 0].semilogy(
            result.frequency_hz[::step], np.abs(result.synthesised[::step, floor]), color=colour, linewidth=1.1
        )
        inside = (averaged.frequency_hz >= band_hz[0]) & (averaged.frequency_hz <= band_hz[1])
        axes[1, 0].plot(averaged.frequency_hz[inside], averaged.coherence[inside, floor], color=colour, linewidth=0.8)
    label(axes[0, 0], "frequency [Hz]", "response over excitation", "thin: measured, thick: M, C, K")
    label(axes[1, 0], "frequency [Hz]", "coherence", "averaged spectra (leakage lowers it at sharp peaks)")
    axes[1, 0].set_ylim(0.0, 1.02)
    axes[0, 0].legend(fontsize=7, frameon=False, ncols=min(floors, 5))
    return figure


def matrix_tables(sink: Sink, frame: Frame) -> None:
    """Write M, K and C with the names of their rows and columns."""
    names = list(frame.names)
    for name, text in (("mass", "M [kg]"), ("stiffness", "K [N/m]"), ("damping", "C [N s/m]")):
        table = pd.DataFrame(getattr(frame, name), columns=names)
        table.insert(0, "degree of freedom", names)
        rotations = any(item.endswith(ROTATION) for item in names)
        sink.table(name, table, f"{text}; rows of rotations in SI units of moments." if rotations else f"{text}.")


def shapes_caption(names: Sequence[str]) -> str:
    """Return the caption of :func:`mode_shapes`."""
    if any(name.endswith(ROTATION) for name in names):
        return "Mode shapes; dashed: rotation in rad where displacements are in m."
    return "Mode shapes." if by_direction(names) else "Mode shapes at the degrees of freedom."


def mode_shapes(
    shapes: FloatArray,
    frequencies_hz: Sequence[float],
    heights_m: Sequence[float] | None = None,
    names: Sequence[str] = (),
) -> Figure:
    """Draw the shapes (rows by modes); rows without a value are left out.

    Floors are drawn over their number or height, with a line for each direction. Degrees of freedom that are not called
    as floors are drawn as bars with their names.

    Parameters
    ----------
    shapes
        A row for each degree of freedom.
    frequencies_hz
        Frequencies of the modes.
    heights_m
        Height of each floor; None: unknown.
    names
        Names of the degrees of freedom; empty: floors in one direction.
    """
    rows, modes = shapes.shape
    names = list(names) or floor_names(rows)
    directions = by_direction(names)
    if directions is None and heights_m is not None:
        directions = {"": {row + 1: row for row in range(rows)}}
    shown = min(modes, _MOST_SHAPES)
    extra = 0.0 if directions is not None else 0.09 * max(map(len, names))
    figure, axes = figure_with_axes(1, shown, width=1.5 * shown + 0.8 + extra, height=max(3.6, 0.16 * rows))
    for mode in range(shown):
        axis = axes[0, mode]
        if directions is None:
            axis.barh(np.arange(rows), np.nan_to_num(shapes[:, mode]), color=COLOURS[0])
            axis.set_yticks(np.arange(rows), names if mode == 0 else [""] * rows, fontsize=7)
        else:
            _draw_floors(axis, shapes[:, mode], directions, heights_m)
        vertical = "" if directions is None else "floor" if heights_m is None else "height [m]"
        axis.axvline(0.0, color=MEASURED, linewidth=0.6)
        axis.set_xlim(-1.15, 1.15)
        label(axis, "", vertical if mode == 0 else "", f"{mode + 1}: {frequencies_hz[mode]:.3g} Hz")
    if directions is not None and len(directions) > 1:
        axes[0, 0].legend(fontsize=7, frameon=False)
    return figure


def _draw_floors(
    axis: Axes, shape: FloatArray, directions: Mapping[str, Mapping[int, int]], heights_m: Sequence[float] | None
) -> None:
    """Draw one mode over the floors, a line for each direction."""
    for colour, (direction, places) in zip(cycle(COLOURS), directions.items(), strict=False):
        floors = sorted(places)
        values = np.concatenate([[0.0], shape[[places[floor] for floor in floors]]])
        height = np.array([0.0, *(float(floor) if heights_m is None else heights_m[floor - 1] for floor in floors)])
        known = np.isfinite(values)
        style = "o--" if direction == ROTATION else "o-"
        axis.plot(values[known], height[known], style, color=colour, linewidth=1.4, markersize=4, label=direction)


def stabilisation(candidates: Sequence[Mapping[str, Any]], frequencies_hz: Sequence[float]) -> Figure:
    """Draw in how many model orders each pole appears, and the modes that were taken."""
    figure, axes = figure_with_axes(1, 1, height=2.4)
    axis = axes[0, 0]
    for frequency in frequencies_hz:
        axis.axvline(frequency, color=MODEL, linewidth=0.8)
    axis.plot(
        [item["frequency_hz"] for item in candidates],
        [item["model_orders"] for item in candidates],
        "o",
        color=COLOURS[0],
        markersize=4,
    )
    label(axis, "frequency [Hz]", "model orders", "poles that keep their place")
    return figure


def decays(results: Sequence[DecayResult]) -> Figure:
    """Draw the modal coordinate with its exponential fit, and damping from peak to peak over amplitude."""
    figure, axes = figure_with_axes(len(results), 2, height=2.1)
    for row, result in zip(axes, results, strict=True):
        step = max(1, result.time_s.size // _MOST_POINTS)
        row[0].plot(result.time_s[::step], result.coordinate[::step], color=MEASURED, linewidth=0.5)
        row[0].plot(result.peak_time_s, result.peak, ".", color=MODEL, markersize=3)
        label(row[0], "time [s]", "modal coordinate [m/s²]", f"mode {result.mode}, {result.test}")
        row[1].plot(result.peak[:-2], result.point_to_point_series, ".", color=COLOURS[0], markersize=3)
        row[1].axhline(result.exponential_fit.value, color=MODEL, linewidth=1.0)
        scale = max(result.exponential_fit.value, 1e-6)
        row[1].set_ylim(0.0, 2.5 * scale)
        label(row[1], "peak [m/s²]", "damping ratio", "peak to peak; line: exponential fit")
    return figure


def verification(result: TimeVerification) -> Figure:
    """Draw the top and the first floor of a forced test, measured and simulated, around the largest response."""
    figure, axes = figure_with_axes(2, 1, height=2.4)
    top = result.measured.shape[1] - 1
    rate = 1.0 / float(result.time_s[1] - result.time_s[0])
    half = int(4.0 * rate)
    for axis, floor in zip(axes[:, 0], (top, 0), strict=True):
        centre = int(np.argmax(np.abs(result.measured[:, floor])))
        part = slice(max(0, centre - half), centre + half)
        axis.plot(result.time_s[part], result.measured[part, floor], color=MEASURED, linewidth=0.9, label="measured")
        axis.plot(result.time_s[part], result.simulated[part, floor], color=MODEL, linewidth=0.9, label="simulated")
        label(
            axis,
            "time [s]",
            "response",
            f"floor {result.floors[floor]}: fit {in_percent(result.fit_percent[floor] / 100.0, 1)}",
        )
        axis.legend(fontsize=7, frameon=False)
    return figure
