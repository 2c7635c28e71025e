"""Section of the report: the residual traced to a missing effect, and the model before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.artifacts import FloatArray
from mrpipe.reporting.bench_tracing import (
    MOST_BARS,
    ShownTest,
    candidate_ranking,
    errors_per_test,
    in_plain_words,
    loops_before_and_after,
    residual_location,
    residual_maps,
)
from mrpipe.reporting.closed_loop import band_table, law_table, response_by_law
from mrpipe.reporting.closed_loop_words import in_words
from mrpipe.reporting.headlines import open_questions
from mrpipe.reporting.sink import Sink
from mrpipe.reporting.traced_words import shares_in_words, shown_candidates
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.words import in_percent


@dataclass(frozen=True)
class Traced:
    """Results of `close-loop` on a bench campaign, for the report.

    Attributes
    ----------
    tracing
        The tracing with its models and errors.
    summary
        The summary that the stage prints.
    named_share, least_share
        Share of the residual above which an effect is named, and above which it is considered.
    """

    tracing: Tracing
    summary: Mapping[str, Any]
    named_share: float
    least_share: float


def describe(sink: Sink, result: Traced) -> None:
    """Write the section of `close-loop` of the report."""
    traced, summary = result.tracing, result.summary
    sink.text(in_plain_words(summary))
    _identified(sink, summary)
    _effects(sink, summary)
    for name, reason in summary["untestable"].items():
        sink.text(f"Effect {name} is {reason}.")
    _where(sink, traced, summary)
    _candidates(sink, summary, result.named_share, result.least_share)
    _before_and_after(sink, traced, summary)
    _loop(sink, summary["closed_loop"])
    _next_steps(sink, summary)


def _identified(sink: Sink, summary: Mapping[str, Any]) -> None:
    """Describe the declared damper, and its difference from the one of `identify-damper`."""
    found = summary["base_form"]["identified"]
    if found is None:
        sink.text("There is no fit of identify-damper: every base form began at the starting points of the library.")
        return
    sink.text(
        f"The damper of identify-damper ({found['form']}) misses the force on the same validation samples by "
        f"{in_percent(found['nrmse'], 1)}, the declared model ({summary['model']}) by "
        f"{in_percent(summary['before']['nrmse'], 1)}. {found['why']}"
    )
    rows = [
        {"number": name.replace("_", " "), "identify-damper": item["value"], "before": item["before"]}
        | {"unit": item["unit"]}
        for name, item in found.get("parameters", {}).items()
    ]
    for law in found.get("laws", []):
        for name, key, unit in (("yield force", "yield_force", "n"), ("c0", "c0", "n_s_m")):
            number = f"{name} at drive {law['drive']:.3g}"
            row = {"number": number, "identify-damper": law[f"{key}_{unit}"], "before": law[f"{key}_before_{unit}"]}
            rows.append({**row, "unit": "N" if unit == "n" else "N s/m"})
    if rows:
        caption = "The declared form with the numbers of identify-damper, and with those of the error before."
        sink.table("declared", pd.DataFrame(rows), caption)


def _effects(sink: Sink, summary: Mapping[str, Any]) -> None:

    rows = [
        {
            "effect": effect["name"],
            "form": effect["form"],
            "parameter": name.replace("_", " "),
            "value": entry["value"],
            "from": entry["interval"][0],
            "to": entry["interval"][1],
            "unit": entry["unit"],
        }
        for effect in summary["effects"]
        for name, entry in effect["parameters"].items()
    ]
    if rows:
        sink.table("effects", pd.DataFrame(rows), "Parameters of the effects with their 95 % intervals.")


def _where(sink: Sink, traced: Tracing, summary: Mapping[str, Any]) -> None:
    sink.figure(
        "where",
        residual_location(summary["residual"]["location"]),
        "Location of the residual of the baseline (training tests).",
    )
    base = traced.selection.base
    used = base.problem.root_weight > 0.0
    residual = base.residual[used] / base.problem.root_weight[used]
    states = {name: values[used] for name, values in traced.states.values.items()}
    unit = traced.drive_unit
    drive = f"effective drive [{unit}]"
    maps = [
        ("displacement [mm]", "velocity [mm/s]", 1e3 * states["displacement"], 1e3 * states["velocity"]),
        ("velocity [mm/s]", drive, 1e3 * states["velocity"], states["drive"]),
        _drive_map(states, drive, unit),
        ("time in test [s]", "dissipated work [J]", states["time in test"], states["work"]),
    ]
    sink.figure("maps", residual_maps(maps, residual), "Mean residual of the baseline over pairs of states.")


def _drive_map(states: Mapping[str, FloatArray], drive: str, unit: str) -> tuple[str, str, FloatArray, FloatArray]:
    """Return drive and past drive; or displacement and drive if the drive is constant in every test."""
    past = states["past of drive"]
    if float(np.max(past)) > 0.05 * float(np.max(np.abs(states["drive"]))):
        return drive, f"largest drive so far [{unit}]", states["drive"], past + np.abs(states["drive"])
    return "displacement [mm]", drive, 1e3 * states["displacement"], states["drive"]


def _candidates(sink: Sink, summary: Mapping[str, Any], named_share: float, least_share: float) -> None:
    candidates, of_what = shown_candidates(summary), shares_in_words(summary)
    if not candidates:
        return
    sink.figure(
        "ranking",
        candidate_ranking(candidates, named_share, least_share, f"share {of_what} [1]"),
        f"Share {of_what} that each family of effects recovers if it is added alone and all parameters are fitted "
        "again; NRMSE on the validation tests. A family whose strength is at a bound is not named.",
    )
    rows = [
        {
            "effect": item["name"],
            "form": item["form"],
            "recovered share": item["share"],
            "NRMSE": item["nrmse"],
            "evidence (log-likelihood)": item["evidence"],
            "forms tried": ", ".join(f"{name} {share:.2f}" for name, share in item["forms"].items()),
        }
        for item in candidates
    ]
    sink.table("candidates", pd.DataFrame(rows), "The same as a table, with every form that was tried.")


def _before_and_after(sink: Sink, traced: Tracing, summary: Mapping[str, Any]) -> None:

    validation, rows = traced.validation, summary["tests"]
    errors = {row["name"]: row for row in rows}
    shown = []
    for k in _chosen(validation.names, errors):
        piece = slice(int(validation.starts[k]), int(validation.starts[k + 1]))
        error = errors[validation.names[k]]
        shown.append(
            ShownTest(
                validation.names[k],
                validation.time[piece],
                validation.displacement[piece],
                validation.velocity[piece],
                traced.measured[piece],
                traced.before[piece],
                traced.after[piece],
                error["nrmse_before"],
                error["nrmse_after"],
            )
        )
    if shown:
        sink.figure(
            "loops",
            loops_before_and_after(shown),
            "Validation tests: the one with the largest improvement, one with a medium error, and the one with the "
            "largest error after; a test may be two of these. The models are simulated without the measured force.",
        )
    more = f"; the {MOST_BARS} with the largest errors of {len(rows)}" if len(rows) > MOST_BARS else ""
    sink.figure(
        "errors",
        errors_per_test(rows, summary["noise_floor_nrmse"]),
        f"Error of the validation tests before and after{more}.",
    )
    table = pd.DataFrame(rows).rename(columns={"nrmse_before": "NRMSE before", "nrmse_after": "NRMSE after"})
    sink.table("tests", table, "Error of each validation test.")


def _chosen(names: Sequence[str], errors: Mapping[str, Mapping[str, Any]]) -> list[int]:
    """Return the tests to show: largest improvement, medium error, largest error after."""
    known = [k for k, name in enumerate(names) if name in errors]
    gains = sorted(known, key=lambda k: errors[names[k]]["nrmse_after"] - errors[names[k]]["nrmse_before"])
    left = sorted(known, key=lambda k: errors[names[k]]["nrmse_after"])
    return list(dict.fromkeys([gains[0], left[len(left) // 2], left[-1]])) if known else []


def _loop(sink: Sink, found: Mapping[str, Any]) -> None:
    sink.text(in_words(found))
    if "laws" not in found:
        return
    sink.figure(
        "laws",
        response_by_law(found),
        "Response by control law: measured; predicted by the model without and with the effect, under the controller "
        "that ran; and with the controller renewed for the effect.",
    )
    sink.table("laws", pd.DataFrame(law_table(found)), "The same as a table.")
    low, high = found["over_band"]["band_rad_s"]
    sink.table(
        "laws-over-band",
        pd.DataFrame(band_table(found)),
        f"Every law at its own resonance: the largest responses to harmonic base motion from {low:.3g} to {high:.3g} "
        f"rad/s at {found['over_band']['base_amplitude_m_s2']:.3g} m/s². The laws are ranked by the top displacement.",
    )
    rows = []
    for item in found["tests"]:
        if item["recorded"]:
            row = {"test": item["test"], "law": item["law"]}
            row |= {f"NRMSE of x top {when}": item[when].get("nrmse_x_top") for when in ("before", "after")}
            rows.append(row)
    if rows:
        sink.table("recordings", pd.DataFrame(rows), "Error of the top floor's history in each closed-loop recording.")


def _next_steps(sink: Sink, summary: Mapping[str, Any]) -> None:

    if summary["corrections"]["found"]:
        sink.text(
            "To correct the faults of sensors named above, run `mrpipe prepare --settings "
            f"RUN/{summary['corrections']['file']}` with the same configuration or campaign, where RUN is the run "
            "directory. Later stages need the same option."
        )
    wanted = summary["next_tests"]
    if wanted["made_already"]:
        listed = open_questions(wanted["decides"])
        sink.text(f"Still open, although the tests for it have been made: {listed}. Longer tests or repeats may help.")
    if not wanted["tests"]:
        return
    for item in wanted["decides"]:
        sink.text(f"Open question: {item['decides']}. Tests that would answer it: {', '.join(item['tests'])}.")
    sink.table(
        "next-tests",
        pd.DataFrame(wanted["tests"]).drop(columns="later"),
        f"Tests that would answer the open questions, as listed in {wanted['file']} of the run directory; on the "
        f"virtual rig `mrpipe close-loop --settings {wanted['file']}` records them and traces again.",
    )
