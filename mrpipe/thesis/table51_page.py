"""Tables, text and figure that explain Table 5.1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, figure_with_axes, label
from mrpipe.thesis.bench import LAWS
from mrpipe.thesis.entries import printed_columns
from mrpipe.thesis.table51 import (
    AT_ONE,
    AT_OWN,
    AT_VD,
    PERFECT,
    PLAIN,
    PRINTED_DAMPER,
    TRACED,
    Case,
    log_errors,
    mean_log_error,
)
from mrpipe.words import in_percent

_AXES = {
    "rms_x5_m": ("rms x5 [mm]", 1e3),
    "rms_x1_m": ("rms x1 [mm]", 1e3),
    "rms_a5_m_s2": ("rms a5 [m/s²]", 1.0),
    "rms_a1_m_s2": ("rms a1 [m/s²]", 1.0),
}
_SIMULATED = (f"{PERFECT}, {AT_ONE}", f"{PRINTED_DAMPER}, {AT_ONE}", f"{PLAIN}, {AT_ONE}")
_MEASURED = tuple(f"{damper}, {where}" for damper in (PLAIN, TRACED) for where in (AT_ONE, AT_VD, AT_OWN))
_PARTS = (("T5.1s", "simulated column", _SIMULATED), ("T5.1m", "measured column", _MEASURED))


def value_rows(cases: Mapping[str, Case]) -> list[dict[str, str]]:
    """Return a row for each law and column: printed ones first, then the cases."""
    rows = []
    for law in LAWS:
        for part, name, _ in _PARTS:
            printed = printed_columns("Table 5.1", part)[law]
            rows.append({"law": law, "column": f"thesis, {name}", "at [rad/s]": "", **_shown(printed)})
        for case in cases.values():
            rows.append(
                {"law": law, "column": case.name, "at [rad/s]": f"{case.omega[law]:.2f}"} | _shown(case.values[law])
            )
    return rows


def _shown(values: Mapping[str, float]) -> dict[str, str]:
    return {name: f"{scale * values[row]:.3g}" for row, (name, scale) in _AXES.items()}


def error_rows(cases: Mapping[str, Case]) -> list[dict[str, str]]:
    """Return the mean log error of every case that belongs to a column: by law, and over all 15 numbers."""
    rows = []
    for part, name, chosen in _PARTS:
        for case in (cases[item] for item in chosen if item in cases):
            errors = log_errors(case, part)
            row = {"column": name, "case": case.name}
            row |= {law: f"{np.mean(list(errors[law].values())):.3f}" for law in LAWS}
            rows.append({**row, "all": f"{mean_log_error(case, part):.3f}"})
    return rows


def damping_rows(cases: Mapping[str, Case]) -> list[dict[str, str]]:
    """Return the readings of the free decay: printed, then every case."""
    rows = []
    for law in LAWS:
        for part, name, _ in _PARTS:
            ratio = printed_columns("Table 5.1", part)[law]["damping_ratio"]
            rows.append({"law": law, "column": f"thesis, {name}", "exponential fit": f"{ratio:.3g}"})
        for case in cases.values():
            reading = case.damping[law]
            rows.append(
                {
                    "law": law,
                    "column": case.name,
                    "exponential fit": _ratio(reading.fit),
                    "first half period": _ratio(reading.first_half_period),
                    "energy, first period": _ratio(reading.energy),
                }
            )
    head = ("law", "column", "exponential fit", "first half period", "energy, first period")
    return [{key: row.get(key, "") for key in head} for row in rows]


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def words(cases: Mapping[str, Case]) -> list[str]:
    """Return what the errors say: how much each step explains, and what remains."""
    said = []
    plain = cases[f"{PLAIN}, {AT_ONE}"]
    printed = cases[f"{PRINTED_DAMPER}, {AT_ONE}"]
    ideal = cases[f"{PERFECT}, {AT_ONE}"]
    first, second = mean_log_error(plain, "T5.1s"), mean_log_error(printed, "T5.1s")
    said.append(
        f"Simulated column: the mean log error is {first:.3f} with the {PLAIN}, {second:.3f} with the "
        f"{PRINTED_DAMPER}, whose residual force is small, and {mean_log_error(ideal, 'T5.1s'):.3f} with a {PERFECT}."
    )
    start = mean_log_error(plain, "T5.1m")
    steps = [(name, mean_log_error(cases[name], "T5.1m")) for name in _MEASURED[1:] if name in cases]
    parts = "; ".join(
        f"{name}: {error:.3f} ({in_percent(1.0 - error / start, signed=True)} explained)" for name, error in steps
    )
    said.append(f"Measured column: the mean log error is {start:.3f} for {plain.name}. {parts}.")
    worst = max(
        (
            (value, law, row)
            for law, rows in log_errors(cases[steps[-1][0]], "T5.1m").items()
            for row, value in rows.items()
        )
    )
    said.append(f"The largest part that remains is {worst[2]} of {worst[1]}: a factor of {np.exp(worst[0]):.2f}.")
    return said


def figure(cases: Mapping[str, Case]) -> Figure:
    """Draw both printed columns and the cases: a row for each column of Table 5.1, a panel for each index."""
    made, axes = figure_with_axes(2, 4, height=3.2, width=14.0)
    for line, (part, name, chosen) in enumerate(_PARTS):
        printed = printed_columns("Table 5.1", part)
        shown = [item for item in chosen if item in cases]
        width = 0.8 / (len(shown) + 1)
        place = np.arange(len(LAWS))
        for column, (row, (text, scale)) in enumerate(_AXES.items()):
            axis = axes[line, column]
            columns: Sequence[tuple[str, list[float]]] = [
                (f"thesis, {name}", [scale * printed[law][row] for law in LAWS]),
                *((item, [scale * cases[item].values[law][row] for law in LAWS]) for item in shown),
            ]
            for number, (title, values) in enumerate(columns):
                colour = "0.25" if number == 0 else COLOURS[number - 1]
                axis.bar(place + (number - 0.5 * len(shown)) * width, values, width, label=title, color=colour)
            axis.set_xticks(place, LAWS)
            label(axis, "", text, name if column == 0 else "")
        handles, titles = axes[line, 0].get_legend_handles_labels()
        axes[line, 3].legend(handles, titles, fontsize=6, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return made


def markdown(cases: Mapping[str, Case]) -> list[str]:
    """Return the section of the page, as lines."""
    lines = ["### Table 5.1 explained", "", *words(cases), ""]
    for title, rows in (
        ("Values", value_rows(cases)),
        ("Mean log errors against the printed columns", error_rows(cases)),
        ("Free-decay damping ratios", damping_rows(cases)),
    ):
        head = list(dict.fromkeys(key for row in rows for key in row))
        lines += [f"{title}:", "", "| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
        lines += ["| " + " | ".join(row.get(key, "") for key in head) + " |" for row in rows]
        lines.append("")
    return lines


def describe(sink: Sink, cases: Mapping[str, Case]) -> None:
    """Write the part of the report."""
    for text in words(cases):
        sink.text(text)
    sink.figure("table-5-1", figure(cases), "Table 5.1: both printed columns and the closed loop.")
    sink.table("table-5-1-values", pd.DataFrame(value_rows(cases)), "Table 5.1 and the closed loop.")
    sink.table("table-5-1-errors", pd.DataFrame(error_rows(cases)), "Mean log errors against the printed columns.")
    sink.table("table-5-1-damping", pd.DataFrame(damping_rows(cases)), "Free-decay damping ratios.")
