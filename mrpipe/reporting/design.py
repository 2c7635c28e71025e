"""Section of the report on the design of the control law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from mrpipe.law_design.run import Result
from mrpipe.reporting.design_words import gains_in_words, in_plain_words
from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, figure_with_axes, label


def describe(sink: Sink, result: Result, summary: Mapping[str, Any]) -> None:
    """Write the section of the stage `design`.

    Parameters
    ----------
    sink
        Part of the report that is written.
    result, summary
        Result of the design, and the same as JSON.
    """
    sink.text(in_plain_words(summary))
    sink.table("laws", laws_table(summary), "Best gains of every law, the largest responses and the calibrated gains.")
    sink.figure("curves", curves_figure(result), "Response over frequency of each law at its best gains.")
    front = pd.DataFrame(
        [
            {**{k: v for k, v in point.items() if k != "gains"}, "gains": gains_in_words(point["gains"])}
            for point in summary["pareto"]
        ]
    )
    sink.table("pareto", front, "Designs that no other design beats in both top displacement and top acceleration.")


def laws_table(summary: Mapping[str, Any]) -> pd.DataFrame:
    """Return a row for each law, best first."""
    rows = []
    for name, item in summary["laws"].items():
        for key, entry in ((name, item), (f"{name}, unrestricted", item.get("unrestricted"))):
            if entry is not None:
                rows.append(
                    {
                        "law": key,
                        "gains": gains_in_words(entry["gains"]),
                        "objective": entry["objective"],
                        "peak rms x_top [mm]": 1e3 * entry["peak_rms_x_top_m"],
                        "peak rms a_top [m/s²]": entry["peak_rms_a_top_m_s2"],
                        "peak rms a1 [m/s²]": entry["peak_rms_a1_m_s2"],
                        "resonance [rad/s]": entry["resonance_rad_s"],
                        "objective, calibrated gains": entry["calibrated"]["objective"],
                        "probability best": item.get("probability_best") if key == name else None,
                    }
                )
    return pd.DataFrame(rows).sort_values("objective", ignore_index=True)


def curves_figure(result: Result) -> Figure:
    """Return top displacement and top acceleration over frequency at the largest amplitude, one line per law."""
    figure, axes = figure_with_axes(1, 2, height=3.2)
    order = sorted(result.designed.values(), key=lambda found: found.best.value)
    for axis, quantity, scale, name in zip(
        axes[0],
        ("rms_x_top_m", "rms_a_top_m_s2"),
        (1e3, 1.0),
        ("RMS top displacement [mm]", "RMS top acceleration [m/s²]"),
        strict=True,
    ):
        for number, found in enumerate(order):
            curve = found.best.curves[-1]
            axis.plot(
                curve.frequency_rad_s,
                scale * curve.column(quantity),
                color=COLOURS[number % len(COLOURS)],
                linestyle="-" if number < len(COLOURS) else "--",
                label=found.entry.label,
                linewidth=1.8 if number == 0 else 1.0,
            )
        axis.set_yscale("log")
        label(axis, "frequency [rad/s]", name)
    axes[0, 1].legend(fontsize=6, ncols=2)
    return figure
