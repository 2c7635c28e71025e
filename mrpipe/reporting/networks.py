"""Figures of the training set, the networks and the sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mrpipe.artifacts import FloatArray
from mrpipe.networks.assembly import History, Samples
from mrpipe.networks.candidates import SHORT, Candidate
from mrpipe.networks.sweep import Outcome
from mrpipe.networks.tracking import ViscousEmulation
from mrpipe.reporting.style import COLOURS, MEASURED, MODEL, figure_with_axes, label

_MOST_POINTS = 6000


def joined_history(history: History) -> Figure:
    """Return the channels of a joined history against time."""
    rows = (
        ("displacement", 1e3, "displacement [mm]"),
        ("velocity", 1e3, "velocity [mm/s]"),
        ("drive", 1.0, f"drive [{history.drive_unit}]"),
        ("force", 1.0, "force [N]"),
    )
    figure, axes = figure_with_axes(len(rows), 1, height=1.5)
    stride = max(1, history.samples // 40000)
    time = np.arange(history.samples)[::stride] / history.sampling_rate_hz
    for axis, (name, factor, text) in zip(axes[:, 0], rows, strict=True):
        axis.plot(time, factor * history.channels[name][::stride], color=COLOURS[0], linewidth=0.5)
        label(axis, "", text)
    label(axes[-1, 0], "time in the joined history [s]", rows[-1][2])
    return figure


def training_progress(path: FloatArray, held_out: Sequence[float]) -> Figure:
    """Return training error against iteration, and the held-out error of every start."""
    figure, axes = figure_with_axes(1, 2)
    axes[0, 0].semilogy(np.arange(len(path)), path, color=MODEL)
    label(axes[0, 0], "iteration", "training NRMSE", "The chosen start")
    axes[0, 0].tick_params(axis="y", which="both", labelsize=8)
    ordered = np.sort(np.asarray(held_out, dtype=np.float64))
    axes[0, 1].plot(np.arange(1, len(ordered) + 1), ordered, "o", color=COLOURS[0])
    axes[0, 1].set_ylim(0.0, 1.15 * float(ordered[-1]))
    axes[0, 1].xaxis.set_major_locator(MaxNLocator(integer=True))
    label(axes[0, 1], "start, by rank", "held-out NRMSE", "Spread over starts")
    return figure


def spread_of_tests(history: History, count: int, *, varying_first: bool = False) -> list[int]:
    """Return the indices of a few tests that differ, constant and varying drive in turn."""
    constant = [index for index, varies in enumerate(history.drive_varies) if not varies]
    varying = [index for index, varies in enumerate(history.drive_varies) if varies]
    groups = [group for group in ((varying, constant) if varying_first else (constant, varying)) if group]
    share = -(-count // len(groups)) if groups else 0
    chosen: list[int] = []
    for group in groups:
        places = np.unique(np.linspace(0, len(group) - 1, min(share, len(group))).round().astype(int))
        chosen.extend(group[place] for place in places)
    return chosen[:count]


def force_loops(history: History, samples: Samples, estimated: FloatArray) -> Figure:
    """Return measured and estimated force against displacement and velocity for some tests."""
    chosen = spread_of_tests(history, 4)
    figure, axes = figure_with_axes(len(chosen), 2, height=2.8)
    for row, test in enumerate(chosen):
        rows = np.flatnonzero(samples.test == test)[-_MOST_POINTS:]
        for column, (name, text) in enumerate((("displacement", "displacement [mm]"), ("velocity", "velocity [mm/s]"))):
            motion = 1e3 * history.channels[name][samples.sample[rows]]
            axis = axes[row, column]
            axis.plot(motion, samples.target[rows], color=MEASURED, linewidth=0.8, label="measured")
            axis.plot(motion, estimated[rows], color=MODEL, linewidth=0.8, label="network")
            label(axis, text, "force [N]", history.names[test])
    if chosen:
        axes[0, 0].legend(fontsize=7)
    return figure


def drive_histories(history: History, samples: Samples, estimated: FloatArray) -> Figure:
    """Return measured and estimated drive against time for some tests, about four cycles each."""
    chosen = spread_of_tests(history, 6, varying_first=True)
    figure, axes = figure_with_axes(-(-len(chosen) // 2), 2, height=2.2)
    for axis, test in zip(axes.ravel(), chosen, strict=False):
        rows = np.flatnonzero(samples.test == test)
        displacement = history.channels["displacement"][samples.sample[rows]]
        ups = np.flatnonzero((displacement[:-1] <= 0.0) & (displacement[1:] > 0.0))
        rows = rows[: int(ups[3]) if len(ups) > 3 else 2000]
        time = np.arange(len(rows)) / history.sampling_rate_hz
        axis.plot(time, samples.target[rows], color=MEASURED, linewidth=1.0, label="measured")
        axis.plot(time, estimated[rows], color=MODEL, linewidth=0.8, label="network")
        label(axis, "time [s]", f"drive [{history.drive_unit}]", history.names[test])
    for axis in axes.ravel()[len(chosen) :]:
        axis.set_visible(False)
    if len(chosen):
        axes[0, 0].legend(fontsize=7)
    return figure


def viscous_emulation(emulation: ViscousEmulation, drive_unit: str) -> Figure:
    """Return drive and force of the emulated viscous damper (thesis Figure 2.24 b to d)."""
    figure, axes = figure_with_axes(1, 3)
    tracking = emulation.tracking
    shown = emulation.time_s < emulation.time_s[0] + 2.0 / emulation.frequency_hz
    time = emulation.time_s[shown]
    axes[0, 0].plot(time, tracking.drive[shown], color=MODEL)
    label(axes[0, 0], "time [s]", f"drive [{drive_unit}]")
    axes[0, 1].plot(time, tracking.desired_n[shown], color=MEASURED, label="desired")
    axes[0, 1].plot(time, tracking.force_n[shown], color=MODEL, linewidth=0.9, label="obtained")
    axes[0, 1].legend(fontsize=7)
    label(axes[0, 1], "time [s]", "force [N]", f"c = {emulation.damping_n_s_m:.0f} N s/m")
    speed = 1e3 * emulation.velocity_m_s[shown]
    axes[0, 2].plot(speed, tracking.desired_n[shown], color=MEASURED)
    axes[0, 2].plot(speed, tracking.force_n[shown], color=MODEL, linewidth=0.9)
    label(axes[0, 2], "velocity [mm/s]", "force [N]")
    return figure


def sweep_axes(outcomes: Sequence[Outcome], centre: Candidate) -> Figure:
    """Return the error over starts along each axis of a sweep through its centre, at the screening level."""
    figure, axes = figure_with_axes(1, 3, width=11.0, height=3.8)
    states = [o for o in outcomes if replace(o.candidate, states=centre.states) == centre]
    past = sorted(
        (o for o in outcomes if replace(o.candidate, past_values=centre.past_values) == centre),
        key=lambda o: o.candidate.past_values,
    )
    shapes = sorted(
        (o for o in outcomes if replace(o.candidate, hidden=centre.hidden) == centre),
        key=lambda o: (len(o.candidate.hidden), o.candidate.hidden),
    )
    groups = (
        (states, [",".join(SHORT[name] for name in o.candidate.channels) for o in states], "inputs"),
        (past, [str(o.candidate.past_values) for o in past], "past values"),
        (shapes, ["-".join(str(count) for count in o.candidate.hidden) for o in shapes], "hidden layers"),
    )
    for axis, (chosen, names, title) in zip(axes[0], groups, strict=True):
        for place, outcome in enumerate(chosen):
            axis.plot(np.full(len(outcome.screened), place), outcome.screened, ".", color=COLOURS[7], markersize=4)
            axis.plot([place], [np.exp(np.mean(np.log(outcome.screened)))], "_", color=COLOURS[0], markersize=14)
            if outcome.is_refined:
                axis.plot(np.full(len(outcome.refined), place + 0.2), outcome.refined, ".", color=MODEL, markersize=4)
                axis.plot([place + 0.2], [np.exp(np.mean(np.log(outcome.refined)))], "_", color=MODEL, markersize=14)
        axis.set_yscale("log")
        axis.tick_params(axis="y", which="both", labelsize=7)
        axis.set_xticks(range(len(names)), names, rotation=45, fontsize=7)
        label(axis, "", "held-out NRMSE", title)
    for name, colour in (("screened", COLOURS[7]), ("refined", MODEL)):
        axes[0, 0].plot([], [], ".", color=colour, label=name)
    axes[0, 0].legend(fontsize=7)
    return figure


def sweep_sizes(outcomes: Sequence[Outcome], chosen: Outcome) -> Figure:
    """Return the error against the number of parameters, screened and refined."""
    figure, axes = figure_with_axes(1, 1)
    axis = axes[0, 0]
    for level, colour in (("screened", COLOURS[7]), ("refined", MODEL)):
        shown = [o for o in outcomes if level == "screened" or o.is_refined]
        means = [float(np.exp(np.mean(np.log(getattr(o, level))))) for o in shown]
        axis.plot([o.candidate.parameters for o in shown], means, "o", color=colour, markersize=4, label=level)
    best = float(np.exp(np.mean(np.log(chosen.refined))))
    axis.plot([chosen.candidate.parameters], [best], "o", markersize=12, markerfacecolor="none", color=COLOURS[0])
    axis.set_yscale("log")
    axis.tick_params(axis="y", which="both", labelsize=7)
    axis.legend(fontsize=7)
    label(axis, "parameters", "held-out NRMSE, mean over starts", chosen.candidate.label)
    return figure
