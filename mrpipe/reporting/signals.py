"""Figures of campaigns and of prepared signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.reporting.style import COLOURS, MEASURED, MODEL, drawn_in, figure_with_axes, label

Curve = tuple[FloatArray, FloatArray]


def spectra_before_and_after(
    spectra: Mapping[str, tuple[Curve, Curve]], units: Mapping[str, str], cutoffs_hz: Mapping[str, float]
) -> Figure:
    """Draw the power spectra of each channel before and after filtering, with the cut-off.

    Parameters
    ----------
    spectra
        Channel -> ((frequencies [Hz], density) before, the same after).
    units
        Channel -> SI unit of the channel; motions are drawn in mm and mm/s.
    cutoffs_hz
        Channel -> cut-off, missing where the channel was not filtered.
    """
    figure, axes = figure_with_axes((len(spectra) + 1) // 2, 2, height=2.6)
    for axis, (name, (before, after)) in zip(axes.ravel(), spectra.items(), strict=False):
        unit, factor = drawn_in(units.get(name, ""))
        axis.loglog(before[0][1:], factor**2 * before[1][1:], color=MEASURED, linewidth=0.7, label="measured")
        axis.loglog(after[0][1:], factor**2 * after[1][1:], color=MODEL, linewidth=0.9, label="prepared")
        if name in cutoffs_hz:
            axis.axvline(cutoffs_hz[name], color=COLOURS[0], linewidth=0.8, linestyle="--", label="cut-off")
        top = factor**2 * float(np.max(before[1][1:])) if before[1].size > 1 else 1.0
        if top > 0.0:
            axis.set_ylim(top * 1e-14, top * 10.0)
        label(axis, "frequency [Hz]", f"density [({unit})²/Hz]", name)
        axis.legend(loc="lower left", fontsize=7, frameon=False)
    for axis in axes.ravel()[len(spectra) :]:
        axis.set_visible(False)
    return figure


def prepared_history(
    time_s: FloatArray,
    before: Mapping[str, FloatArray],
    after: Mapping[str, FloatArray],
    units: Mapping[str, str],
    cycles: IntArray,
) -> Figure:
    """Draw channels before and after preparation over a few cycles; the steady cycles are marked.

    Parameters
    ----------
    time_s
        Shape (n,).
    before, after
        Channel -> shape (n,); channels of `after` alone (velocity) are drawn without a measured curve.
    units
        Channel -> SI unit; motions are drawn in mm and mm/s.
    cycles
        Start indices of the steady cycles and the end of the last one; may be empty.
    """
    names = list(after)
    figure, axes = figure_with_axes(len(names), 1, height=1.5)
    begin, end = _window(cycles, time_s.size)
    for axis, name in zip(axes.ravel(), names, strict=True):
        unit, factor = drawn_in(units.get(name, ""))
        shown = time_s[begin:end]
        if name in before:
            axis.plot(shown, factor * before[name][begin:end], color=MEASURED, linewidth=0.6, label="measured")
        axis.plot(shown, factor * after[name][begin:end], color=MODEL, linewidth=0.9, label="prepared")
        for start in cycles:
            if begin <= start < end:
                axis.axvline(time_s[start], color=COLOURS[0], linewidth=0.5, linestyle=":")
        label(axis, "", f"{name} [{unit}]")
    axes.ravel()[-1].set_xlabel("time [s]", fontsize=8)
    axes.ravel()[0].legend(loc="upper right", fontsize=7, frameon=False, ncols=2)
    return figure


def _window(cycles: IntArray, samples: int) -> tuple[int, int]:
    """Return the range of three cycles, or a stretch in the middle of a random motion."""
    if cycles.size > 1:
        last = cycles[min(3, cycles.size - 1)]
        return int(cycles[0]), int(last) + 1
    middle, half = samples // 2, min(samples // 2, 1000)
    return middle - half, middle + half


def loops(tests: Sequence[tuple[str, FloatArray, FloatArray, FloatArray]]) -> Figure:
    """Draw force over displacement and over velocity of several tests.

    Parameters
    ----------
    tests
        (name, displacement [m], velocity [m/s], force [N]) of each.
    """
    figure, axes = figure_with_axes(1, 2, height=3.6)
    for index, (name, displacement, velocity, force) in enumerate(tests):
        colour = COLOURS[index % len(COLOURS)]
        axes[0, 0].plot(1e3 * displacement, force, color=colour, linewidth=0.7, label=name)
        axes[0, 1].plot(1e3 * velocity, force, color=colour, linewidth=0.7)
    label(axes[0, 0], "displacement [mm]", "force [N]")
    label(axes[0, 1], "velocity [mm/s]", "force [N]")
    # below the curves, because a loop leaves no corner free
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, fontsize=7, frameon=False)
    return figure


def campaign_overview(
    recordings: Sequence[tuple[str, FloatArray, Mapping[str, FloatArray]]], units: Mapping[str, str]
) -> Figure:
    """Draw the channels of several recordings, a row a recording and a column a channel.

    Parameters
    ----------
    recordings
        (name, time [s], channel -> samples) of each.
    units
        Channel -> SI unit; motions are drawn in mm and mm/s.
    """
    names = list(dict.fromkeys(name for _, _, channels in recordings for name in channels))
    figure, axes = figure_with_axes(len(recordings), len(names), width=3.2 * len(names), height=1.8)
    for row, (title, time, channels) in enumerate(recordings):
        for column, name in enumerate(names):
            axis = axes[row, column]
            if name not in channels:
                axis.set_visible(False)
                continue
            unit, factor = drawn_in(units.get(name, ""))
            axis.plot(time, factor * channels[name], color=MEASURED, linewidth=0.5)
            last = row == len(recordings) - 1
            name_shown = name.replace("_", " ")
            label(axis, "time [s]" if last else "", f"{name_shown} [{unit}]", title if column == 0 else "")
    return figure
