"""Figures of the tracing: residual maps, ranking, loops before and after, errors per test; and a paragraph in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray


def residual_maps(
    maps: Sequence[tuple[str, str, FloatArray, FloatArray]], residual: FloatArray, unit: str = "N"
) -> Figure:
    """Draw the mean residual over pairs of states.

    Parameters
    ----------
    maps
        (label of the abscissa, label of the ordinate, values, values), each of shape (n,).
    residual
        Residual force [N], shape (n,).
    """
    columns = min(2, len(maps))
    rows = -(-len(maps) // columns)
    figure = Figure(figsize=(5.2 * columns, 3.8 * rows), layout="constrained")
    limit = float(np.quantile(np.abs(residual), 0.98)) or 1.0
    for place, (x_label, y_label, x, y) in enumerate(maps, start=1):
        axes = figure.add_subplot(rows, columns, place)
        edges = [np.linspace(float(np.quantile(v, 0.002)), float(np.quantile(v, 0.998)), 41) for v in (x, y)]
        if any(edge[-1] <= edge[0] for edge in edges):
            axes.text(0.5, 0.5, "does not vary", ha="center", va="center", transform=axes.transAxes)
            continue
        total, *_ = np.histogram2d(x, y, bins=edges, weights=residual)
        count, *_ = np.histogram2d(x, y, bins=edges)
        mean = np.where(count > 2, total / np.maximum(count, 1), np.nan)
        image = axes.pcolormesh(*edges, mean.T, cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=True)
        figure.colorbar(image, ax=axes, label=f"mean residual [{unit}]")
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
    return figure


def candidate_ranking(candidates: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the share of the recoverable residual that each family recovers, best at the top."""
    figure = Figure(figsize=(7.0, 0.42 * max(len(candidates), 3) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    names = [f"{item['name']} ({item['form']})" for item in candidates]
    place = np.arange(len(names))[::-1]
    axes.barh(place, [max(float(item["share"]), 0.0) for item in candidates], color="#3b6ea5")
    axes.set_yticks(place, names)
    axes.axvline(0.9, color="k", lw=0.8, ls="--")
    axes.axvline(0.5, color="k", lw=0.8, ls=":")
    axes.set_xlim(0, 1.02)
    axes.set_xlabel("share of the recoverable residual")
    return figure


def loops_before_and_after(
    tests: Sequence[tuple[str, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]],
) -> Figure:
    """Draw loops and histories: (name, time, displacement, measured, before, after), SI, each of shape (n,)."""
    figure = Figure(figsize=(10.0, 3.2 * len(tests)), layout="constrained")
    for row, (name, time, displacement, measured, before, after) in enumerate(tests):
        loop = figure.add_subplot(len(tests), 2, 2 * row + 1)
        history = figure.add_subplot(len(tests), 2, 2 * row + 2)
        for values, label, colour, width in (
            (measured, "measured", "k", 1.4),
            (before, "before", "#c44e52", 1.0),
            (after, "after", "#3b6ea5", 1.0),
        ):
            loop.plot(1e3 * displacement, values, label=label, color=colour, lw=width)
            history.plot(time, values, label=label, color=colour, lw=width)
        loop.set_xlabel("displacement [mm]")
        loop.set_ylabel("force [N]")
        loop.set_title(name, fontsize=9)
        history.set_xlabel("time [s]")
        if row == 0:
            history.legend(fontsize=8)
    return figure


def errors_per_test(rows: Sequence[Mapping[str, Any]], noise_floor: float) -> Figure:
    """Draw the NRMSE of every validation test before and after."""
    figure = Figure(figsize=(8.0, 0.28 * max(len(rows), 4) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(rows))[::-1]
    axes.barh(place + 0.2, [row["nrmse_before"] for row in rows], 0.38, label="before", color="#c44e52")
    axes.barh(place - 0.2, [row["nrmse_after"] for row in rows], 0.38, label="after", color="#3b6ea5")
    axes.axvline(noise_floor, color="k", lw=0.8, ls="--", label="noise")
    axes.set_yticks(place, [row["name"] for row in rows], fontsize=7)
    axes.set_xlabel("NRMSE")
    axes.legend(fontsize=8)
    return figure


def in_plain_words(summary: Mapping[str, Any]) -> str:
    """Return a paragraph that says what was found, in plain words."""
    before, after = summary["before"]["nrmse"], summary["after"]["nrmse"]
    model, floor = summary["model"], summary["noise_floor_nrmse"]
    start = (
        f"On validation tests, which no fit has seen, the model {model} misses the measured force by "
        f"{100 * before:.1f} % (RMS over RMS); sensor noise alone is {100 * floor:.1f} %."
    )
    effects = summary["effects"]
    if not summary["residual"]["structured"]:
        return f"{start} What is left is noise: nothing is missing."
    if not effects:
        states = [item["state"] for item in summary["unexplained"]["depends_on"][:3]]
        depends = f" It varies with {', '.join(states)}." if states else ""
        return f"{start} Something is missing, but no known effect explains it.{depends}"
    parts = []
    for effect in effects:
        numbers = ", ".join(
            f"{name.replace('_', ' ')} {value['value']:.4g} {value['unit']}".removesuffix(" 1")
            for name, value in effect["parameters"].items()
        )
        parts.append(f"{effect['name']} ({effect['form']}: {numbers}). {effect['physics']} Remedy: {effect['remedy']}")
        if effect["tied_with"]:
            tests = "; ".join(f"{k}: {v}" for k, v in effect.get("separating_tests", {}).items())
            parts.append(f"Not to be told apart from {', '.join(effect['tied_with'])} by these tests ({tests}).")
    share = summary["ceiling"]["recovered"]
    end = f"With it the error is {100 * after:.1f} %, {100 * share:.0f} % of what is recoverable."
    if summary["unexplained"]["structured"]:
        end += " Something is still unexplained."
    return f"{start} The model lacks {' '.join(parts)} {end}"
