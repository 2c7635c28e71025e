"""The page and the figures of `reproduce`: printed and recomputed figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, figure_with_axes, label
from mrpipe.thesis.claim import Claim, Verdict, deviation
from mrpipe.thesis.collect import Ledger
from mrpipe.thesis.entries import KINDS, Kind, tables
from mrpipe.thesis.table51_page import describe as describe_table_5_1
from mrpipe.thesis.table51_page import markdown as table_5_1_markdown
from mrpipe.words import in_percent

VERDICTS: tuple[Verdict, ...] = ("holds", "differs", "cannot-be-recomputed")
_SMALLEST = 1e-7
_LARGEST = 1e2
_TITLES: dict[Kind, str] = {
    "table": "Numbers of the result tables",
    "printed": "Other figures that the thesis prints",
    "finding": "Statements of the thesis",
    "check": "Checks of this project (errata page), which the thesis does not print",
}


def shown(value: Any) -> str:
    """Return a number, list or word as a person writes it."""
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    if isinstance(value, list):
        return ", ".join(f"{item:.4g}" for item in value)
    return f"{value:.4g}"


def counts(claims: Sequence[Claim]) -> dict[str, int]:
    """Return how many claims have each verdict."""
    found = Counter(claim.verdict for claim in claims)
    return {verdict: found.get(verdict, 0) for verdict in VERDICTS}


def counts_by_kind(claims: Sequence[Claim]) -> dict[str, dict[str, int]]:
    """Return kind -> verdict -> count, with the number of claims as `all`."""
    result: dict[str, dict[str, int]] = {}
    for kind in KINDS:
        chosen = [claim for claim in claims if claim.entry.kind == kind]
        result[kind] = {"all": len(chosen), **counts(chosen)}
    return result


def counts_by_table(claims: Sequence[Claim]) -> dict[str, dict[str, int]]:
    """Return result table -> verdict -> count, with the count of its numbers as `all`."""
    result = {}
    for name in tables():
        chosen = [claim for claim in claims if claim.entry.table == name]
        if chosen:
            result[name] = {"all": len(chosen), **counts(chosen)}
    return result


def rows(claims: Sequence[Claim]) -> list[dict[str, Any]]:
    """Return a row a claim, as texts."""
    return [
        {
            "id": claim.id,
            "kind": claim.entry.kind,
            "what": claim.entry.what,
            "printed in": claim.entry.place,
            "printed": shown(claim.printed),
            "recomputed": shown(claim.recomputed),
            "tolerance": ""
            if claim.entry.tolerance is None
            else in_percent(claim.entry.tolerance, digits=3, exact=True),
            "verdict": claim.verdict,
            "by": claim.by,
            "why": claim.why,
        }
        for claim in claims
    ]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _lines(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    """Return a table as lines of Markdown."""
    text = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return [*text, *("| " + " | ".join(_cell(str(cell)) for cell in row) + " |" for row in body), ""]


def _grid(name: str, claims: Sequence[Claim]) -> list[str]:
    """Return one result table: printed / recomputed in every cell, marked where they agree."""
    content = tables()[name]
    known = {(claim.entry.column, claim.entry.row, claim.id.partition("-")[0]): claim for claim in claims}
    lines = [f"### {name} ({content['place']})", ""]
    for part in content["parts"]:
        head = ["index", *content["columns"]]
        body = []
        for row, entry in part["rows"].items():
            cells = [f"{entry['what']} [{entry['unit']}]"]
            for column in content["columns"]:
                claim = known[(column, row, part["id"].partition("-")[0])]
                mark = {"holds": " (holds)", "differs": ""}.get(claim.verdict, "")
                cells.append(f"{shown(claim.printed)} / {shown(claim.recomputed)}{mark}")
            body.append(cells)
        lines += [f"{part['name']}; each cell: printed / recomputed.", "", *_lines(head, body)]
    for text in dict.fromkeys(claim.by for claim in claims if claim.by):
        lines.append(f"- Recomputed by: {text}.")
    for text in dict.fromkeys(claim.entry.reason for claim in claims if claim.verdict == "differs"):
        lines.append(f"- Where they differ: {text}.")
    for text in dict.fromkeys(claim.why for claim in claims if claim.verdict == "cannot-be-recomputed"):
        lines.append(f"- Not recomputed: {text}.")
    return [*lines, ""]


def markdown(ledger: Ledger) -> str:
    """Return the page `reproduce.md`: counts, result tables, statements, other figures, checks."""
    claims = ledger.claims
    by_table, by_kind = counts_by_table(claims), counts_by_kind(claims)
    lines = [
        "# The thesis and this run",
        "",
        "A recomputed value comes from a computation that could have disagreed. A number that sets a condition of the "
        "computation has no verdict. Printed figures and the checks of this project are kept apart.",
        "",
        *_lines(
            ["kind", "entries", *VERDICTS],
            [[_TITLES[kind], *(str(value) for value in by_kind[kind].values())] for kind in KINDS],
        ),
        *_lines(
            ["result table", "numbers", *VERDICTS],
            [[name, *(str(value) for value in found.values())] for name, found in by_table.items()],
        ),
        f"## {_TITLES['table']}",
        "",
    ]
    for name in by_table:
        lines += _grid(name, [claim for claim in claims if claim.entry.table == name])
    if ledger.cases:
        lines += table_5_1_markdown(ledger.cases)
    for kind in KINDS[1:]:
        chosen = [claim for claim in claims if claim.entry.kind == kind]
        if not chosen:
            continue
        head = ("id", "what", "printed in", "printed", "recomputed", "tolerance", "verdict", "by", "why")
        lines += [f"## {_TITLES[kind]}", "", *_lines(head, [[row[key] for key in head] for row in rows(chosen)])]
    return "\n".join(lines)


def deviations(claims: Sequence[Claim]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the largest relative deviation of each claim, shape (claims,); NaN where there is no number to compare."""
    return np.array(
        [
            deviation(claim.entry.printed, claim.recomputed)
            if claim.entry.tolerance is not None and claim.recomputed is not None
            else np.nan
            for claim in claims
        ]
    )


