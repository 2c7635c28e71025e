"""Figures that lay the results of two runs over each other, and the page or folder that holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mrpipe.artifacts import atomic_path, atomic_write_text
from mrpipe.reporting.compare import KeptRun
from mrpipe.reporting.facts import LAW_STAGE
from mrpipe.reporting.style import AFTER, MODEL, as_svg, figure_with_axes, label
from mrpipe.words import number

_COLOURS = (AFTER, MODEL)
_DATA_KEYS = ("campaign", "path", "sha256")
_COLUMNS = {
    "settings": ["setting", "first", "second", "stages"],
    "data": ["input", *(f"{run} {key}" for run in ("first", "second") for key in _DATA_KEYS)],
    "results": ["stage", "key", "first", "second", "relative_difference", "present"],
}
Values = dict[str, float]


@dataclass(frozen=True)
class Overlay:
    """One figure with the values of both runs.

    Attributes
    ----------
    name
        Name of its file.
    caption
        Caption of the figure.
    figure
        The figure.
    """

    name: str
    caption: str
    figure: Figure


def overlays(first: KeptRun, second: KeptRun) -> list[Overlay]:
    """Return the figures for which both runs have values: laws, tracing, forms of the damper, frame."""
    made = []
    for name, (read, axis_label, caption) in _PANELS.items():
        pair = read(first), read(second)
        if pair[0] and pair[1]:
            made.append(Overlay(name, caption, _bars(pair, run_names(first, second), axis_label)))
    return made


def run_names(first: KeptRun, second: KeptRun) -> tuple[str, str]:
    """Return the names of the runs in legends: those of the directories, or the paths where the names are equal."""
    names = first.directory.resolve().name, second.directory.resolve().name
    return names if names[0] != names[1] else (str(first.directory), str(second.directory))


def write_folder(directory: Path, content: Mapping[str, Any], figures: Sequence[Overlay]) -> list[Path]:
    """Write each figure as SVG and each table as CSV; return the files."""
    written = []
    for item in figures:
        path = directory / f"{item.name}.svg"
        atomic_write_text(path, f'<?xml version="1.0" encoding="utf-8"?>\n{as_svg(item.figure)}')
        written.append(path)
    for name, (_, frame) in _tables(content).items():
        with atomic_path(directory / f"{name}.csv") as temporary:
            frame.to_csv(temporary, index=False)
        written.append(directory / f"{name}.csv")
    return written


def write_page(path: Path, content: Mapping[str, Any], figures: Sequence[Overlay]) -> list[Path]:
    """Write one HTML file with the figures and tables, which opens offline; return it in a list."""
    from jinja2 import Environment, PackageLoader
    from markupsafe import Markup

    environment = Environment(loader=PackageLoader("mrpipe.reporting", "templates"), autoescape=True, trim_blocks=True)
    tables = [
        {"title": title, "rows": len(frame), "html": Markup(_readable(frame).to_html(index=False, border=0))}
        for title, frame in _tables(content).values()
    ]
    drawings = [{"svg": Markup(as_svg(item.figure)), "caption": item.caption} for item in figures]
    page = environment.get_template("compare.html").render(
        runs=content["runs"], verdicts=content["verdicts"], figures=drawings, tables=tables, stages=content["stages"]
    )
    atomic_write_text(path, page)
    return [path]


def _readable(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a table for a reader: six digits, also of very small numbers, and `-` for what one run lacks."""

    def shown(value: Any) -> str:
        if isinstance(value, float):
            return "-" if np.isnan(value) else f"{value:.6g}"
        return "-" if value is None else str(value)

    return frame.map(shown).rename(columns={"stages": "read by", "relative_difference": "change (relative)"})


def _tables(content: Mapping[str, Any]) -> dict[str, tuple[str, pd.DataFrame]]:
    """Return name -> title and table of the settings, the data and the results that differ."""
    titles = {"settings": "Settings that differ", "data": "Data that differ", "results": "Results that differ"}
    rows = {
        "settings": [{**row, "stages": ", ".join(row["stages"])} for row in content["settings"]],
        "data": [
            {"input": row["input"]}
            | {f"{run} {key}": (row[run] or {}).get(key) for run in ("first", "second") for key in _DATA_KEYS}
            for row in content["data"]
        ],
        "results": content["results"],
    }
    return {
        name: (title, pd.DataFrame(rows[name], columns=_COLUMNS[name], dtype=object)) for name, title in titles.items()
    }


