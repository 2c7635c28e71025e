"""Entries of the ledger: those of `printed_values`, one YAML file for each table and each chapter.

The files hold what the thesis prints and how close a recomputed value must come. They hold no recomputed value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import yaml

Kind = Literal["table", "printed", "finding", "check"]
KINDS: tuple[Kind, ...] = ("table", "printed", "finding", "check")
"""`table`: a number of a result table. `printed`: another number or word of the thesis. `finding`: a statement of the
thesis. `check`: a value that this project found before (errata page), not a figure of the thesis."""

FOLDER = "printed_values"
RULES = ("below", "above", "between", "one_of")


@dataclass(frozen=True)
class Entry:
    """One figure or statement, and how it is judged.

    Attributes
    ----------
    id
        Unique. `A4b` is the second entry of row 4 of the errata page.
    chapter
        Chapter of the thesis; papers are listed with the chapter that uses them.
    kind
        See :data:`KINDS`.
    what
        The quantity that is compared, with its unit.
    place
        Place where it is printed.
    printed
        Number, list of numbers or words; None where the entry is judged by a rule, or where nothing is printed.
    tolerance
        Largest relative deviation; None for words and rules.
    rule
        One of :data:`RULES` and its bound, for a statement: every recomputed number must keep it.
    reason
        Why a recomputed value may differ; shown only where it does.
    table, column, row
        Of a number of a table.
    given
        Whether the number sets a condition of the computation, so that it cannot disagree.
    """

    id: str
    chapter: int
    kind: Kind
    what: str
    place: str
    printed: Any = None
    tolerance: float | None = None
    rule: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""
    table: str = ""
    column: str = ""
    row: str = ""
    given: bool = False


def table_id(part: str, column: str, row: str) -> str:
    """Return the id of a number of a table."""
    return f"{part}-{column}-{row}"


def _read(name: str) -> Mapping[str, Any]:
    content = yaml.safe_load((files("mrpipe.thesis") / FOLDER / name).read_text(encoding="utf-8"))
    assert isinstance(content, dict), name
    return content


@cache
def _documents() -> dict[str, Mapping[str, Any]]:
    folder = files("mrpipe.thesis") / FOLDER
    names = sorted(item.name for item in folder.iterdir() if item.name.endswith(".yaml"))
    return {name: _read(name) for name in names}


def tables() -> dict[str, Mapping[str, Any]]:
    """Return the result tables by name, as their files have them."""
    return {content["table"]: content for content in _documents().values() if "table" in content}


def printed_columns(table: str, part: str) -> dict[str, dict[str, float]]:
    """Return column -> row -> printed value of one part of a table.

    Parameters
    ----------
    table
        Such as `Table 5.1`.
    part
        Id of the part, such as `T5.1s`.
    """
    content = tables()[table]
    rows = next(item for item in content["parts"] if item["id"] == part)["rows"]
    return {
        column: {row: float(entry["values"][place]) for row, entry in rows.items()}
        for place, column in enumerate(content["columns"])
    }


def printed_gains() -> dict[str, dict[str, float]]:
    """Return law -> gains that the thesis and paper P2 ran (Table 5.1)."""
    return {law: dict(gains) for law, gains in tables()["Table 5.1"]["gains"].items()}


def _table_entries(content: Mapping[str, Any]) -> list[Entry]:
    found = []
    for part in content["parts"]:
        for row, entry in part["rows"].items():
            for column, value in zip(content["columns"], entry["values"], strict=True):
                found.append(
                    Entry(
                        id=table_id(part["id"], column, row),
                        chapter=int(content["chapter"]),
                        kind="table",
                        what=f"{content['table']}, {part['name']}, {column}: {entry['what']} [{entry['unit']}]",
                        place=content["place"],
                        printed=float(value),
                        tolerance=float(entry.get("tolerance", content["tolerance"])),
                        reason=" ".join(part.get("reason", content.get("reason", "")).split()),
                        table=content["table"],
                        column=column,
                        row=row,
                        given=column in entry.get("given", ()),
                    )
                )
    return found


@cache
def all_entries() -> tuple[Entry, ...]:
    """Return every entry: chapter by chapter, tables after the other entries of their chapter."""
    found: list[Entry] = []
    for content in _documents().values():
        if "table" in content:
            found += _table_entries(content)
        else:
            found += [Entry(chapter=int(content["chapter"]), **entry) for entry in content["entries"]]
    return tuple(sorted(found, key=lambda entry: (entry.chapter, entry.kind == "table")))


INDICES = ("rms_x5_m", "rms_x1_m", "rms_a5_m_s2", "rms_a1_m_s2")
"""Order of the indices in the entries of the closed loop that list several."""
