"""Figures of the tracing: location of the residual, ranking, loops before and after, errors per test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.style import COLOURS, MEASURED, MODEL, figure_with_axes, label
from mrpipe.reporting.traced_words import exchange_in_words, numbers_of, unproven_in_words
from mrpipe.reporting.words import percent
from mrpipe.words import in_percent, listed

AFTER = COLOURS[0]
"""Colour of the model with the effects."""

MOST_BARS = 24
"""Largest number of bars; of more tests those with the largest errors are drawn."""

_PARTS = {
    "cycle": ("stage of the cycle", {"pre_yield": "pre-yield", "post_yield": "post-yield", "reversal": "reversal"}),
    "drive": ("drive", {"rising": "rising", "falling": "falling", "constant": "constant"}),
    "direction": ("direction", {"positive": "out (v > 0)", "negative": "in (v < 0)"}),
    "time": ("third of the test", {"first": "first", "second": "second", "third": "last"}),
}


@dataclass(frozen=True)
class ShownTest:
    """A validation test as it is drawn; SI, each of shape (n,)."""

    name: str
    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    error_before: float
    error_after: float


def residual_location(location: Mapping[str, Mapping[str, float]]) -> Figure:
    """Draw the shares of the sum of squares of the residual by part of the cycle, drive, direction and time."""
    groups = [name for name in _PARTS if name in location]
    figure, axes = figure_with_axes(1, 1, height=0.55 * len(groups) + 0.7)
    axis = axes[0, 0]
    for row, name in enumerate(groups):
        left, small = 0.0, []
        for index, (key, text) in enumerate(_PARTS[name][1].items()):
            share = float(location[name].get(key, 0.0))
            axis.barh(-row, share, 0.62, left=left, color=COLOURS[index], alpha=0.85)
            if share > 0.09:
                axis.text(
                    left + 0.5 * share, -row, f"{text} {in_percent(share)}", ha="center", va="center", fontsize=8,
                    color="white",
                )  # fmt: skip
            elif share >= 0.005:
                small.append(f"{text} {in_percent(share)}")
            left += share
        if small:
            axis.text(1.01, -row, "\n".join(small), va="center", fontsize=8)
    axis.set_yticks([-row for row in range(len(groups))], [_PARTS[name][0] for name in groups])
    axis.set_xlim(0.0, 1.0)
    axis.grid(visible=False)
    label(axis, "share of the residual's sum of squares [1]", "")
    return figure


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
    unit
        Unit of the residual.
    """
    columns = min(2, len(maps))
    rows = -(-len(maps) // columns)
    figure, axes = figure_with_axes(rows, columns, width=10.0, height=3.6)
    drawn = []
    for axis, (x_label, y_label, x, y) in zip(axes.ravel(), maps, strict=False):
        edges = [np.linspace(float(np.quantile(v, 0.002)), float(np.quantile(v, 0.998)), 41) for v in (x, y)]
        label(axis, x_label, y_label)
        axis.grid(visible=False)
        if any(edge[-1] <= edge[0] for edge in edges):
            axis.text(0.5, 0.5, "does not vary", ha="center", va="center", transform=axis.transAxes, fontsize=9)
            continue
        total, *_ = np.histogram2d(x, y, bins=edges, weights=residual)
        count, *_ = np.histogram2d(x, y, bins=edges)
        drawn.append((axis, edges, np.where(count > 2, total / np.maximum(count, 1), np.nan)))
    values = np.concatenate([np.abs(mean[np.isfinite(mean)]) for _, _, mean in drawn]) if drawn else np.zeros(0)
    limit = float(np.quantile(values, 0.98)) if values.size else 1.0
    for axis, edges, mean in drawn:
        image = axis.pcolormesh(*edges, mean.T, cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=True)
    if drawn:
        bar = figure.colorbar(image, ax=axes, shrink=0.7, extend="both")
        bar.set_label(f"mean of measured less model [{unit}]", fontsize=8)
        bar.ax.tick_params(labelsize=8)
    return figure


def candidate_ranking(
    candidates: Sequence[Mapping[str, Any]],
    named_share: float,
    least_share: float,
    quantity: str = "share of the recoverable residual [1]",
) -> Figure:
    """Draw the share of the recoverable residual that each family recovers, best at the top; `quantity` is its name."""
    figure, axes = figure_with_axes(1, 1, height=0.34 * max(len(candidates), 3) + 0.9)
    axis = axes[0, 0]
    place = np.arange(len(candidates))[::-1]
    shares = [max(float(item["share"]), 0.0) for item in candidates]
    bound = [bool(item.get("at_bound")) for item in candidates]
    axis.barh(place, shares, 0.7, color=[COLOURS[7] if stuck else AFTER for stuck in bound])
    for y, share, item, stuck in zip(place, shares, candidates, bound, strict=True):
        note = f" {in_percent(share)}, NRMSE {item['nrmse']:.3g}{', at a bound' if stuck else ''}"
        inside = share > 0.75
        # a text in front of a line has a white ground, so that it can be read
        ground = None if inside else {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
        axis.text(share, y, note + " ", va="center", ha="right" if inside else "left", fontsize=8,
                  color="white" if inside else "black", bbox=ground, zorder=3)  # fmt: skip
    axis.set_yticks(place, [f"{item['name']} ({item['form']})" for item in candidates])
    for limit, style, text in ((named_share, "--", "proves a name"), (least_share, ":", "least share")):
        axis.axvline(limit, color="k", lw=0.8, ls=style, label=f"{text} ({limit:g})", zorder=0.9)
    axis.set_xlim(0, 1.02)
    axis.grid(axis="y", visible=False)
    axis.legend(fontsize=7, loc="lower right")
    label(axis, quantity, "")
    return figure


def loops_before_and_after(tests: Sequence[ShownTest]) -> Figure:
    """Draw force over displacement, over velocity and over time: measured, before and after."""
    figure, axes = figure_with_axes(len(tests), 3, width=11.0, height=2.9)
    for row, test in enumerate(tests):
        window = _window(test.time)
        curves = (
            (test.measured, "measured", MEASURED, 1.6),
            (test.before, "before", MODEL, 0.9),
            (test.after, "after", AFTER, 0.9),
        )
        for values, name, colour, width in curves:
            axes[row, 0].plot(1e3 * test.displacement[window], values[window], color=colour, lw=width, label=name)
            axes[row, 1].plot(1e3 * test.velocity[window], values[window], color=colour, lw=width)
            axes[row, 2].plot(test.time[window], values[window], color=colour, lw=width)
        errors = f"NRMSE {test.error_before:.3f} before, {test.error_after:.3f} after"
        label(axes[row, 0], "displacement [mm]", "force [N]", test.name)
        label(axes[row, 1], "velocity [mm/s]", "", "")
        label(axes[row, 2], "time [s]", "", errors)
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    return figure


def _window(time: FloatArray) -> slice:
    """Return at most six seconds from the middle of a test."""
    length = float(time[-1] - time[0])
    if length <= 6.0:
        return slice(None)
    first, last = np.searchsorted(time, [time[0] + 0.5 * length - 3.0, time[0] + 0.5 * length + 3.0])
    return slice(int(first), int(last))


def errors_per_test(rows: Sequence[Mapping[str, Any]], noise_floor: float) -> Figure:
    """Draw the NRMSE of the validation tests before and after, the largest first."""
    shown = sorted(rows, key=lambda row: -row["nrmse_before"])[:MOST_BARS]
    figure, axes = figure_with_axes(1, 1, height=0.22 * max(len(shown), 6) + 1.0)
    axis = axes[0, 0]
    place = np.arange(len(shown))[::-1]
    before, after = ([100.0 * row[f"nrmse_{when}"] for row in shown] for when in ("before", "after"))
    axis.hlines(place, after, before, color="#bbbbbb", lw=1.5, zorder=1)
    axis.scatter(before, place, s=22, color=MODEL, label="before", zorder=2)
    axis.scatter(after, place, s=22, color=AFTER, label="after", zorder=2)
    axis.axvline(100.0 * noise_floor, color="k", lw=0.8, ls="--", label="noise floor")
    axis.set_yticks(place, [row["name"] for row in shown], fontsize=7)
    # room below for the legend, so that it hides no test, and above for the first one
    axis.set_ylim(place[-1] - 0.5 - 1.3 * len(shown) / max(len(shown), 6), place[0] + 0.5)
    axis.set_xlim(left=0.0)
    axis.grid(axis="y", visible=False)
    axis.legend(fontsize=8, loc="lower right", ncols=3)
    label(axis, "RMS error over RMS value [%]", "")
    return figure


def in_plain_words(summary: Mapping[str, Any]) -> str:
    """Return a paragraph on the result in plain words."""
    before, after = summary["before"]["nrmse"], summary["after"]["nrmse"]
    model, floor = summary["model"], summary["noise_floor_nrmse"]
    start = (
        f"On validation tests, which no fit has seen, the model {model} misses the measured force by "
        f"{_percent(before)} (RMS of the error over RMS of the force); the noise floor, from "
        f"{summary.get('noise_from', 'the sensors')}, is {_percent(floor)}."
    )
    effects = [item for item in summary["effects"] if item["name"] != "unattributed"]
    exchange = exchange_in_words(summary)
    flexible = len(effects) < len(summary["effects"])
    added = (
        f" As requested, a flexible model is added as the effect `unattributed`, with which the error is "
        f"{_percent(after)}: it has no physical meaning and does not run in the closed loop."
        if flexible
        else ""
    )
    left_out = [item for item in summary.get("findings", []) if item["left_out"]]
    if left_out:
        reasons = "; ".join(f"{item['test']} {item['sentence']}" for item in left_out)
        start = f"Tests that contradict the others are left out of the fit: {reasons}. {start}"
    kind = summary.get("verdict_class", "")
    if kind == "validation differs":
        named = " ".join(_effect_in_words(effect) for effect in effects)
        return f"{start} {_difference_in_words(summary['validation'])}{' ' + named if named else ''}{added}"
    if kind == "noise" or not (kind or summary["residual"]["structured"]):
        return f"{start} The residual is noise: nothing is missing."
    if kind == "base form":
        return f"{start} Another base form is needed: {summary['verdict']}. The error is then {_percent(after)}."
    if kind and not summary["candidates"] and not effects:
        return f"{start} {summary['verdict'][:1].upper()}{summary['verdict'][1:]}."
    if not effects:
        states = [item["state"] for item in summary["unexplained"]["depends_on"][:3]]
        depends = f" It varies with {listed(states)}." if states else ""
        form = f" {exchange}" if exchange else ""
        reached = f" The error is then {_percent(after)}." if form and not flexible else ""
        unproven = _after_a_blank(unproven_in_words(summary.get("further_terms", [])))
        return (
            f"{start} Something is missing, but no known effect explains it.{form}{unproven}{reached}{depends}{added}"
        )
    parts = [*([exchange] if exchange else []), *(_effect_in_words(effect) for effect in effects)]
    share = summary["ceiling"]["recovered"]
    recovers = f"recovers {in_percent(share)} of what a flexible model could"
    added_up = "Added to the model, it" if len(effects) == 1 else "Added to the model, they"
    if len(effects) > 1:
        recovers = recovers.replace("recovers", "recover", 1)
    end = f"{added_up} {recovers}." if flexible else f"{added_up} {recovers}; the error is then {_percent(after)}."
    end += _after_a_blank(unproven_in_words(summary.get("further_terms", [])))
    if summary["unexplained"]["structured"]:
        states = [item["state"] for item in summary["unexplained"]["depends_on"][:3]]
        end += f" Something is still unexplained{'; it varies with ' + listed(states) if states else ''}."
    names = listed([f"**{effect['name']}**" for effect in effects])
    return f"{start} The model lacks {names}. {' '.join(parts)} {end}{added}"


def _difference_in_words(found: Mapping[str, Any]) -> str:
    """Return how the validation tests differ from the training tests, and the error on the comparable part."""
    differences = "; ".join(item["sentence"] for item in found["differences"])
    text = f"The validation tests differ from the training tests: {differences}."
    comparable = found.get("comparable") or {}
    if comparable.get("nrmse_after") is not None:
        text += (
            f" On the comparable part ({_percent(comparable['share_of_samples'])} of the samples) the error is "
            f"{_percent(comparable['nrmse_before'])} before and {_percent(comparable['nrmse_after'])} after."
        )
    if comparable.get("nrmse_corrected") is not None:
        text += (
            f" With gain, lag and offset corrected, estimated from the first part of each record and judged on the "
            f"rest, the error is {_percent(comparable['nrmse_corrected'])}."
        )
    return text


def _after_a_blank(text: str) -> str:
    return f" {text}" if text else ""


def _effect_in_words(effect: Mapping[str, Any]) -> str:
    text = (
        f"{effect['name'].capitalize()} in the form {effect['form']} ({numbers_of(effect, digits=4)}; confidence "
        f"{effect['confidence']:.2f}): {effect['physics']} Remedy on the rig: {effect['remedy']}"
    )
    if effect.get("source"):
        text += f" Source of the law: {effect['source']}."
    if effect["tied_with"]:
        tests = "; ".join(f"{k}: {v}" for k, v in effect.get("separating_tests", {}).items())
        text += f" These tests do not separate it from {listed(effect['tied_with'])}{f' ({tests})' if tests else ''}."
    if effect.get("corrected_in") == "prepare":
        text += " It is a fault of sensors: corrections.yaml takes it out in prepare, it does not go into the damper."
    return text


def _percent(share: float) -> str:
    return percent(share) if share < 0.1 else in_percent(share, 1)
