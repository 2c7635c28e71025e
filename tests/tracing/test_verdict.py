"""The JSON of a verdict keeps to its documented keys, for a bench and for a structure."""

from __future__ import annotations

import json

import pytest

from mrpipe.tracing.verdict import Candidate, Estimate, Interval, LeftOutGain, NamedEffect, Unexplained, Verdict

pytestmark = pytest.mark.property

EFFECT = NamedEffect(
    "impact", "bumper", {"gap": Estimate(0.004, "m", Interval(0.003, 0.005))}, 0.9, "physics", "remedy", "source",
    "structure", "floor 2", ("cubic-stiffness",), {"cubic-stiffness": "half the amplitude"},
    LeftOutGain(0.4, Interval(0.3, 0.5)),
)  # fmt: skip


def test_an_effect_has_the_documented_keys() -> None:
    found = json.loads(json.dumps(EFFECT.as_json()))
    assert found["parameters"] == {
        "gap": {
            "value": 0.004, "unit": "m", "interval": [0.003, 0.005], "interval_kind": "confidence",
            "interval_level": 0.95,
        }
    }  # fmt: skip
    assert found["name"] == "impact" and found["place"] == "floor 2" and found["tied_with"] == ["cubic-stiffness"]
    assert found["cross_validated_gain"]["interval"] == [0.3, 0.5]
    assert found["separating_tests"] == {"cubic-stiffness": "half the amplitude"}


def test_optional_keys_are_left_out() -> None:
    plain = NamedEffect("drag", "square", {}, 0.5, "physics", "remedy", "source", "plant").as_json()
    assert set(plain) == {
        "name", "form", "parameters", "confidence", "tied_with", "physics", "remedy", "source", "corrected_in"
    }  # fmt: skip
    assert Unexplained(False).as_json() == {"structured": False, "share_of_residual": 0.0, "depends_on": []}


def test_an_interval_says_what_it_means() -> None:
    assert Interval.point(2.0).as_json() == {"interval": [2.0, 2.0], "interval_kind": "point"}
    storeys = Estimate(3.0, "N", Interval(1.0, 5.0, "range", None), (1.0, 3.0, 5.0)).as_json()
    assert storeys["by_storey"] == [1.0, 3.0, 5.0] and storeys["interval_kind"] == "range"
    assert "interval_level" not in storeys


def test_candidates_and_the_unexplained_part() -> None:
    assert Candidate("impact", "bumper", 0.1, 12.0, 0.7, {"bumper": 0.7}).as_json() == {
        "name": "impact", "form": "bumper", "nrmse": 0.1, "evidence": 12.0, "share": 0.7, "forms": {"bumper": 0.7},
        "at_bound": [],
    }  # fmt: skip
    assert Candidate("controller-delay", "law-late", 0.1, 2.0, 0.7, lag_s=0.01).as_json()["lag_s"] == 0.01
    left = Unexplained(True, 0.3, (("drift", 0.2),), 1e-9, ("b",)).as_json()
    assert left["depends_on"] == [{"state": "drift", "share": 0.2}] and left["tests"] == ["b"]
    assert Verdict("unknown", "words").sentence_as_json()["verdict_class"] == "unknown"
