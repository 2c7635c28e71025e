"""Figures of the tracing of a structure: force maps of storeys, residual histories; and a paragraph in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.traced_words import tie_in_words
from mrpipe.reporting.words import percent

MAPS_CAPTION = (
    "Mean residual shear force over drift and its rate, storey by storey: friction shows as two halves (sign of the "
    "rate), a stiffness as left and right, a bumper as a rim."
)


def storey_maps(maps: Sequence[tuple[int, FloatArray, FloatArray, FloatArray]]) -> Figure:
    """Draw the mean residual force of each storey over (drift [m], rate [m/s]); arrays of shape (m,), force in N."""
    columns = min(3, len(maps))
    rows = -(-len(maps) // columns)
    figure = Figure(figsize=(4.4 * columns, 3.4 * rows), layout="constrained")
    for place, (storey, drift, rate, residual) in enumerate(maps, start=1):
        axes = figure.add_subplot(rows, columns, place)
        states = (1e3 * drift, 1e3 * rate)
        edges = [np.linspace(float(np.quantile(v, 0.002)), float(np.quantile(v, 0.998)), 33) for v in states]
        if any(edge[-1] <= edge[0] for edge in edges):
            continue
        total, *_ = np.histogram2d(*states, bins=edges, weights=residual)
        count, *_ = np.histogram2d(*states, bins=edges)
        mean = np.where(count > 3, total / np.maximum(count, 1), np.nan)
        limit = float(np.nanquantile(np.abs(mean), 0.98)) or 1.0
        image = axes.pcolormesh(*edges, mean.T, cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=True)
        figure.colorbar(image, ax=axes, label="mean residual [N]")
        axes.set_title(f"storey {storey}", fontsize=9)
        axes.set_xlabel("drift [mm]")
        axes.set_ylabel("rate [mm/s]")
    return figure


def histories(tests: Sequence[tuple[str, int, FloatArray, FloatArray, FloatArray, FloatArray]]) -> Figure:
    """Draw residuals before and after: (test, storey, time [s], shear force, before, after [N]), shape (m,) each."""
    figure = Figure(figsize=(9.0, 2.6 * len(tests)), layout="constrained")
    for row, (name, storey, time, shear, before, after) in enumerate(tests, start=1):
        axes = figure.add_subplot(len(tests), 1, row)
        # the few seconds in which most is missing
        size = min(len(time), max(50, round(4.0 / (time[1] - time[0]))))
        power = np.convolve(before**2, np.ones(size), mode="valid")
        piece = slice(int(np.argmax(power)), int(np.argmax(power)) + size)
        axes.plot(time[piece], shear[piece], color="0.75", lw=1.0, label="shear force")
        axes.plot(time[piece], before[piece], color="#c44e52", lw=1.0, label="residual before")
        axes.plot(time[piece], after[piece], color="#3b6ea5", lw=1.0, label="residual after")
        axes.set_title(f"{name}, storey {storey}", fontsize=9)
        axes.set_ylabel("N")
        if row == 1:
            axes.legend(fontsize=8, ncols=3)
    if tests:
        axes.set_xlabel("time [s]")
    return figure


def in_plain_words(summary: Mapping[str, Any]) -> str:
    """Return a paragraph that says what was found, in plain words."""
    before, after = summary["before"]["nrmse"], summary["after"]["nrmse"]
    start = (
        f"On validation tests the model {summary['model']} misses {percent(before)} of the quantity "
        f"that is compared ({summary['quantity']}); sensor noise alone is {percent(summary['noise_floor_nrmse'])}."
    )
    if not summary["residual"]["structured"]:
        return f"{start} The rest is noise: nothing is missing."
    if not summary["effects"]:
        depends = ", ".join(item["state"] for item in summary["unexplained"]["depends_on"][:3])
        if tied := tie_in_words(summary):
            return f"{start} Something is missing. {tied}"
        return f"{start} Something is missing, but no known effect explains it." + (
            f" It varies with {depends}." if depends else ""
        )
    parts = []
    for effect in summary["effects"]:
        numbers = ", ".join(
            f"{name.replace('_', ' ')} {value['value']:.4g} {value['unit']}".removesuffix(" 1")
            for name, value in effect["parameters"].items()
        )
        place = f" at {effect['place']}" if effect.get("place") else ""
        parts.append(
            f"{effect['name']}{place} ({effect['form']}: {numbers}). {effect['physics']} Remedy: {effect['remedy']}"
        )
        if effect.get("source"):
            parts.append(f"Source of the law: {effect['source']}.")
        if effect["tied_with"]:
            tests = "; ".join(f"{k}: {v}" for k, v in effect.get("separating_tests", {}).items())
            parts.append(f"Not separated from {', '.join(effect['tied_with'])} by these tests ({tests}).")
    end = f"With it the error is {percent(after)}."
    if summary["unexplained"]["structured"]:
        end += f" Something is still unexplained. {tie_in_words(summary)}".rstrip()
    return f"{start} The model lacks {' '.join(parts)} {end}"
