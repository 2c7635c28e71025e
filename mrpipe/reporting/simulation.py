"""Figures of the closed loop (thesis chapter 5)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.style import COLOURS, MEASURED, MODEL, figure_with_axes, label

SHOWN_POINTS = 6000
"""Most points of a curve: enough for the eye, small in the report."""


def _thin(*curves: FloatArray) -> list[FloatArray]:
    step = max(1, len(curves[0]) // SHOWN_POINTS)
    return [curve[::step] for curve in curves]


def loops(displacement: FloatArray, velocity: FloatArray, force: FloatArray, desired: FloatArray, title: str) -> Figure:
    """Return force over displacement and over velocity, desired and actual (thesis Figures 4.6, 5.6).

    Parameters
    ----------
    displacement, velocity, force, desired
        Histories of the damper, shape (m,) each [m], [m/s], [N], [N].
    title
        Name of the law.
    """
    figure, axes = figure_with_axes(1, 2)
    x, v, f, d = _thin(displacement, velocity, force, desired)
    for axis, abscissa, name in ((axes[0, 0], 1e3 * x, "displacement [mm]"), (axes[0, 1], 1e3 * v, "velocity [mm/s]")):
        axis.plot(abscissa, f, color=MEASURED, linewidth=0.8, label="damper")
        axis.plot(abscissa, d, color=MODEL, linewidth=0.8, label="desired")
        label(axis, name, "force [N]", title)
    axes[0, 0].legend(fontsize=8)
    return figure


def histories(
    time_s: FloatArray,
    top: FloatArray,
    damper: FloatArray,
    force: FloatArray,
    desired: FloatArray,
    drive: FloatArray,
    drive_unit: str,
) -> Figure:
    """Return top and damper displacement, force and drive over time (thesis Figure 4.5); shapes (m,)."""
    figure, axes = figure_with_axes(4, 1, height=1.9)
    t, top, damper, force, desired, drive = _thin(time_s, top, damper, force, desired, drive)
    axes[0, 0].plot(t, 1e3 * top, color=COLOURS[0], linewidth=0.8)
    label(axes[0, 0], "", "top floor [mm]")
    axes[1, 0].plot(t, 1e3 * damper, color=COLOURS[0], linewidth=0.8)
    label(axes[1, 0], "", "damper [mm]")
    axes[2, 0].plot(t, force, color=MEASURED, linewidth=0.8, label="damper")
    axes[2, 0].plot(t, desired, color=MODEL, linewidth=0.8, label="desired")
    axes[2, 0].legend(fontsize=8)
    label(axes[2, 0], "", "force [N]")
    axes[3, 0].plot(t, drive, color=COLOURS[2], linewidth=0.8)
    label(axes[3, 0], "time [s]", f"drive [{drive_unit}]")
    return figure


def decay(
    time_s: FloatArray, top: FloatArray, peak_time_s: FloatArray, peaks: FloatArray, damping_ratio: FloatArray
) -> Figure:
    """Return the free decay with its extrema, and point-to-point damping over amplitude (thesis Figure 5.7).

    Parameters
    ----------
    time_s, top
        Shape (m,) [s], [m].
    peak_time_s, peaks
        Shape (p,) [s], [m].
    damping_ratio
        Shape (p - 1,).
    """
    figure, axes = figure_with_axes(1, 2)
    t, x = _thin(time_s, top)
    axes[0, 0].plot(t, 1e3 * x, color=COLOURS[0], linewidth=0.8)
    axes[0, 0].plot(peak_time_s, 1e3 * peaks, "o", color=COLOURS[1], markersize=4)
    label(axes[0, 0], "time [s]", "top floor [mm]")
    axes[0, 1].plot(1e3 * np.abs(peaks[:-1]), damping_ratio, "o-", color=COLOURS[0], markersize=4)
    label(axes[0, 1], "top amplitude [mm]", "damping ratio, point to point [1]")
    return figure


def energies(time_s: FloatArray, work_in: FloatArray, damper: FloatArray, frame: FloatArray) -> Figure:
    """Return work of the base and what damper and frame dissipated over time [J]; shapes (m,)."""
    figure, axes = figure_with_axes(height=2.6)
    t, work_in, damper, frame = _thin(time_s, work_in, damper, frame)
    for index, (name, values) in enumerate((("base", work_in), ("damper", damper), ("frame", frame))):
        axes[0, 0].plot(t, values, color=COLOURS[index], label=name)
    axes[0, 0].legend(fontsize=8)
    label(axes[0, 0], "time [s]", "energy [J]")
    return figure
