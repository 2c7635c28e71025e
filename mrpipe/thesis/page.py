"""The page and the figure of `reproduce`: printed figures compared with the recomputed ones."""

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

VERDICTS: tuple[Verdict, ...] = ("holds", "differs", "cannot-be-recomputed")
_SMALLEST = 1e-7
_LARGEST = 1e2


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


def rows(claims: Sequence[Claim]) -> list[dict[str, Any]]:
    """Return a row a claim, as texts."""
    return [
        {
            "id": claim.id,
            "chapter": claim.chapter,
            "what": claim.what,
            "printed": shown(claim.printed),
            "recomputed": shown(claim.recomputed),
            "tolerance": "" if claim.tolerance is None else f"{100 * claim.tolerance:.3g} %",
            "verdict": claim.verdict,
            "why": claim.why,
        }
        for claim in claims
    ]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def markdown(claims: Sequence[Claim]) -> str:
    """Return the page `reproduce.md`: what differs first, then a table a chapter."""
    number = counts(claims)
    summary = ", ".join(f"{number[verdict]} {verdict.replace('-', ' ')}" for verdict in VERDICTS)
    lines = [
        "# The thesis' printed figures and ours",
        "",
        f"{len(claims)} figures: {summary}. Ids that begin with A and a number are rows of the list of errata "
        "(section A), B its section B, C and D those sections; T are tables and equations of the thesis, "
        "P4 that paper.",
        "",
    ]
    for chapter in sorted({claim.chapter for claim in claims}):
        lines += [
            f"## Chapter {chapter}",
            "",
            "| id | what | printed | recomputed | within | verdict | why |",
            "| --- | --- | --- | --- | --- | --- | --- |",
        ]
        for row in rows([claim for claim in claims if claim.chapter == chapter]):
            cells = (row[key] for key in ("id", "what", "printed", "recomputed", "tolerance", "verdict", "why"))
            lines.append("| " + " | ".join(_cell(str(cell)) for cell in cells) + " |")
        lines.append("")
    return "\n".join(lines)


def deviations(claims: Sequence[Claim]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the largest relative deviation of each claim, shape (claims,); NaN without a number to compare."""
    return np.array(
        [deviation(claim.printed, claim.recomputed) if claim.tolerance is not None else np.nan for claim in claims]
    )


def deviation_figure(claims: Sequence[Claim]) -> Figure:
    """Draw the deviation and the tolerance of every recomputed figure, coloured by verdict."""
    chosen = [claim for claim in claims if claim.tolerance is not None]
    values = np.clip(deviations(chosen), _SMALLEST, _LARGEST)
    figure, axes = figure_with_axes(1, 1, height=max(3.0, 0.16 * len(chosen)))
    axis = axes[0, 0]
    place = np.arange(len(chosen))
    colours = [COLOURS[2] if claim.verdict == "holds" else COLOURS[1] for claim in chosen]
    axis.barh(place, values, left=_SMALLEST, color=colours, height=0.7)
    axis.plot(np.clip([claim.tolerance or 0.0 for claim in chosen], _SMALLEST, _LARGEST), place, "k|", markersize=6)
    axis.set_xscale("log")
    axis.set_xlim(_SMALLEST, _LARGEST)
    axis.set_yticks(place, [claim.id for claim in chosen], fontsize=6)
    axis.invert_yaxis()
    label(axis, "largest relative deviation (mark: tolerance)", "", "green: holds, red: differs")
    return figure


def describe(sink: Sink, claims: Sequence[Claim]) -> None:
    """Write the section of the report."""
    number = counts(claims)
    sink.text(
        f"{len(claims)} printed figures were recomputed: {number['holds']} agree, {number['differs']} differ, "
        f"{number['cannot-be-recomputed']} cannot be recomputed from what is printed or published."
    )
    sink.table("claims", pd.DataFrame(rows(claims)), "Printed figures of the thesis and the recomputed ones.")
    sink.figure("deviations", deviation_figure(claims), "Deviation of each recomputed figure.")
