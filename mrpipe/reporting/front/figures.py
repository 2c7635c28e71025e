"""Figures of the part before the appendix; small enough to be read on a phone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.front.laws import UNCONTROLLED, History, LawRun
from mrpipe.reporting.style import AFTER, COLOURS, MEASURED, MODEL, figure_with_axes, label
from mrpipe.reporting.words import percent
from mrpipe.words import in_percent, number

KIND_COLOURS = {"noise": "#999999", "after": AFTER, "before": MODEL, "network": COLOURS[2], "linear": COLOURS[7]}
"""Colour of each kind of model in the comparison of errors."""

_BINS = 24
_FEW = 30


@dataclass(frozen=True)
class TestRun:
    """A validation test with the models' forces; SI, each of shape (n,).

    Attributes
    ----------
    name
        Name of the test.
    displacement, velocity, drive, time
        Channels.
    measured, before, after
        Force measured, of the model, and of the model with the effects [N].
    """

    name: str
    displacement: FloatArray
    velocity: FloatArray
    drive: FloatArray
    time: FloatArray
    measured: FloatArray
    before: FloatArray
    after: FloatArray


def model_errors(rows: Sequence[tuple[str, float, str]]) -> Figure:
    """Draw the error of each model on unseen tests as points on a logarithmic axis, best at the top.

    Bars would mislead, because a logarithmic axis has no zero from which their length could begin.
    """
    figure, axes = figure_with_axes(1, 1, width=5.6, height=0.42 * len(rows) + 0.75)
    axis = axes[0, 0]
    place = np.arange(len(rows))[::-1]
    values = [100.0 * value for _, value, _ in rows]
    left = 0.5 * min(values)
    axis.hlines(place, left, 2.2 * max(values), color="#dddddd", lw=0.8, zorder=1)
    axis.scatter(values, place, s=60, color=[KIND_COLOURS[row[2]] for row in rows], zorder=2)
    for y, value in zip(place, values, strict=True):
        ground = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
        axis.annotate(in_percent(value / 100.0, digits=2), (value, y), (8, 0), textcoords="offset points",
                      va="center", fontsize=9, bbox=ground)  # fmt: skip
    axis.set_yticks(place, [name for name, _, _ in rows], fontsize=9)
    axis.set_xscale("log")
    axis.set_xlim(left, 2.2 * max(values))
    axis.set_ylim(-0.6, len(rows) - 0.4)
    _plain_log(axis, [left, 2.2 * max(values)])
    axis.grid(axis="y", visible=False)
    label(axis, "RMS error on unseen tests / RMS force [%]", "")
    return figure


def _plain_log(axis: Axes, limits: Sequence[float]) -> None:
    """Write the ticks of a logarithmic axis as plain numbers: 0.1, 1, 10."""
    ticks = [
        factor * 10.0**power
        for power in range(-6, 7)
        for factor in (1.0, 2.0, 5.0)
        if limits[0] <= factor * 10.0**power <= limits[1]
    ]
    if len(ticks) > 6:
        ticks = [tick for tick in ticks if np.isclose(np.log10(tick) % 1.0, 0.0)] or ticks
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_xticks([], minor=True)


def loop(test: TestRun, *, width: float = 5.6) -> Figure:
    """Draw force over displacement and over velocity of one test: measured, before and after in one plot."""
    figure, axes = figure_with_axes(1, 2, width=width, height=2.7)
    for axis, values, name in (
        (axes[0, 0], 1e3 * test.displacement, "displacement [mm]"),
        (axes[0, 1], 1e3 * test.velocity, "velocity [mm/s]"),
    ):
        _three(axis, values, test)
        label(axis, name, "force [N]" if axis is axes[0, 0] else "")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    return figure


def _three(axis: Axes, x: FloatArray, test: TestRun) -> None:
    axis.plot(x, test.measured, color=MEASURED, lw=2.2, alpha=0.55, label="measured")
    axis.plot(x, test.before, color=MODEL, lw=1.0, ls="--", label="before")
    axis.plot(x, test.after, color=AFTER, lw=1.0, label="after")


def loops(tests: Sequence[TestRun]) -> Figure:
    """Draw several tests, a row each: force over displacement and over velocity."""
    figure, axes = figure_with_axes(len(tests), 2, width=7.2, height=2.5)
    for row, test in enumerate(tests):
        _three(axes[row, 0], 1e3 * test.displacement, test)
        _three(axes[row, 1], 1e3 * test.velocity, test)
        label(axes[row, 0], "displacement [mm]", "force [N]", test.name)
        label(axes[row, 1], "velocity [mm/s]", "")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    return figure


def residual_over(
    variables: Sequence[tuple[str, FloatArray]], before: FloatArray, after: FloatArray, unit: str = "N"
) -> Figure:
    """Draw mean and middle 80 % of the residual over each variable, before and after.

    Parameters
    ----------
    variables
        (label with unit, values of shape (n,)).
    before, after
        Measured minus modelled, shape (n,).
    unit
        Unit of the residual.
    """
    columns = min(2, max(len(variables), 1))
    rows = -(-len(variables) // columns)
    figure, axes = figure_with_axes(rows, columns, width=7.2, height=2.4)
    for axis, (name, values) in zip(axes.ravel(), variables, strict=False):
        low, high = np.quantile(values, [0.002, 0.998])
        edges = np.linspace(low, high, _BINS + 1)
        bins = np.clip(np.digitize(values, edges) - 1, 0, _BINS - 1)
        for residual, colour, text in ((before, MODEL, "before"), (after, AFTER, "after")):
            spread = np.array(
                [
                    [np.mean(chosen), *np.quantile(chosen, [0.1, 0.9])] if chosen.size >= _FEW else [np.nan] * 3
                    for chosen in (residual[bins == index] for index in range(_BINS))
                ]
            )
            middle = 0.5 * (edges[:-1] + edges[1:])
            axis.fill_between(middle, spread[:, 1], spread[:, 2], color=colour, alpha=0.18, lw=0)
            axis.plot(middle, spread[:, 0], color=colour, lw=1.4, label=text)
        axis.axhline(0.0, color="k", lw=0.6)
        label(axis, name, f"measured - model [{unit}]")
    for axis in axes.ravel()[len(variables) :]:
        axis.set_visible(False)
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=2, fontsize=9, frameon=False)
    return figure


def candidate_shares(candidates: Sequence[Mapping[str, Any]], named: Sequence[str], of_what: str) -> Figure:
    """Draw which share (`of_what` in words) each family of effects recovers alone; named ones are blue."""
    shown = candidates[:10]
    figure, axes = figure_with_axes(1, 1, width=5.6, height=0.3 * max(len(shown), 2) + 0.75)
    axis = axes[0, 0]
    place = np.arange(len(shown))[::-1]
    shares = [100.0 * max(float(item.get("share") or 0.0), 0.0) for item in shown]
    axis.barh(place, shares, 0.66, color=[AFTER if item["name"] in named else COLOURS[7] for item in shown])
    for y, share in zip(place, shares, strict=True):
        axis.text(share + 1.0, y, in_percent(share / 100.0), va="center", fontsize=9)
    axis.set_yticks(place, [item["name"] for item in shown], fontsize=9)
    axis.set_xlim(0.0, 112.0)
    axis.grid(axis="y", visible=False)
    label(axis, f"share {of_what} [%]", "")
    return figure


def law_bars(runs: Sequence[LawRun]) -> Figure:
    """Draw RMS top displacement and acceleration by law, each as a share of the structure without a damper."""
    bare = next((run for run in runs if run.law == UNCONTROLLED), None)
    shown = [run for run in runs if run.law != UNCONTROLLED]
    figure, axes = figure_with_axes(1, 2, width=7.2, height=0.32 * len(shown) + 1.1)
    place = np.arange(len(shown))[::-1]
    for axis, values, reference, unit, title in (
        (axes[0, 0], [1e3 * r.rms_top_m for r in shown], bare and 1e3 * bare.rms_top_m, "mm", "top displacement"),
        (axes[0, 1], [r.rms_a_top_m_s2 for r in shown], bare and bare.rms_a_top_m_s2, "m/s²", "top acceleration"),
    ):
        colours = [COLOURS[7] if run.law.startswith("passive") else AFTER for run in shown]
        axis.barh(place, values, 0.66, color=colours)
        for y, value in zip(place, values, strict=True):
            axis.text(value + 0.015 * max(values), y, number(value), va="center", fontsize=9)
        axis.set_yticks(place, [run.law for run in shown] if axis is axes[0, 0] else [""] * len(shown), fontsize=9)
        axis.set_xlim(0.0, 1.2 * max(values))
        axis.grid(axis="y", visible=False)
        note = f"\n(without a damper {reference:.3g} {unit})" if reference else ""
        label(axis, f"RMS {title} [{unit}]{note}", "")
    return figure


def last_cycles(histories: Mapping[str, History]) -> Figure:
    """Draw the last three cycles of each law: top displacement, and damper force (desired and obtained)."""
    figure, axes = figure_with_axes(len(histories), 3, width=7.6, height=1.5)
    for row, (law, history) in enumerate(histories.items()):
        axes[row, 0].plot(history.time_s, 1e3 * history.top_m, color=AFTER, lw=1.0)
        # a constant drive follows no desired force
        desired = np.full_like(history.desired_n, np.nan) if law.startswith("passive") else history.desired_n
        axes[row, 1].plot(history.time_s, desired, color=MODEL, lw=1.0, ls="--", label="desired")
        axes[row, 1].plot(history.time_s, history.force_n, color=AFTER, lw=1.0, label="obtained")
        axes[row, 2].plot(1e3 * history.stroke_m, desired, color=MODEL, lw=1.0, ls="--")
        axes[row, 2].plot(1e3 * history.stroke_m, history.force_n, color=AFTER, lw=1.0)
        last = row == len(histories) - 1
        label(axes[row, 0], "time [s]" if last else "", "top [mm]", law)
        label(axes[row, 1], "time [s]" if last else "", "force [N]")
        label(axes[row, 2], "damper stroke [mm]" if last else "", "")
    handles, names = axes[0, 1].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=2, fontsize=9, frameon=False)
    return figure


def measured_and_predicted(found: Mapping[str, Any]) -> Figure:
    """Draw the RMS top displacement of each recorded law: measured, predicted before and after."""
    rows = [item for item in found["laws"] if item.get("measured")]
    figure, axes = figure_with_axes(1, 1, width=5.6, height=2.4)
    axis = axes[0, 0]
    at = np.arange(len(rows))
    for shift, when, colour in ((-0.27, "measured", MEASURED), (0.0, "before", MODEL), (0.27, "after", AFTER)):
        heights = [1e3 * (item.get(when) or {}).get("rms_x_top_m", np.nan) for item in rows]
        axis.bar(at + shift, heights, 0.25, color=colour, label=when)
    axis.set_xticks(at, [item["law"] for item in rows], fontsize=9)
    axis.grid(axis="x", visible=False)
    axis.legend(fontsize=9, frameon=False)
    label(axis, "", "RMS top displacement [mm]")
    return figure


def shapes_on_frame(shapes: FloatArray, frequencies_hz: Sequence[float], damping_ratios: Sequence[float]) -> Figure:
    """Draw each mode shape as the deflected frame: columns, floors and the undeflected position.

    Parameters
    ----------
    shapes
        A row for each floor, a column for each mode; any scale.
    frequencies_hz, damping_ratios
        Frequency and damping ratio of each mode.
    """
    floors, modes = shapes.shape
    shown = min(modes, 6)
    figure, axes = figure_with_axes(1, shown, width=max(1.25 * shown, 3.0), height=0.42 * floors + 1.1)
    heights = np.arange(floors + 1, dtype=np.float64)
    for mode, axis in enumerate(axes[0]):
        largest = np.nanmax(np.abs(shapes[:, mode]), initial=0.0)
        shift = 0.55 * np.concatenate([[0.0], shapes[:, mode] / (largest or 1.0)])
        fine = np.linspace(0.0, 1.0, 12)
        ease = 3.0 * fine**2 - 2.0 * fine**3
        for side in (-0.4, 0.4):
            axis.plot([side, side], [0.0, floors], color="#cccccc", lw=0.8)
            for storey in range(floors):
                x = shift[storey] + (shift[storey + 1] - shift[storey]) * ease
                axis.plot(side + x, storey + fine, color=AFTER, lw=1.3)
        for floor in range(1, floors + 1):
            axis.plot([-0.4 + shift[floor], 0.4 + shift[floor]], [heights[floor]] * 2, color=AFTER, lw=2.6)
        axis.plot([-0.8, 0.8], [0.0, 0.0], color="k", lw=1.2)
        axis.set_xlim(-1.05, 1.05)
        axis.set_axis_off()
        frequency, damping = number(frequencies_hz[mode]), percent(damping_ratios[mode])
        axis.set_title(f"mode {mode + 1}\n{frequency} Hz\n{damping}", fontsize=9)
    return figure


def frequency_response(frequency_hz: FloatArray, measured: FloatArray, model: FloatArray, floor: int) -> Figure:
    """Draw the magnitude of one floor's response over frequency: measured and of the identified matrices."""
    figure, axes = figure_with_axes(1, 1, width=7.2, height=2.5)
    axis = axes[0, 0]
    axis.semilogy(frequency_hz, np.abs(measured), color=MEASURED, lw=1.6, alpha=0.55, label="measured")
    axis.semilogy(frequency_hz, np.abs(model), color=AFTER, lw=0.9, label="identified M, C, K")
    axis.legend(fontsize=9, frameon=False)
    label(axis, "frequency [Hz]", f"acceleration of floor {floor} / ground")
    return figure
