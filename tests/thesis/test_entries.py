"""The data of the ledger: complete, unique, and judged so that every verdict can change."""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path

import pytest

from mrpipe.thesis.claim import Missing, Value, deviation, judge, rule_text
from mrpipe.thesis.document import as_markdown, counted
from mrpipe.thesis.entries import RULES, Entry, all_entries, printed_columns, printed_gains, tables
from tests.thesis.columns import loop_columns

ROOT = Path(__file__).resolve().parents[2]
NUMBERS = {
    "Table 4.1": 16,
    "Table 5.1": 40,
    "Table 6.2": 36,
    "Table 6.3": 48,
    "P3 Table 1": 12,
    "P4 Table 2": 12,
}

JUDGED = [item for item in all_entries() if not item.given and (item.rule or item.printed is not None)]
"""All entries but conditions of the computation and the figures, where nothing is printed as a number."""


@pytest.mark.literature
def test_every_number_of_the_result_tables_is_there() -> None:
    found = Counter(entry.table for entry in all_entries() if entry.kind == "table")
    assert found == NUMBERS
    assert sum(found.values()) == 164
    # only the response that sets the amplitude of the base is not a result
    given = [entry.id for entry in all_entries() if entry.given]
    assert given == ["P3-T1-vd-peak_x5_m", "T4.1-vd-peak_x5_m", "T5.1s-vd-rms_x5_m", "T5.1m-vd-rms_x5_m"]


@pytest.mark.property
def test_entries_have_names_of_their_own_and_a_way_to_be_judged() -> None:
    entries = all_entries()
    assert [name for name, count in Counter(entry.id for entry in entries).items() if count > 1] == []
    for entry in entries:
        assert entry.place and entry.what, entry.id
        assert not (entry.rule and entry.tolerance is not None), entry.id
        if entry.rule:
            assert set(entry.rule) <= set(RULES) and len(entry.rule) == 1, entry.id


@pytest.mark.property
def test_about_forty_statements_and_all_rows_of_the_errata_page_are_there() -> None:
    assert counted()["finding"] >= 25
    rows = {int(match.group(1)) for entry in all_entries() if (match := re.match(r"A(\d+)", entry.id))}
    page = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
    on_page = {int(match.group(1)) for match in re.finditer(r"^\| (\d+) \|", page, re.MULTILINE)}
    # row 15 is about Table 4.1 and Table 1 of P3 as a whole
    assert rows == on_page - {15}


def _other(entry: Entry) -> tuple[object, object]:
    """Return a value that agrees with an entry and one that does not."""
    if entry.rule:
        ((name, bound),) = entry.rule.items()
        if name == "one_of":
            return bound[0], "something else"
        if name == "between":
            return 0.5 * (bound[0] + bound[1]), bound[1] + 1.0
        return (bound - 0.1, bound + 0.1) if name == "below" else (bound + 0.1, bound - 0.1)
    if isinstance(entry.printed, str):
        return entry.printed, f"not {entry.printed}"
    first = entry.printed[0] if isinstance(entry.printed, list) else entry.printed
    moved = first * (1.0 + 2.0 * (entry.tolerance or 0.0) + 1e-6) if first else 1.0
    changed = [moved, *entry.printed[1:]] if isinstance(entry.printed, list) else moved
    return entry.printed, changed


@pytest.mark.property
@pytest.mark.parametrize("entry", JUDGED, ids=lambda item: item.id)
def test_every_verdict_follows_the_value(entry: Entry) -> None:
    """No entry is judged so that it could not differ, and none so that it could not hold."""
    good, bad = _other(entry)
    assert judge(entry, Value(good, "a test")).verdict == "holds"
    differs = judge(entry, Value(bad, "a test", "because of a test"))
    assert differs.verdict == "differs"
    assert "because of a test" in differs.why and judge(entry, Value(good, "a test", "because")).why == ""
    assert judge(entry, Value(math.nan, "a test")).verdict == "differs"
    assert judge(entry, Missing("no data")).verdict == "cannot-be-recomputed"


@pytest.mark.property
def test_a_condition_of_the_computation_has_no_verdict() -> None:
    entry = next(entry for entry in all_entries() if entry.given)
    claim = judge(entry, Value(entry.printed, "the run"))
    assert claim.verdict == "cannot-be-recomputed" and claim.recomputed is None
    assert "could not disagree" in claim.why


@pytest.mark.property
def test_deviation_is_relative_and_largest() -> None:
    assert deviation([1.0, 2.0], [1.01, 2.2]) == pytest.approx(0.1)
    assert deviation(0.0, 0.3) == pytest.approx(0.3)
    assert deviation([1.0, 2.0], [1.0]) == math.inf
    assert rule_text({"between": [0.9, 1.1]}) == "between 0.9 and 1.1"


@pytest.mark.literature
def test_printed_columns_and_gains_are_those_of_the_thesis() -> None:
    measured = printed_columns("Table 5.1", "T5.1m")
    assert measured["vdps"]["rms_x5_m"] == 0.02303
    assert printed_gains()["vd"] == {"c_n_s_m": 650.0}
    assert loop_columns("vdns")["thesis simulated"]["rms_x1_m"] == 0.0063
    assert loop_columns("vd")["set C"]["rms_a1_m_s2"] == 0.72
    assert loop_columns("lqg") == {}


@pytest.mark.property
def test_pages_promise_what_the_ledger_contains() -> None:
    assert (ROOT / "docs" / "ledger.md").read_text(encoding="utf-8") == as_markdown()
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    number = counted()
    assert f"{number['table']} numbers of its result tables and {number['finding']} of its statements" in readme
    assert set(tables()) == set(NUMBERS)
