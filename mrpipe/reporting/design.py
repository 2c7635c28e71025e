"""Section of the report on the design of the control law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from mrpipe.law_design.run import Result
from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, figure_with_axes, label


def describe(sink: Sink, result: Result, summary: Mapping[str, Any]) -> None:
    """Write the section of the stage `design`.

    Parameters
    ----------
    sink
        Of the report.
    result, summary
        What was found, and the same as JSON.
    """
    sink.text(in_plain_words(summary))
    sink.table("laws", laws_table(summary), "Best gains of every law, the largest responses and the calibrated gains.")
    sink.figure("curves", curves_figure(result), "Response over frequency of each law at its best gains.")
    front = pd.DataFrame(
        [
            {**{k: v for k, v in point.items() if k != "gains"}, "gains": _words(point["gains"])}
            for point in summary["pareto"]
        ]
    )
    sink.table("pareto", front, "Designs that no other design beats in both top displacement and top acceleration.")


def in_plain_words(summary: Mapping[str, Any]) -> str:
    """Return the conclusion in a few sentences."""
    best = summary["laws"][summary["best"]]
    gains = _words(best["gains"]) or "no gains"
    sentences = [
        f"The best law is {summary['best']} ({gains}): over the frequency band and all amplitudes its largest RMS top "
        f"displacement is {1e3 * best['peak_rms_x_top_m']:.1f} mm, at {best['resonance_rad_s']:.2f} rad/s."
    ]
    sentences.append(f"The objective is {summary['objective']}; it is {best['objective']:.3f}.")
    if best["improvement"] > 0.005:
        sentences.append(f"This is {best['improvement']:.0%} better than at its calibrated gains.")
    for name, excess in best["exceeds_limits"].items():
        sentences.append(f"No design keeps all limits: this one exceeds that of {name} by {excess:.1%}.")
    others = sorted(
        ((name, item) for name, item in summary["laws"].items() if name != summary["best"]),
        key=lambda entry: float(entry[1]["objective"]),
    )
    if others:
        name, item = others[0]
        sentences.append(
            f"The second best law is {name}; its objective is {item['objective'] / best['objective'] - 1.0:.0%} larger."
        )
    sentences.append(_confirmed(summary["confirmation"]))
    if "before_tracing" in summary:
        sentences.append(_against_untraced(summary["before_tracing"]))
    uncertainty = summary.get("uncertainty")
    if uncertainty and uncertainty["draws"] == 1:
        sentences.append("Structure and damper are given without uncertainty, so that no others are drawn.")
    elif uncertainty:
        sentences.append(
            f"In {uncertainty['draws']} structures and dampers drawn from their uncertainty, {summary['best']} is the "
            f"best law with probability {best['probability_best']:.2f}; its mean regret is {uncertainty['regret']:.1%}."
        )
        if uncertainty["sensitivities"] and best["probability_best"] < 0.95:
            first = uncertainty["sensitivities"][0]
            sentences.append(
                f"The lead depends most on {first['parameter']}. The test that determines it: {first['test']}."
            )
    return " ".join(sentences)


def _confirmed(found: Mapping[str, Any]) -> str:
    design, calibrated = found["design"], found["calibrated"]
    return (
        f"At half the step of the simulation and with other sensor noise, the best design of all ({design['law']}, "
        f"{_words(design['gains']) or 'no gains'}) has a largest RMS top displacement of "
        f"{1e3 * design['peak_rms_x_top_m']:.1f} mm and top acceleration of {design['peak_rms_a_top_m_s2']:.2f} m/s^2; "
        f"the best law at its calibrated gains ({calibrated['law']}) has {1e3 * calibrated['peak_rms_x_top_m']:.1f} mm "
        f"and {calibrated['peak_rms_a_top_m_s2']:.2f} m/s^2. The design is {found['improvement_x_top']:.1%} better in "
        f"displacement and {found['improvement_a_top']:.1%} in acceleration."
    )


def _against_untraced(found: Mapping[str, Any]) -> str:
    design, with_traced = found["design"], found["with_traced_damper"]
    return (
        f"For the damper before the tracing the best design would be {design['law']} "
        f"({_words(design['gains']) or 'no gains'}). With the traced damper in the loop that design has a largest RMS "
        f"top displacement of {1e3 * with_traced['peak_rms_x_top_m']:.1f} mm; its objective is "
        f"{found['regret']:.1%} above that of the best design for the traced damper."
    )


def laws_table(summary: Mapping[str, Any]) -> pd.DataFrame:
    """Return a row for each law, best first."""
    rows = []
    for name, item in summary["laws"].items():
        for key, entry in ((name, item), (f"{name}, unrestricted", item.get("unrestricted"))):
            if entry is not None:
                rows.append(
                    {
                        "law": key,
                        "gains": _words(entry["gains"]),
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


_UNITS = {"c_n_s_m": ("c", "N s/m"), "k_n_m": ("k", "N/m"), "alpha_n_m": ("alpha", "N/m")}


def _words(gains: Mapping[str, float]) -> str:
    parts = []
    for name, value in gains.items():
        symbol, unit = _UNITS.get(name, (name, ""))
        parts.append(f"{symbol} = {value:.4g} {unit}".strip())
    return ", ".join(parts)
