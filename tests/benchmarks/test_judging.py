"""Verdicts are compared with the truth, and tables count them."""

import pytest

from benchmarks.judging import judged, parameter_errors, verdict_row
from benchmarks.tracing_table import document, interval, percent, reliability, table

pytestmark = pytest.mark.property

SUMMARY = {
    "effects": [{"name": "inertia", "form": "mass", "confidence": 0.95, "tied_with": [],
                 "parameters": {"mass": {"value": 2.2, "unit": "kg"}}}],
    "before": {"nrmse": 0.1}, "after": {"nrmse": 0.01}, "noise_floor_nrmse": 0.009,
}  # fmt: skip


def row_of(kind, planted, summary=SUMMARY, **more):
    row = {
        "seed": 1, "kind": kind, "base": "dahl", "planted": planted, "share": 0.1, "noise": "white", "rate_hz": 1000.0,
        "training": "regular", "validation": "alike", "repeats": False, "seconds": 10.0, "error": "",
        "truth": {"numbers": [{"mass": 2.0} for _ in planted], "shares": [0.1 for _ in planted],
                  "true_model_nrmse": 0.01},
        **verdict_row(summary), **more,
    }  # fmt: skip
    return row | judged(kind, planted, row)


def named(*names):
    effects = [{"name": name, "confidence": 0.8} for name in names]
    return {**SUMMARY, "effects": effects}


@pytest.mark.parametrize(
    ("kind", "planted", "found", "right", "alone"),
    [
        ("clean", [], [], True, True),
        ("clean", [], ["offset"], False, False),
        ("single", ["inertia"], ["inertia"], True, True),
        ("single", ["inertia"], ["inertia", "offset"], True, False),
        ("single", ["inertia"], ["offset", "inertia"], False, False),
        ("single", ["inertia"], [], False, False),
        ("pair", ["inertia", "delay"], ["delay", "inertia"], True, True),
        ("pair", ["inertia", "delay"], ["delay"], False, False),
        ("outside", ["bump"], ["delay"], False, False),
    ],
)
def test_verdicts_are_judged_by_their_kind(kind, planted, found, right, alone):
    row = row_of(kind, planted, named(*found))
    assert (row["right"], row["alone"]) == (right, alone)


@pytest.mark.parametrize(
    ("structured", "verdict_class", "right"), [(True, None, True), (False, None, False), (False, "unknown", True)]
)
def test_a_shape_outside_the_library_must_be_called_unknown(structured, verdict_class, right):
    summary = {**named(), "unexplained": {"structured": structured}, "verdict_class": verdict_class}
    assert row_of("outside", ["bump"], summary)["right"] is right


def test_parameters_of_the_same_meaning_are_compared():
    (effect, key, error), *rest = parameter_errors(row_of("single", ["inertia"]))
    assert not rest
    assert (effect, key) == ("inertia", "mass")
    assert error == pytest.approx(0.1)


def test_reliability_counts_names_that_are_not_there():
    rows = [row_of("clean", []), row_of("single", ["inertia"])]
    text = reliability(rows)
    assert "| 0.95 to 1 | 2 | 0.95 | 0.50 |" in text
    assert "Brier score: 0.453" in text


def test_the_document_holds_all_cases_and_the_failed_ones():
    rows = [row_of("clean", []), row_of("single", ["inertia"]), row_of("pair", ["inertia", "delay"])]
    failed = {**rows[0], "seed": 9, "error": "RuntimeError: exit status 1"}
    text = document([*rows, failed])
    assert "clean rig: no effect named | 0 of 1 (0 %) | 0 to 79 % |" in text
    assert "one effect: named alone | 1 of 1 (100 %) | 21 to 100 % |" in text
    assert "| 9 | none | dahl | RuntimeError: exit status 1 |" in text
    assert percent([], lambda row: True) == "-"


@pytest.mark.literature
def test_interval_of_a_rate_is_wilsons():
    # Brown, Cai and DasGupta 2001: for 0 of 10 the upper limit is z^2/(n + z^2)
    assert interval(0, 10) == "0 to 28 %"
    assert interval(5, 10) == "24 to 76 %"


def test_a_bar_within_a_cell_does_not_split_it():
    assert table(("law",), [("|v| v",)]).splitlines()[-1] == r"| \|v\| v |"
