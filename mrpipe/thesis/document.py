"""Writes docs/ledger.md from the entries of the ledger: `python -m mrpipe.thesis.document`."""

from __future__ import annotations

import sys

from mrpipe.thesis.claim import rule_text
from mrpipe.thesis.entries import KINDS, Entry, Kind, all_entries, tables
from mrpipe.words import in_percent

_HEAD = """\
# The ledger of the thesis

`mrpipe reproduce` recomputes the results and statements of the thesis and gives a verdict for each. This page lists
what the ledger contains; `python -m mrpipe.thesis.document > docs/ledger.md` writes it. The recomputed values are in
`reproduce.md` of the run.

The command reads the run: prepared signals, networks, sweep, damper, frame, calibration, traced effects and closed-loop
responses. What is missing or out of date is built first. With `--set reproduce.source=sets` it uses the printed frame,
damper set C and the exact inverse of its model instead, and needs no run. Tables 6.2 and 6.3 and Table 2 of P4 are
recomputed with the public data (`MRPIPE_DATA`). Without them, Tables 6.2 and 6.3 are recomputed with surrogates of the
two buildings, and Table 2 of P4 is left out.

Each entry has a verdict: `holds`, `differs` (with the reason), or `cannot-be-recomputed` (with the reason). A number is
judged by a relative tolerance, a statement by a rule. A number that sets a condition of the computation, such as the
amplitude of the excitation, has no verdict, because a recomputed value could not disagree. The measured column of Table
5.1 is compared with the loop at the resonance of each law, with the effects that the tracing found; see
[Table 5.1 explained](table-5-1.md).

The places are sections and tables of the thesis; the text at hand has no page numbers. Of the figures, only the numbers
that the thesis states in words are compared, because the recorded curves are not published.

"""

_TITLES: dict[Kind, str] = {
    "table": "Result tables",
    "printed": "Other printed figures",
    "finding": "Statements of the thesis",
    "check": "Checks of this project",
}
_TEXTS: dict[Kind, str] = {
    "table": "",
    "printed": "Figures that the thesis or its papers print outside of the result tables.",
    "finding": "Every recomputed number of a statement must keep its rule.",
    "check": "Values that this project found before ([errata](errata.md)). The thesis does not print them.",
}


def counted() -> dict[Kind, int]:
    """Return kind -> number of entries."""
    return {kind: sum(entry.kind == kind for entry in all_entries()) for kind in KINDS}


def as_markdown() -> str:
    """Return the page."""
    number = counted()
    lines = [_HEAD, "| kind | entries |\n| --- | --- |\n"]
    lines += [f"| {_TITLES[kind].lower()} | {number[kind]} |\n" for kind in KINDS]
    lines.append(f"\n## {_TITLES['table']}\n\n| table | printed in | columns | numbers | of these, conditions |\n")
    lines.append("| --- | --- | --- | --- | --- |\n")
    for name, content in tables().items():
        entries = [entry for entry in all_entries() if entry.table == name]
        given = sum(entry.given for entry in entries)
        columns = ", ".join(content["columns"])
        lines.append(f"| {name} | {content['place']} | {columns} | {len(entries)} | {given} |\n")
    for kind in KINDS[1:]:
        lines.append(f"\n## {_TITLES[kind]}\n\n{_TEXTS[kind]}\n\n| id | what | printed in | printed, or rule |\n")
        lines.append("| --- | --- | --- | --- |\n")
        lines += [_row(entry) for entry in all_entries() if entry.kind == kind]
    return "".join(lines)


def _row(entry: Entry) -> str:
    if entry.rule:
        shown = rule_text(entry.rule)
    elif isinstance(entry.printed, list):
        shown = ", ".join(f"{value:.4g}" for value in entry.printed)
    elif entry.printed is None:
        shown = "-"
    else:
        shown = entry.printed if isinstance(entry.printed, str) else f"{entry.printed:.4g}"
    if entry.tolerance:
        shown += f" within {in_percent(entry.tolerance, digits=3, exact=True)}"
    cells = (entry.id, entry.what, entry.place, shown)
    return "| " + " | ".join(str(cell).replace("|", chr(92) + "|") for cell in cells) + " |\n"


if __name__ == "__main__":
    sys.stdout.write(as_markdown())
