"""The closed loop before and after in words, as a table and as a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mrpipe.reporting.style import COLOURS, MEASURED, MODEL, figure_with_axes, label

COLUMNS = {
    "measured": ("measured", MEASURED),
    "before": ("model without the effect", MODEL),
    "after": ("model with the effect", COLOURS[0]),
    "recalibrated": ("with the effect, controller renewed", COLOURS[2]),
}
"""Column -> what it is called in figures, and its colour."""

BEYOND = 1.25
"""Damper motion over the stroke of the bench tests above which a prediction is called an extrapolation."""

WORTH_SAYING = 0.01
"""Change of a law's response below which it is not spoken of."""


def in_words(found: Mapping[str, Any]) -> str:
    """Return what the closed loop says, in plain words."""
    if "laws" not in found:
        return f"Closed loop {found['status']}."
    effects = found["plant"]["effects"]
    parts = [f"Closed loop, {found['status']}."]
    if "rms_x_top_error" in found:
        error = found["rms_x_top_error"]
        parts.append(
            f"The model misses the measured RMS displacement of the top floor by {_percent(error['before'])} (RMS over "
            f"the recordings) before and by {_percent(error['after'])} after."
        )
    parts.append(ranking_in_words(found))
    parts += [f"The effect {name} is not in the plant: {why}." for name, why in found["plant"]["left_out"].items()]
    if effects and "controller" in found:
        parts.append(controller_in_words(found))
    parts += _doubts(found["laws"])
    return " ".join(parts)


def _doubts(laws: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what to be careful about: responses that grow, and motion beyond what the damper was tested at."""
    grows = [f"{row['law']} ({when})" for row in laws for when in COLUMNS if "diverged" in row.get(when, {})]
    far = [
        f"{row['law']} ({row['after']['peak_over_tested_stroke']:.1f} times)"
        for row in laws
        if row.get("after", {}).get("peak_over_tested_stroke", 0.0) > BEYOND
    ]
    said = []
    if grows:
        said.append(f"The predicted response grows without bound under {', '.join(grows)}.")
    if far:
        said.append(f"Beyond the stroke of the bench tests, and so extrapolated: {', '.join(far)}.")
    return said


def ranking_in_words(found: Mapping[str, Any]) -> str:
    """Return whether the effect changes the order of the laws."""
    order = found["ranking"]
    listed = ", ".join(order["after"])
    if not found["plant"]["effects"]:
        return f"The damper stays as it is, and so does the ranking of the laws: {listed} (the best first)."
    if found["ranking_changes"]:
        swaps = ", ".join(f"{a} is now ahead of {b}" for a, b in found["reversed_pairs"])
        said = f"The effect changes the ranking of the laws ({swaps}): {listed} (the best first)."
    else:
        said = f"The effect does not change the ranking of the laws: {listed} (the best first)."
    if "measured" in order:
        agrees = found["ranking_agrees_with_measured"]
        words = {(True, True): "both before and after", (True, False): "before only", (False, True): "only after"}
        said += (
            f" The order measured is {', '.join(order['measured'])}; the model agrees with it "
            f"{words.get((agrees['before'], agrees['after']), 'neither before nor after')}."
        )
    return said


def controller_in_words(found: Mapping[str, Any]) -> str:
    """Return what was renewed in the controller and what it brings."""
    new = found["controller"]
    gains = ", ".join(
        f"{law} x {value:.2f}" for law, value in new["gain_factors"].items() if abs(value - 1.0) > WORTH_SAYING
    )
    parts: dict[str, list[str]] = {}
    for law, renewed in new["renewed"].items():
        if renewed != "nothing":
            parts.setdefault(renewed, []).append(law)
    taken = "; ".join(f"{renewed} for {', '.join(laws)}" for renewed, laws in parts.items())
    text = (
        f"A controller that knows the effect has its inverse {new['inverse']}, a switch at "
        f"{new['switch_force_after_n']:.1f} N in place of {new['switch_force_before_n']:.1f} N (the residual force is "
        f"{new['residual_force_after_n']:.1f} N, without the effect {new['residual_force_before_n']:.1f} N) and "
        f"{'gains ' + gains if gains else 'the gains it had'}. Of these each law takes what lowers its simulated "
        f"response: {taken or 'none takes any'}."
    )
    return f"{text} {gain_in_words(found['laws'])}"


def gain_in_words(laws: Sequence[Mapping[str, Any]]) -> str:
    """Return what the renewed controller changes on the damper with the effect."""
    changes = {
        row["law"]: row["recalibrated"]["rms_x_top_m"] / row["after"]["rms_x_top_m"] - 1.0
        for row in laws
        if "rms_x_top_m" in row.get("recalibrated", {}) and "rms_x_top_m" in row.get("after", {})
    }
    told = {law: change for law, change in changes.items() if abs(change) > WORTH_SAYING}
    if not told:
        return (
            "It changes the RMS top displacement of no law by more than 1 %: knowing the effect corrects the "
            "prediction, and little is to be gained in control."
        )
    listed = ", ".join(f"{law} {100.0 * change:+.0f} %" for law, change in told.items())
    return (
        f"On the damper with the effect it changes the RMS top displacement: {listed}; the other laws stay within 1 %."
    )


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.1f} %"


def law_table(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row a law: RMS of the top floor by column, in millimetres, and of the first floor's acceleration."""
    rows = []
    for item in found["laws"]:
        row: dict[str, Any] = {"law": item["law"]}
        for key, unit, factor in (("rms_x_top_m", "mm", 1e3), ("rms_x1_m", "mm", 1e3), ("rms_a1_m_s2", "m/s2", 1.0)):
            name = key.removesuffix("_m").removesuffix("_m_s2").removesuffix("_s2")
            for when in COLUMNS:
                values = item.get(when, {})
                if when in item:
                    row[f"{name} {when} [{unit}]"] = "grows" if "diverged" in values else _scaled(values, key, factor)
        rows.append(row)
    return rows


def _scaled(values: Mapping[str, float], key: str, factor: float) -> float | None:
    return factor * values[key] if key in values else None


def response_by_law(found: Mapping[str, Any]) -> Figure:
    """Draw the RMS displacement of the top floor and acceleration of the first by law: measured and predicted."""
    laws = found["laws"]
    shown = [when for when in COLUMNS if any(when in item for item in laws)]
    figure, axes = figure_with_axes(2, 1, width=9.0, height=2.9)
    for axis, (key, factor, name) in zip(
        axes[:, 0],
        (("rms_x_top_m", 1e3, "rms top displacement [mm]"), ("rms_a1_m_s2", 1.0, "rms acceleration, floor 1 [m/s²]")),
        strict=True,
    ):
        width = 0.8 / len(shown)
        for place, when in enumerate(shown):
            heights = [factor * item.get(when, {}).get(key, np.nan) for item in laws]
            at = np.arange(len(laws)) + (place - 0.5 * (len(shown) - 1)) * width
            bars = axis.bar(at, heights, 0.92 * width, color=COLUMNS[when][1], label=COLUMNS[when][0])
            axis.bar_label(
                bars, fmt=lambda value: "" if np.isnan(value) else f"{value:.3g}", fontsize=6, rotation=90, padding=2
            )
        axis.set_xticks(np.arange(len(laws)), [item["law"] for item in laws])
        axis.grid(axis="x", visible=False)
        axis.margins(y=0.14)
        label(axis, "", name)
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=len(shown), fontsize=8, frameon=False)
    return figure


def _plain_number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.3g}"
