"""The closed loop before and after as a table and as a figure."""

from __future__ import annotations

from collections.abc import Mapping
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


def law_table(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row a law: RMS of the top floor by column, in millimetres, and of the first floor's acceleration."""
    rows = []
    for item in found["laws"]:
        row: dict[str, Any] = {"law": item["law"]}
        for key, unit, factor in (("rms_x_top_m", "mm", 1e3), ("rms_x1_m", "mm", 1e3), ("rms_a1_m_s2", "m/s²", 1.0)):
            name = key.removesuffix("_m").removesuffix("_m_s2").removesuffix("_s2")
            for when in COLUMNS:
                values = item.get(when, {})
                if when in item:
                    row[f"{name} {when} [{unit}]"] = "grows" if "diverged" in values else _scaled(values, key, factor)
        rows.append(row)
    return rows


def _scaled(values: Mapping[str, float], key: str, factor: float) -> float | None:
    return factor * values[key] if key in values else None


def band_table(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row a law: resonance and largest RMS responses over the frequency band, by column."""
    rows = []
    for item in found["over_band"]["laws"]:
        row: dict[str, Any] = {"law": item["law"]}
        for when in COLUMNS:
            values = item.get(when)
            if values is None:
                continue
            grows = "diverged" in values
            row[f"resonance {when} [rad/s]"] = "grows" if grows else values["resonance_rad_s"]
            row[f"largest rms_x_top {when} [mm]"] = "grows" if grows else 1e3 * values["peak_rms_x_top_m"]
            row[f"largest rms_a1 {when} [m/s²]"] = "grows" if grows else values["peak_rms_a1_m_s2"]
        rows.append(row)
    return rows


def response_by_law(found: Mapping[str, Any]) -> Figure:
    """Draw the RMS displacement of the top floor and acceleration of the first by law: measured and predicted."""
    laws = found["laws"]
    shown = [when for when in COLUMNS if any(when in item for item in laws)]
    figure, axes = figure_with_axes(2, 1, width=9.0, height=2.9)
    for axis, (key, factor, name) in zip(
        axes[:, 0],
        (
            ("rms_x_top_m", 1e3, "rms top displacement [mm]"),
            ("rms_a1_m_s2", 1.0, "rms acceleration of floor 1\nrelative to the ground [m/s²]"),
        ),
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
