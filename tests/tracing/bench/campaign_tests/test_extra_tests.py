"""Tests that would tell rivals apart: every advice of the library leads to some, and the virtual rig can make them."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest

from mrpipe.campaigns import load_campaign
from mrpipe.config.sections.laboratory import CustomTest
from mrpipe.effects.contract import TESTS_FOR, Separation, TestKind
from mrpipe.effects.library import all_effects, damper_effects
from mrpipe.laboratory.bench import record_bench
from mrpipe.laboratory.blind import write_bench
from mrpipe.laboratory.damper import damper_from_set
from mrpipe.laboratory.effects import Planted, find_form
from mrpipe.laboratory.motion import BenchTest
from mrpipe.laboratory.options import BenchRig
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import prepare_campaign
from mrpipe.tracing.bench.campaign_tests import extra_tests
from mrpipe.tracing.bench.campaign_tests.extra_tests import Range, kinds_between, wanted_tests, with_drive_unit
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.tracing.options import TracingOptions

RANGE_OF = extra_tests.range_of
SPAN = Range(stroke_m=0.01, speed_m_s=0.08, drive=4.0, frequency_hz=1.0, duration_s=5.0)


def verdict(**more: Any) -> dict[str, Any]:
    return {"effects": [], "unexplained": {"structured": False, "depends_on": []}, **more}


@pytest.fixture(autouse=True)
def span(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extra_tests, "range_of", lambda recordings: SPAN)


@pytest.mark.property
def test_every_advice_and_need_of_the_library_leads_to_tests() -> None:
    for effect in damper_effects().values():
        kinds: list[str] = [*(TESTS_FOR[need] for need in effect.needs)]
        for rival, separation in effect.separated_by.items():
            assert separation.advice
            assert kinds_between(effect.name, rival, damper_effects()) == separation.kinds
            kinds += separation.kinds
        assert set(kinds) <= set(extra_tests._MAKERS)


@pytest.mark.property
def test_a_damper_that_was_never_driven_gets_no_tests_with_a_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    """A friction damper without a drive had been advised to be tested at 1 A."""
    scales = SimpleNamespace(stroke=0.01, speed=0.08, drive=1.0)
    recordings = SimpleNamespace(
        drive=np.zeros(2000), period_s=np.ones(1), starts=np.array([0, 2000]), dt=0.002, scales=lambda: scales
    )
    monkeypatch.setattr(extra_tests, "range_of", RANGE_OF)
    asked = verdict(untestable={"delay": "the drive is constant", "remanence": "the drive is constant"})
    assert wanted_tests(asked, damper_effects(), recordings).tests == ()  # type: ignore[arg-type]
    asked["unexplained"] = {"structured": True, "depends_on": [{"state": "velocity"}, {"state": "past of drive"}]}
    tests = wanted_tests(asked, damper_effects(), recordings).tests  # type: ignore[arg-type]
    assert tests and all(item["current_a"] == 0.0 for item in tests)
    assert len({item["name"] for item in tests}) == len(tests)


@pytest.mark.property
def test_a_drive_in_volts_is_not_called_a_current() -> None:
    """A test at 1750 V had the key `current_a` in the JSON."""
    tests = [{"name": "extra-long", "current_a": 1750.0}]
    assert with_drive_unit(tests, "V") == [{"name": "extra-long", "drive_v": 1750.0}]
    assert with_drive_unit(tests, "A") == tests


@pytest.mark.property
def test_pairs_that_no_effect_separates_lead_to_general_tests() -> None:
    library = damper_effects()
    general = kinds_between("no such effect", "nor this one", library)
    assert general and set(general) <= set(extra_tests._MAKERS)
    for one, other in itertools.permutations(library, 2):
        stated = [
            library[a].separated_by[b].kinds for a, b in ((one, other), (other, one)) if b in library[a].separated_by
        ]
        assert kinds_between(one, other, library) == next((kinds for kinds in stated if kinds), general)
        if not any(stated):
            assert kinds_between(other, one, library) == general


@pytest.mark.property
def test_rival_without_bench_tests_of_its_own_leads_to_those_that_the_other_one_states() -> None:
    library = damper_effects()
    one, other = library["accumulator"], library["inertia"]
    silent = replace(one, separated_by={other.name: Separation("no bench test separates them")})
    stated = replace(other, separated_by={one.name: Separation("change the frequency", ("frequencies",))})
    quiet = replace(other, separated_by={})
    assert kinds_between(one.name, other.name, {one.name: silent, other.name: stated}) == ("frequencies",)
    general = kinds_between(one.name, other.name, {})
    assert kinds_between(one.name, other.name, {one.name: silent, other.name: quiet}) == general


@pytest.mark.property
def test_unexplained_residual_of_a_state_without_a_kind_leads_to_general_tests() -> None:
    general = kinds_between("accumulator", "inertia", {})
    unknown = {"structured": True, "depends_on": [{"state": "no such state", "share": 0.3}]}
    found = wanted_tests(verdict(unexplained=unknown), {}, None)  # type: ignore[arg-type]
    assert [(item["decides"], tuple(item["kinds"])) for item in found.reasons] == [("what is unexplained", general)]


@pytest.mark.property
def test_every_kind_of_test_can_be_made() -> None:
    assert set(extra_tests._MAKERS) == set(get_args(TestKind))


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
    library = damper_effects()
    tie = {"name": "accumulator", "tied_with": ["inertia"]}
    open_questions = verdict(effects=[tie], untestable={"remanence": "untestable: the drive is constant"})
    found = wanted_tests(open_questions, library, None)  # type: ignore[arg-type]
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


@pytest.mark.planted
def test_the_tests_offered_tell_rivals_further_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An accumulator and an end stop look alike at one amplitude; the amplitudes offered set them apart."""
    monkeypatch.undo()
    rig = BenchRig(sampling_rate_hz=500.0)
    first = [
        BenchTest(f"{role}-{kind}-{level:g}", role, "sine", 0.010, frequency, kind, level, 4.0)
        for role, kind, frequency, level in (
            ("training", "constant", 1.5, 0.0), ("training", "constant", 1.5, 1.0), ("training", "constant", 1.5, 2.0),
            ("training", "constant", 1.5, 3.0), ("training", "half-sine", 1.7, 2.0),
            ("training", "half-sine", 1.4, 3.0), ("validation", "constant", 1.6, 1.5),
        )
    ]  # fmt: skip
    hidden = Planted(find_form("accumulator", ""), {}, 0.06, False)
    damper = damper_from_set("set-c").with_effects([hidden])
    library = {name: damper_effects()[name] for name in ("accumulator", "end-stop")}
    forms = ("bouc-wen", "dahl", "hyperbolic-tangent")
    options = TracingOptions(base_forms=forms, refits=2, bootstrap_draws=50, most_effects=1, observation_filter=False)

    def traced(tests: list[BenchTest], folder: str) -> Tracing:
        write_bench(tmp_path / folder, record_bench(damper, tests, rig, np.random.default_rng(5)), rig)
        prepared = prepare_campaign(load_campaign(tmp_path / folder), PreparationOptions()).tests
        return trace_campaign([item.test for item in prepared], library, [], options, rng=np.random.default_rng(1))

    before = traced(first, "first")
    tie = {"name": "accumulator", "tied_with": ["end-stop"]}
    offered = wanted_tests(verdict(effects=[tie]), library, before.training)
    after = traced([*first, *(BenchTest(**item) for item in offered.tests)], "second")
    gaps = []
    for item in (before, after):
        assert item.summary["effects"][0]["name"] == "accumulator"
        shares = {candidate["name"]: candidate["share"] for candidate in item.summary["candidates"]}
        gaps.append(shares["accumulator"] - shares["end-stop"])
    assert gaps[1] > 1.2 * gaps[0]