# --- what is drawn ---------------------------------------------------------------------------------------------------
def _top_displacement(run: KeptRun) -> Values:
    """Return law -> RMS displacement of the top floor [mm]."""
    return {
        name.removeprefix(LAW_STAGE): 1e3 * value
        for name, stage in run.built.items()
        if name.startswith(LAW_STAGE) and (value := stage.summary.get("rms_x_top_m")) is not None
    }


def _tracing(run: KeptRun) -> Values:
    """Return the NRMSE of the validation tests before and after tracing, with its two bounds."""
    found = _summary(run, "close-loop")
    values = {
        "before": (found.get("before") or {}).get("nrmse"),
        "after": (found.get("after") or {}).get("nrmse"),
        "flexible model": (found.get("ceiling") or {}).get("nrmse"),
        "noise floor": found.get("noise_floor_nrmse"),
    }
    return {name: value for name, value in values.items() if value is not None}


def _damper_forms(run: KeptRun) -> Values:
    """Return base form -> NRMSE of the validation tests."""
    rows = _summary(run, "identify-damper").get("comparison") or []
    return {row["form"]: row["validation_nrmse"] for row in rows if row.get("validation_nrmse") is not None}


def _networks(run: KeptRun) -> Values:
    """Return network -> NRMSE of the validation tests."""
    names = {"forward": "train-forward", "inverse": "train-inverse"}
    values = {name: _summary(run, stage).get("validation_nrmse") for name, stage in names.items()}
    return {name: value for name, value in values.items() if value is not None}


def _frequencies(run: KeptRun) -> Values:
    """Return mode -> natural frequency [Hz]."""
    found = _summary(run, "identify-frame").get("frequencies_hz") or []
    return {f"mode {place}": value for place, value in enumerate(found, 1) if value is not None}


def _peaks(run: KeptRun) -> Values:
    """Return law -> largest RMS displacement of the top floor over the frequency band of the design [mm]."""
    laws = _summary(run, "design").get("laws") or {}
    return {
        law: 1e3 * entry["peak_rms_x_top_m"]
        for law, entry in laws.items()
        if isinstance(entry, Mapping) and entry.get("peak_rms_x_top_m") is not None
    }


_PANELS = {
    "laws": (_top_displacement, "rms top displacement [mm]", "RMS displacement of the top floor by control law."),
    "tracing": (_tracing, "NRMSE", "Error on the validation tests before and after tracing, and its lower bounds."),
    "damper-forms": (_damper_forms, "NRMSE", "Error of the fitted damper models on the validation tests by base form."),
    "networks": (_networks, "NRMSE", "Error of the networks on the validation tests."),
    "frequencies": (_frequencies, "natural frequency [Hz]", "Natural frequencies of the identified structure."),
    "design": (_peaks, "peak rms top displacement [mm]", "Largest RMS displacement of the top floor over frequency."),
}
"""Name of the figure -> function that reads its values, label of the axis, caption."""


def _summary(run: KeptRun, stage: str) -> Mapping[str, Any]:
    return run.built[stage].summary if stage in run.built else {}


def _bars(pair: tuple[Values, Values], names: tuple[str, str], axis_label: str) -> Figure:
    """Draw the values of two runs as bars next to each other; an entry of one run only has one bar."""
    entries = list(dict.fromkeys([*pair[0], *pair[1]]))
    figure, axes = figure_with_axes(width=max(6.0, 1.1 * len(entries)))
    axis = axes[0, 0]
    for place, (values, name) in enumerate(zip(pair, names, strict=True)):
        at = np.arange(len(entries)) + 0.4 * (place - 0.5)
        heights = [values.get(entry, np.nan) for entry in entries]
        bars = axis.bar(at, heights, 0.37, color=_COLOURS[place], label=name)
        texts = ["" if np.isnan(value) else number(value) for value in heights]
        axis.bar_label(bars, texts, fontsize=6, padding=2)
    axis.set_xticks(np.arange(len(entries)), entries, rotation=30 if len(entries) > 8 else 0)
    axis.grid(axis="x", visible=False)
    axis.margins(y=0.14)
    label(axis, "", axis_label)
    figure.legend(loc="outside upper center", ncols=2, fontsize=8, frameon=False)
    return figure
