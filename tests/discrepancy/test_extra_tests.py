"""Tests that would tell rivals apart: every advice of the library leads to some, and the virtual rig can make them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrpipe.config.sections.laboratory import CustomTest
from mrpipe.discrepancy import extra_tests
from mrpipe.discrepancy.extra_tests import Range, kinds_in, wanted_tests
from mrpipe.effects.library import all_effects, damper_effects

SPAN = Range(stroke_m=0.01, speed_m_s=0.08, drive=4.0, frequency_hz=1.0, duration_s=5.0)


def verdict(**more: Any) -> dict[str, Any]:
    return {"effects": [], "unexplained": {"structured": False, "depends_on": []}, **more}


@pytest.fixture(autouse=True)
def span(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extra_tests, "range_of", lambda recordings: SPAN)


@pytest.mark.property
def test_every_advice_and_need_of_the_library_leads_to_tests() -> None:
    for effect in damper_effects().values():
        for advice in (*effect.separated_by.values(), *effect.needs):
            assert kinds_in(advice), f"{effect.name}: {advice}"


@pytest.mark.property
def test_every_kind_can_be_ordered_and_stays_within_the_campaign() -> None:
    names = []
    for make in extra_tests._MAKERS.values():
        for test in (CustomTest(**item) for item in make(SPAN)):
            names.append(test.name)
            assert abs(test.middle_m) + test.amplitude_m <= SPAN.stroke_m * 1.001
            assert test.current_a <= SPAN.drive
            factor = 4.0 if test.motion == "triangle" else 2.0 * np.pi
            assert factor * test.frequency_hz * test.amplitude_m <= 1.55 * SPAN.speed_m_s
    assert len(set(names)) == len(names)


@pytest.mark.property
def test_rivals_unknowns_and_what_was_invisible_are_all_asked_for() -> None:
    tie = {"name": "accumulator", "tied_with": ["inertia"], "separating_tests": {"inertia": "several frequencies"}}
    found = wanted_tests(verdict(effects=[tie]), {"remanence": ("varying-drive",)}, None)  # type: ignore[arg-type]
    assert [item["decides"] for item in found.reasons] == ["accumulator or inertia", "whether there is remanence"]
    assert {"extra-steps-0.5", "extra-steps-1"} <= {item["name"] for item in found.tests}
    unknown = {"structured": True, "depends_on": [{"state": "time in test", "share": 0.3}]}
    found = wanted_tests(verdict(unexplained=unknown), {}, None)  # type: ignore[arg-type]
    assert [item["name"] for item in found.tests] == ["extra-long", "extra-cooling", "extra-long-again"]
    assert wanted_tests(verdict(), {}, None) == extra_tests.ExtraTests()  # type: ignore[arg-type]


@pytest.mark.property
def test_no_effect_is_separated_from_one_that_is_not_there() -> None:
    for effect in damper_effects().values():
        assert set(effect.separated_by) <= set(all_effects())