def deviation_figure(claims: Sequence[Claim]) -> Figure:
    """Draw the deviation of every number that was recomputed, by verdict, and its tolerance."""
    chosen = [claim for claim in claims if claim.entry.tolerance is not None and claim.recomputed is not None]
    values = np.clip(deviations(chosen), _SMALLEST, _LARGEST)
    figure, axes = figure_with_axes(1, 1, height=max(3.0, 0.16 * len(chosen)))
    axis = axes[0, 0]
    place = np.arange(len(chosen))
    colours = [COLOURS[2] if claim.verdict == "holds" else COLOURS[1] for claim in chosen]
    axis.barh(place, values, left=_SMALLEST, color=colours, height=0.7)
    marks = np.clip([claim.entry.tolerance or 0.0 for claim in chosen], _SMALLEST, _LARGEST)
    axis.plot(marks, place, "k|", markersize=6)
    axis.set_xscale("log")
    axis.set_xlim(_SMALLEST, _LARGEST)
    axis.set_yticks(place, [claim.id for claim in chosen], fontsize=5)
    axis.invert_yaxis()
    label(axis, "largest relative deviation (mark: tolerance)", "", "green: holds, red: differs")
    return figure


def describe(sink: Sink, ledger: Ledger) -> None:
    """Write the section of the report."""
    claims = ledger.claims
    by_kind = counts_by_kind(claims)
    numbers = by_kind["table"]
    findings = by_kind["finding"]
    sink.text(
        f"Of {numbers['all']} numbers of the result tables, {numbers['holds'] + numbers['differs']} were recomputed: "
        f"{numbers['holds']} agree within their tolerance, {numbers['differs']} differ. Of {findings['all']} "
        f"statements {findings['holds']} hold, {findings['differs']} do not."
    )
    sink.table("tables", _count_frame(counts_by_table(claims)), "Result tables of the thesis.")
    for kind in KINDS:
        chosen = [claim for claim in claims if claim.entry.kind == kind]
        if chosen:
            sink.table(f"{kind}-claims", pd.DataFrame(rows(chosen)), f"{_TITLES[kind]}.")
    sink.figure("deviations", deviation_figure(claims), "Deviation of each recomputed number.")
    if ledger.cases:
        describe_table_5_1(sink, ledger.cases)


def _count_frame(found: dict[str, dict[str, int]]) -> pd.DataFrame:
    return pd.DataFrame([{"table": name, **values} for name, values in found.items()])
