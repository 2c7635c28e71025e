"""The first screen answers a reader's questions from the summaries alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.reporting.facts import ReportStage, RunFacts
from mrpipe.reporting.front import laws
from mrpipe.reporting.front.statements import statements
from mrpipe.structures import read_frame, write_frame
from tests.reporting.front.run import EFFECT, run_in, tracing

pytestmark = pytest.mark.property

UNKNOWN = {"structured": True, "share_of_residual": 1.0, "depends_on": [{"state": "drive"}]}


def answers(directory: Path, **changes: object) -> dict[str, str]:
    facts = run_in(directory, tracing(**changes))
    return {item.topic: item.text for item in statements(facts)}


def test_finding_has_value_interval_confidence_and_errors(tmp_path: Path) -> None:
    text = answers(tmp_path)["Missing"]
    assert "**accumulator** (stiffness 9.10 kN/m, 95 % interval 9.04 to 9.16)" in text
    assert "Gas spring." in text
    assert "high (0.97)" in text
    assert "7.9 % before, 1.5 % after (noise alone: 0.40 %)" in text
    assert "best any model reached is 1.3 %" in text


def test_digits_below_the_noise_are_not_written(tmp_path: Path) -> None:
    stiffness = {"value": 2469.388, "unit": "N/m", "interval": [2469.353, 2469.423]}
    text = answers(tmp_path, effects=[{**EFFECT, "parameters": {"stiffness": stiffness}}])["Missing"]
    assert "(stiffness 2.469 kN/m, 95 % interval within 0.10 %)" in text


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"residual": {"structured": False}, "effects": []}, "lacks nothing that these tests could show"),
        (
            {"effects": [], "unexplained": UNKNOWN},
            "no effect of the library explains. It varies with drive.",
        ),
        (
            {
                "verdict_class": "validation differs",
                "validation": {"differences": [{"sentence": "the force of test b is 6.5 % lower"}]},
            },
            "The validation tests differ from the training tests: the force of test b is 6.5 % lower",
        ),
        ({"verdict_class": "base form", "verdict": "dahl fits better", "effects": []}, "is not the right base form"),
        (
            {"verdict_class": "partly explained", "unexplained": {**UNKNOWN, "share_of_residual": 0.3}},
            "A part stays unexplained (30 % of the squared residual)",
        ),
    ],
)  # fmt: skip
def test_every_class_of_verdict_has_its_sentence(tmp_path: Path, changes: dict[str, object], expected: str) -> None:
    assert expected in answers(tmp_path, **changes)["Missing"]


def test_best_law_is_one_that_damps_and_is_compared_with_no_damper(tmp_path: Path) -> None:
    """passive-on moves least at this one frequency, because it shifts the resonance: it is not called the best."""
    text = answers(tmp_path)["Control"]
    assert "**vd** is best under harmonic base motion" in text
    assert "without a damper (-" in text
    assert "with the damper switched off (-65 %)" in text
    assert "passive-on moves less (16.0 mm) but damps free vibration by 0.25 % only" in text


def test_uncontrolled_structure_is_the_linear_one(tmp_path: Path) -> None:
    runs = laws.comparison(run_in(tmp_path))
    assert [run.law for run in runs] == ["passive-on", "vd", "passive-off", laws.UNCONTROLLED]
    assert runs[-1].rms_top_m > 0.05  # at resonance with half a percent of damping
    assert runs[-1].damping_ratio == 0.005  # of the first mode, although the others have less


def _peaks(law: str, peak: float) -> dict[str, object]:
    return {"law": law, "after": {"peak_rms_x_top_m": peak}}


def test_the_ranking_over_a_band_of_frequencies_comes_before_that_at_one(tmp_path: Path) -> None:
    """passive-on is best at one frequency and worst over the band."""
    band = {"band_rad_s": [6.0, 12.5], "laws": [_peaks("passive-on", 0.131), _peaks("vd", 0.0348)]}
    text = answers(tmp_path, closed_loop={"status": "replayed", "over_band": band})["Control"]
    assert text.startswith("Use **vd**: over harmonic base motion from 6.00 to 12.5 rad/s it has the smallest peak")
    assert "34.8 mm (passive-on 131 mm)" in text
    assert "passive-off is not part of this comparison (`mrpipe simulate --law passive-off --resonance`" in text
    assert "at the single frequency" in text


def test_the_worst_tests_are_named_with_what_was_done_in_them(tmp_path: Path) -> None:
    facts = run_in(tmp_path, tracing(tests=[{"name": "b", "nrmse_before": 0.08, "nrmse_after": 0.02}]))
    prepared = dict(facts.summaries["prepare"])
    made = {"name": "b", "excitation": "periodic", "frequency_hz": 1.0, "amplitude_m": 0.005, "drive_mean": -0.0013}
    prepared["tests"] = [{**prepared["tests"][1], **made}]
    prepared["drive_unit"] = "V"
    facts.summaries["prepare"] = prepared
    text = {item.topic: item.text for item in statements(facts)}["Weak spots"]
    assert "test b (2.0 %; 5.0 mm, 1.0 Hz, mean drive 0.00 V)" in text


def test_the_recording_that_is_predicted_worst_is_named(tmp_path: Path) -> None:
    rows = [
        {"test": "vd-a", "recorded": True, "after": {"nrmse_x_top": 0.05}},
        {"test": "passive-on-b", "recorded": True, "after": {"nrmse_x_top": 0.34}},
        {"test": "fdns", "recorded": False, "after": {}},
    ]
    text = answers(tmp_path, closed_loop={"status": "replayed", "tests": rows})["Weak spots"]
    assert "missed most in recording passive-on-b: by 34 % of its RMS value" in text


def test_doubts_name_rivals_and_extrapolation(tmp_path: Path) -> None:
    text = answers(tmp_path)["Distrust"]
    assert "do not separate accumulator from end-stop" in text
    assert "extrapolated beyond its bench tests under passive-off (40 % of the time)" in text


def test_doubts_name_simulated_laws_that_need_more_force_than_the_damper_gives(tmp_path: Path) -> None:
    facts = run_in(tmp_path)
    demand = {"largest_force_n": 150.0, "exceeds_damper": True, "limited_by_residual_force": False}
    summary = {"laws": {}, "force_demands": dict.fromkeys(("vd", "nnc"), demand)}
    stages = [*facts.stages, ReportStage("calibrate", "calibrate.", [], summary, [], "", 1.0)]
    found = " ".join(laws.doubts(RunFacts(facts.directory, "", "", stages)))
    assert "vd needs more force than the damper gives at the stroke of the calibration (150 N): in part" in found
    assert "nnc" not in found
    assert "more force" not in " ".join(laws.doubts(facts))


def test_a_law_that_was_designed_is_the_answer(tmp_path: Path) -> None:
    facts = run_in(tmp_path)
    design = {
        "best": "fdns",
        "objective": "peak RMS top displacement",
        "laws": {"fdns": {"peak_rms_x_top_m": 0.02, "probability_best": 0.93}, "vd": {"peak_rms_x_top_m": 0.03}},
    }
    facts.summaries["design"] = design
    assert "**fdns** is the best law" in laws.answer(facts)
    assert "(others: vd 30.0 mm)" in laws.answer(facts)


def test_tied_effect_is_not_called_sure(tmp_path: Path) -> None:
    weak = {**EFFECT, "confidence": 0.5}
    assert "Confidence: low (0.50)" in answers(tmp_path, effects=[weak])["Missing"]


def test_the_largest_motion_is_that_of_any_test(tmp_path: Path) -> None:
    """A random test has no amplitude of its cycles, but it may move furthest."""
    assert "up to 12.0 mm, " in answers(tmp_path)["Measured"]


def test_what_supports_the_finding_and_where_the_model_is_bad(tmp_path: Path) -> None:
    rows = [{"name": name, "nrmse_before": 0.08, "nrmse_after": after} for name, after in (("b", 0.01), ("c", 0.09))]
    rival = {"name": "end-stop", "form": "hard", "share": 0.3, "nrmse": 0.06}
    found = answers(
        tmp_path,
        tests=rows,
        candidates=[*tracing()["candidates"], rival],
        unexplained={"structured": True, "share_of_residual": 0.1, "depends_on": [{"state": "drive"}]},
        residual={"structured": True, "where": {"pre_yield": 0.1, "post_yield": 0.9}},
    )
    assert "The error falls in 1 of 2 unseen tests." in found["Trust"]
    assert "The best other explanation, end-stop, leaves 6.0 %." in found["Trust"]
    assert "largest in tests c (9.0 %) and b (1.0 %)" in found["Weak spots"]
    assert "It varies with drive." in found["Weak spots"]
    assert "90 % of the squared residual lay after yield" in found["Weak spots"]


def test_the_finding_on_a_structure_is_not_called_a_damper_and_shows_no_interval_without_width(tmp_path: Path) -> None:
    friction = {
        "slip_displacement": {"value": 7.712072e-5, "unit": "m", "interval": [7.712072e-5, 7.712072e-5]},
        "force": {"value": 14.1, "unit": "N", "interval": [13.0, 15.2]},
    }
    found = answers(
        tmp_path,
        model="linear-frame",
        base_form=None,
        effects=[{**EFFECT, "name": "joint-friction", "place": "storey 2", "parameters": friction}],
        residual={"structured": True, "where": {"storey_1": 0.1, "storey_2": 0.9}},
    )
    assert "**joint-friction** at storey 2 (slip displacement 77.1 µm)." in found["Missing"]
    assert "90 % of the squared residual lay in storey 2." in found["Weak spots"]
    assert "structure model with the effect 1.5 %" in found["Models"]
    assert "damper model with the effect" not in found["Models"]


def test_without_an_effect_nothing_is_called_added_or_corrected(tmp_path: Path) -> None:
    residual = {"structured": False, "where": {"pre_yield": 0.1, "post_yield": 0.9}}
    noise = {"verdict_class": "noise", "effects": [], "residual": residual, "before": {"nrmse": 0.005}}
    found = answers(tmp_path, **noise)
    assert "for each test: 0.50 %." in found["Models"] and "residual" not in found["Weak spots"]
    found = answers(tmp_path, **{**noise, "verdict_class": "unknown", "residual": {**residual, "structured": True}})
    assert "With the declared model, 90 % of the squared residual lay after yield" in found["Weak spots"]


def test_tests_to_be_made_are_described(tmp_path: Path) -> None:
    made = {"motion": "triangle", "amplitude_m": 0.008, "current": "steps", "name": "x", "role": "training"}
    wanted = {
        "file": "next-tests.yaml",
        "tests": [{**made, "frequency_hz": 0.5}, {**made, "frequency_hz": 1.0}],
        "decides": [{"decides": "end-stop or accumulator"}],
        "made_already": False,
    }
    text = answers(tmp_path, next_tests=wanted)["Test next"]
    assert (
        "2 tests would decide end-stop or accumulator: triangle motion with stepped drive, 8.0 mm, 0.50 to 1.0 Hz"
        in text
    )


def test_without_a_structure_the_way_to_a_law_is_said(tmp_path: Path) -> None:
    facts = run_in(tmp_path)
    bench = [stage for stage in facts.stages if stage.name in ("prepare", "identify-damper", "close-loop")]
    found = {item.topic: item.text for item in statements(type(facts)(tmp_path, "bench", "", bench))}
    assert "Add a frame campaign" in found["Control"]


def test_two_fits_of_one_form_are_explained(tmp_path: Path) -> None:
    assert "fits bouc-wen again" in answers(tmp_path, before={"nrmse": 0.05})["Models"]
    assert "again" not in answers(tmp_path)["Models"]


def test_the_structure_without_a_damper_moves_in_the_direction_of_the_simulation(tmp_path: Path) -> None:
    facts = run_in(tmp_path)
    frame = read_frame(Artifact(tmp_path / "frame.h5"))
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, replace(frame, influence_y=2.0 * np.ones(3)))

    def without_damper(**summary: object) -> list[float]:
        stages = [replace(stage, summary={**stage.summary, **summary}) for stage in facts.stages]
        return [run.rms_top_m for run in laws.comparison(replace(facts, stages=stages)) if run.law == laws.UNCONTROLLED]

    (along,) = without_damper()
    excitation = facts.laws[next(iter(facts.laws))]["excitation"]
    assert without_damper(excitation={**excitation, "direction_deg": 90.0}) == pytest.approx([2.0 * along])
    # the history of the second direction is not in the artifact
    assert without_damper(degrees_of_freedom=[]) == []


WIDE = {
    "gas_length": {"value": 0.5, "unit": "m", "interval": [0.104, 2.416]},
    "stiffness": {"value": 3534.0, "unit": "N/m", "interval": [3501.0, 3567.0]},
}


def test_a_well_determined_parameter_leads(tmp_path: Path) -> None:
    text = answers(tmp_path, effects=[{**EFFECT, "parameters": WIDE}])["Missing"]
    assert "**accumulator** (stiffness 3.534 kN/m, 95 % interval 3.501 to 3.567)" in text
    alone = answers(tmp_path, effects=[{**EFFECT, "parameters": {"gas_length": WIDE["gas_length"]}}])["Missing"]
    assert "gas length" in alone


def test_an_exchanged_base_form_is_said(tmp_path: Path) -> None:
    form = {"declared": "bouc-wen", "taken": "rounded-yield", "tied_with": ["dahl"], "nrmse": {}}
    for changes in ({}, {"effects": [], "unexplained": UNKNOWN}):
        text = answers(tmp_path, base_form=form, **changes)["Missing"]
        assert "base form **rounded-yield** in place of bouc-wen" in text
        assert "do not separate it from dahl" in text
    assert "damper model rounded-yield with the effect 1.5 %" in answers(tmp_path, base_form=form)["Models"]
    same = {**form, "taken": "bouc-wen"}
    assert "in place of" not in answers(tmp_path, base_form=same)["Missing"]


def test_a_base_form_that_explains_nearly_all_is_not_called_a_lack(tmp_path: Path) -> None:
    """An electrorheological damper: the other base form had left 0.02 % of the squared residual, and no effect."""
    form = {"declared": "bouc-wen", "taken": "rounded-yield", "tied_with": [], "nrmse": {}}
    found = answers(tmp_path, base_form=form, effects=[], unexplained={**UNKNOWN, "share_of_residual": 2.5e-4})
    assert "lacks something" not in found["Missing"]
    assert "What it leaves, 0.025 % of the squared residual, no effect" in found["Missing"]
    assert "damper model rounded-yield 1.5 %" in found["Models"]


def test_tied_effects_are_named_as_such_with_the_test_that_separates_them(tmp_path: Path) -> None:
    tied = {"effects": ["impact", "yielding"], "separating_tests": ["a free decay"]}
    text = answers(tmp_path, effects=[], unexplained=UNKNOWN, tied=tied)["Missing"]
    assert "lacks something. impact and yielding explain it equally well." in text
    assert "A test that separates them is a free decay." in text and "no effect of the library" not in text
