"""Tables of the sections before the appendix; cells are texts as the report shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.dampers.model import DamperModel
from mrpipe.reporting.facts import RunFacts
from mrpipe.reporting.front import laws as law_facts
from mrpipe.reporting.traced_words import (
    determined,
    exchanged_form,
    later_effects,
    leading_first,
    proper_effects,
    shares_in_words,
    shown_candidates,
    uncertainty,
)
from mrpipe.reporting.words import plain, quantity, readable_unit
from mrpipe.words import listed, number

MOST_RIVALS = 8
"""Largest number of candidates in a table; those that are named are shown in addition."""

_COLUMNS = {
    "name": ("test", None),
    "role": ("role", None),
    "motion": ("motion", None),
    "amplitude_m": ("amplitude [mm]", 1e3),
    "frequency_hz": ("frequency [Hz]", 1.0),
    "duration_s": ("duration [s]", 1.0),
    "pause_s": ("pause [s]", 1.0),
    "current": ("drive", None),
    "current_a": ("largest drive [A]", 1.0),
    "drive_v": ("largest drive [V]", 1.0),
}
"""Key of a test of next-tests.yaml -> heading, and factor of the number."""


def rivals(loop: Mapping[str, Any]) -> pd.DataFrame:
    """Return the candidates of the tracing, best first, and the named effects that were not fitted alone."""
    share, error = f"share {shares_in_words(loop)} [%]", "error with it [%]"
    named = {effect["name"]: effect for effect in proper_effects(loop)}
    shown = [item for place, item in enumerate(shown_candidates(loop)) if place < MOST_RIVALS or item["name"] in named]
    rows = [
        {
            "effect": item["name"],
            "form": item.get("form", ""),
            share: f"{100.0 * max(float(item.get('share') or 0.0), 0.0):.1f}",
            error: number(100.0 * item["nrmse"]) if item.get("nrmse") is not None else "-",
        }
        for item in shown
    ]
    # the candidates are those of the first round; an effect that only a later round found was never fitted alone
    later = [named[name] for name in later_effects(loop)]
    if not rows or not later:
        return pd.DataFrame(rows)
    first = listed([name for name in named if name not in later_effects(loop)])
    note = f"found in addition to {first}" if first else "not fitted alone"
    rows = [{**row, "note": ""} for row in rows]
    rows += [
        {"effect": effect["name"], "form": effect.get("form", ""), share: "-", error: "-", "note": note}
        for effect in later
    ]
    return pd.DataFrame(rows)


def forms(loop: Mapping[str, Any]) -> pd.DataFrame:
    """Return the base forms that were tried, best first."""
    found = loop.get("base_form") or {}
    errors, taken = found.get("nrmse") or {}, exchanged_form(loop)
    notes = {taken: "in the final model", found.get("declared"): "declared"} if taken else {}
    rows = [
        {"base form": name, "error [%]": number(100.0 * value)} | ({"note": notes.get(name, "")} if notes else {})
        for name, value in sorted(errors.items(), key=lambda item: item[1] if item[1] is not None else np.inf)
        if value is not None
    ]
    return pd.DataFrame(rows if len(rows) > 1 else [])


def parameters(parameters: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Return the parameters of the damper model with their standard errors."""
    rows = []
    for name, entry in parameters.items():
        error = entry.get("standard_error")
        rows.append(
            {
                "parameter": plain(name),
                "value": number(entry["value"], 4),
                "±": number(error, 2) if error is not None else "fixed",
                "unit": readable_unit(entry["unit"]),
                "note": "at its bound" if entry.get("at_bound") else "",
            }
        )
    table = pd.DataFrame(rows)
    return table if rows and any(table["note"]) else table.drop(columns="note", errors="ignore")


def traced_parameters(model: DamperModel) -> pd.DataFrame:
    """Return the parameters of a damper model: those of its base form, then those of each effect."""
    found = [(model.form, name, value, model.unit(name)) for name, value in model.parameters.items()]
    for item in model.effects:
        part = f"{item.name}{' (in the sensors)' if item.sensor else ''}"
        found += [(part, name, value, item.units.get(name, "1")) for name, value in item.values.items()]
    return pd.DataFrame(
        [
            {"part": part, "parameter": plain(name), "value": number(value, 4), "unit": readable_unit(unit)}
            for part, name, value, unit in found
        ]
    )


def effects(effects: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return the parameters of the named effects with their intervals."""
    rows = []
    for effect in effects:
        for name, entry in leading_first(effect):
            low, high = uncertainty(entry)
            rows.append(
                {
                    "effect": effect["name"] + (f" at {effect['place']}" if effect.get("place") else ""),
                    "parameter": plain(name),
                    "value": number(entry["value"], 3),
                    "from": _end_of_interval(low, high),
                    "to": number(high, 3) if determined(low, high) and low < high else "",
                    "unit": readable_unit(entry["unit"]),
                    "confidence": number(effect["confidence"], 2),
                }
            )
    return pd.DataFrame(rows)


def _end_of_interval(low: float, high: float) -> str:
    """Return the lower end of an interval; one without width is none."""
    if low == high:
        return "-"
    return number(low, 3) if determined(low, high) else "not determined"


def laws(facts: RunFacts, runs: Sequence[law_facts.LawRun]) -> pd.DataFrame:
    """Return every law of the comparison, with gains and response."""
    bare = next((run for run in runs if run.law == law_facts.UNCONTROLLED), None)
    gains = facts.summary("calibrate").get("laws") or {}
    rows = []
    for run in runs:
        entry = gains.get(run.law) or {}
        shown = [
            f"{name} = {quantity(entry[key], unit)}"
            for name, key, unit in (("c", "c_n_s_m", "N s/m"), ("k", "k_n_m", "N/m"), ("α", "alpha_n_m", "N/m"))
            if entry.get(key)
        ]
        change = 100.0 * (run.rms_top_m / bare.rms_top_m - 1.0) if bare and run is not bare else float("nan")
        rows.append(
            {
                "law": run.law,
                "x top [mm]": number(1e3 * run.rms_top_m),
                "change [%]": number(change),
                "x floor 1 [mm]": number(1e3 * run.rms_first_m),
                "a top [m/s²]": number(run.rms_a_top_m_s2),
                "a floor 1 [m/s²]": number(run.rms_a_first_m_s2),
                "force [N]": number(run.peak_force_n),
                "damping [%]": number(100.0 * run.damping_ratio, 2),
                "extrapolated [%]": number(100.0 * run.outside_share, 2),
                "gains": ", ".join(shown),
            }
        )
    return pd.DataFrame(rows)


def wanted_tests(tests: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return tests to be made, with the headings and units that people use."""
    rows = []
    for test in tests:
        row = {}
        for key, (heading, factor) in _COLUMNS.items():
            if key in test:
                row[heading] = number(factor * test[key]) if factor else str(test[key])
        rows.append(row | {plain(key): str(value) for key, value in test.items() if key not in {*_COLUMNS, "later"}})
    return pd.DataFrame(rows).fillna("-")
