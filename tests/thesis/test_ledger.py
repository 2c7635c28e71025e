"""The ledger: what it recomputes from parameter sets, and that it follows what the run holds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.case_studies.options import WindClimate
from mrpipe.errors import UserError
from mrpipe.simulation.resonance import runner
from mrpipe.simulation.response_curve import response_curve
from mrpipe.structures import frame_from_parameter_set
from mrpipe.thesis import Ledger, build_ledger, page, table51, table51_page
from mrpipe.thesis.bench import LAWS, Bench, bench_of_sets, excite
from mrpipe.thesis.chapter2 import _signed, _sweep, peak_forces, unit_of_gamma
from mrpipe.thesis.chapter4 import cycle_peaks
from mrpipe.thesis.chapter5 import _response_indices
from mrpipe.thesis.chapter6 import CaseOptions, unit_of_command
from mrpipe.thesis.claim import Missing, Value
from mrpipe.thesis.table51 import Case, Reading

PROVENANCE = Provenance(stage="test", seed=0)


@pytest.fixture(scope="module")
def bench() -> Bench:
    return bench_of_sets(frame_from_parameter_set("thesis"))


@pytest.fixture(scope="module")
def ledger(bench: Bench) -> Ledger:
    return build_ledger(bench, frame_from_parameter_set("thesis"), chapters=(2, 3, 4))


def _artifact(path: Path, **documents: Any) -> Artifact:
    with ArtifactWriter.create(path, PROVENANCE) as artifact:
        for name, content in documents.items():
            artifact.put_json(name, content)
    return Artifact(path)


@pytest.mark.literature
def test_what_follows_from_printed_inputs_holds(ledger: Ledger) -> None:
    asserted = ["A1c", "C0", "C1", "C2", "C3", "C4", "C-yield", "A3c", "B1", "B2", "B3", "B4", "B5", "A7b", "B6", "B7"]
    asserted += ["B8", "A4c", "A8b", "A8c", "A8d", "B9", "B10", "A9d", "A10b", "A10c", "A11a", "A11b", "A11c", "A11d"]
    asserted += ["A11e", "B11", "T4.30", "A12f", "D1", "P2-0.62", "P2-2.06", "P2-nu-k"]
    assert {name: ledger.claim(name).why for name in asserted if ledger.claim(name).verdict != "holds"} == {}


@pytest.mark.literature
def test_what_does_not_follow_differs_and_says_why(ledger: Ledger) -> None:
    refuted = ["A1a", "A1b", "A2", "A3a", "A4a", "A4b", "A5a", "A5b", "A6", "A7a", "A8a", "A9a", "A9b", "A9c", "A10a"]
    refuted += ["A12a", "A12b", "A12e"]
    assert [name for name in refuted if ledger.claim(name).verdict != "differs"] == []
    assert [claim.id for claim in ledger.claims if claim.verdict != "holds" and not claim.why] == []
    assert [claim.id for claim in ledger.claims if claim.verdict == "holds" and claim.why] == []


@pytest.mark.property
def test_every_computed_value_can_change_its_verdict(ledger: Ledger) -> None:
    """A value moved away from what was computed changes the verdict of each entry that holds."""
    from mrpipe.thesis.claim import judge

    for claim in ledger.claims:
        if claim.verdict != "holds" or isinstance(claim.recomputed, str):
            continue
        numbers = np.atleast_1d(np.asarray(claim.recomputed, dtype=np.float64))
        moved = [(numbers + sign * (10.0 + 10.0 * np.abs(numbers))).tolist() for sign in (1.0, -1.0)]
        verdicts = {judge(claim.entry, Value(value, "a test")).verdict for value in moved}
        assert "differs" in verdicts, claim.id


@pytest.mark.property
def test_without_a_run_what_needs_one_says_so(ledger: Ledger) -> None:
    for name in ("T2.5", "F2-velocity", "F2-better", "R3-omega", "F3-exponential", "R4-limits"):
        claim = ledger.claim(name)
        assert claim.verdict == "cannot-be-recomputed" and "run" in claim.why, name


@pytest.mark.property
def test_the_printed_frame_is_followed(bench: Bench) -> None:
    other = build_ledger(bench, frame_from_parameter_set("geometry"), chapters=(3,))
    assert other.claim("B3").verdict == "differs"
    assert {claim.entry.chapter for claim in other.claims} == {3}


@pytest.mark.property
def test_the_damper_of_the_bench_is_followed(bench: Bench) -> None:
    stronger = replace(bench.rig.damper, parameters={**bench.rig.damper.parameters, "yield_force_a": 60.0})
    moved = replace(bench, rig=replace(bench.rig, damper=stronger))
    from mrpipe.thesis.chapter2 import chapter_2

    first, second = chapter_2(bench)["R2-residual"], chapter_2(moved)["R2-residual"]
    assert isinstance(first, Value) and isinstance(second, Value)
    assert second.value[0] == pytest.approx(peak_forces(stronger, 0.0)[0])
    assert second.value[0] > 1.5 * first.value[0]


@pytest.mark.property
def test_findings_of_the_sweep_are_read(tmp_path: Path) -> None:
    known = ("velocity", "displacement", "acceleration", "both", "past", "layers", "neurons")
    rows = [
        {"name": name, "change": 0.5, "uncertainty": 0.2, "reference": "a", "alternative": "b", "verdict": "holds"}
        for name in known
    ]
    rows[1] = {**rows[1], "change": -0.3}
    rows[2] = {**rows[2], "change": -0.15}
    rows[6] = {**rows[6], "verdict": "not tested"}
    found = _sweep(_artifact(tmp_path / "sweep.h5", findings=rows, choice={"hidden": [6, 6]}))
    assert found["F2-velocity"] == Value(0.5, "sweep of this run", "a against b: +50 %, uncertainty 20 %")
    assert isinstance(found["F2-displacement"], Value) and found["F2-displacement"].value == -0.3
    # a change within its uncertainty is none
    assert isinstance(found["F2-acceleration"], Value) and found["F2-acceleration"].value == 0.0
    assert isinstance(found["F2-neurons"], Missing)
    assert isinstance(found["A22b"], Value) and found["A22b"].value == "6-6"


@pytest.mark.property
def test_absolute_values_are_compared_like_for_like(tmp_path: Path) -> None:
    kept = {"nrmse": {"absolute": 0.04, "signed": 0.05}, "negative_share": {"absolute": 0.01, "signed": 0.0}}
    found = _signed(_artifact(tmp_path / "inverse.h5", signed=kept))
    assert isinstance(found["F2-absolute"], Value) and found["F2-absolute"].value == pytest.approx(0.8)
    assert isinstance(found["F2-negative"], Missing)
    assert isinstance(_signed(_artifact(tmp_path / "other.h5", other=1))["F2-absolute"], Missing)


@pytest.mark.property
def test_responses_of_the_run_count_at_the_frequency_of_the_table(tmp_path: Path) -> None:
    at = {"kind": "harmonic", "frequency_rad_s": 8.0}
    good = _artifact(tmp_path / "a.h5", excitation=at, indices={"rms_x5_m": 0.02})
    assert _response_indices(good) == {"rms_x5_m": 0.02}
    other = _artifact(tmp_path / "b.h5", excitation={**at, "frequency_rad_s": 9.0}, indices={})
    assert "9.00 rad/s" in str(_response_indices(other))
    swept = _artifact(tmp_path / "c.h5", excitation={"kind": "sweep"}, indices={})
    assert "sweep" in str(_response_indices(swept))


@pytest.mark.property
def test_peaks_of_cycles_are_those_of_a_known_motion(bench: Bench) -> None:
    from types import SimpleNamespace

    excitation = excite(1.0, 8.0, cycles=10, decay_s=0.0)
    time = np.arange(0.0, 8.5, 1e-3)
    cycle = np.floor(time * 8.0 / (2.0 * np.pi))
    x = (1.0 + 0.1 * (cycle % 2)) * np.sin(8.0 * time)
    floors = np.column_stack([x, 2.0 * x])
    response = SimpleNamespace(time_s=time, displacement=floors, acceleration=-64.0 * floors)
    found = cycle_peaks(SimpleNamespace(response=response, excitation=excitation, indices={}))  # type: ignore[arg-type]
    # five steady cycles: numbers 5 to 9, of which three are the larger ones
    wanted = np.sqrt((3.0 * 1.1**2 + 2.0) / 5.0)
    assert found["peak_x1_m"] == pytest.approx(wanted, rel=1e-3)
    assert found["peak_a5_m_s2"] == pytest.approx(128.0 * wanted, rel=1e-3)


@pytest.mark.property
def test_page_holds_every_claim_and_keeps_kinds_apart(ledger: Ledger) -> None:
    text = page.markdown(ledger)
    for claim in ledger.claims:
        if claim.entry.kind != "table":
            assert f"| {claim.id} |" in text, claim.id
    assert "## Checks of this project" in text and "### Table 4.1" in text
    again = json.loads(json.dumps([claim.as_dict() for claim in ledger.claims], allow_nan=False))
    assert {"id", "chapter", "what", "printed", "recomputed", "tolerance", "verdict", "why"} <= set(again[0])
    by_kind = page.counts_by_kind(ledger.claims)
    assert sum(found["all"] for found in by_kind.values()) == len(ledger.claims)
    assert page.counts_by_table(ledger.claims)["Table 4.1"]["all"] == 16
    assert len(page.deviation_figure(ledger.claims).axes) == 1


def _case(damper: str, where: str, factor: float) -> Case:
    from mrpipe.thesis.entries import INDICES, printed_columns

    printed = printed_columns("Table 5.1", "T5.1m")
    reading = Reading(0.1, 0.2, 0.15, (0.1, -0.05, 0.02))
    values = {law: {row: factor * printed[law][row] for row in INDICES} for law in LAWS}
    return Case(damper, where, 0.7, dict.fromkeys(LAWS, 9.0), values, dict.fromkeys(LAWS, reading))


@pytest.mark.property
def test_table_5_1_is_explained_by_the_errors_of_the_cases() -> None:
    made = [
        _case(table51.PERFECT, table51.AT_ONE, 1.0),
        _case(table51.PRINTED_DAMPER, table51.AT_ONE, 1.0),
        _case(table51.PLAIN, table51.AT_ONE, np.exp(0.4)),
        _case(table51.PLAIN, table51.AT_VD, np.exp(0.25)),
        _case(table51.PLAIN, table51.AT_OWN, np.exp(0.2)),
        _case(table51.TRACED, table51.AT_ONE, np.exp(0.3)),
        _case(table51.TRACED, table51.AT_OWN, np.exp(0.1)),
    ]
    cases = {case.name: case for case in made}
    assert table51.mean_log_error(cases[f"{table51.PLAIN}, {table51.AT_OWN}"], "T5.1m") == pytest.approx(0.2)
    said = " ".join(table51_page.words(cases))
    assert "(+50 % explained)" in said and "(+75 % explained)" in said
    rows = table51_page.error_rows(cases)
    errors = [row["all"] for row in rows if row["column"] == "measured column"]
    assert errors == ["0.400", "0.250", "0.200", "0.300", "0.100"]
    assert len(table51_page.damping_rows(cases)) == 4 * (2 + len(cases))
    assert len(table51_page.figure(cases).axes) == 8
    assert any("Table 5.1 explained" in line for line in table51_page.markdown(cases))


@pytest.mark.property
def test_resonances_of_the_ledger_do_not_depend_on_their_grid(bench: Bench) -> None:
    """Accelerations at a resonance go with the square of its frequency: 1 % of frequency would be 2 % of a5."""
    fine = replace(table51.CURVE, points=37, frequency_tolerance=5e-4, tolerance=2e-3)
    for law in ("vd", "vdps"):
        run = runner(bench.rig, bench.rig.controller(law), np.random.default_rng(0))
        first, second = (
            response_curve(run, 0.57, table51.band_of(bench.rig), options) for options in (table51.CURVE, fine)
        )
        assert first.resonance_rad_s == pytest.approx(second.resonance_rad_s, rel=5e-3)
        assert first.peak("rms_x_top_m") == pytest.approx(second.peak("rms_x_top_m"), rel=5e-3)


@pytest.mark.literature
def test_closed_loop_of_the_sets(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """Chapter 5 on a coarse grid: errata section B holds, and the tables have their values."""
    from mrpipe.simulation.steady_state import CurveOptions
    from mrpipe.thesis import chapter5

    coarse = CurveOptions(
        points=5, settling_cycles=4, window_cycles=2, tolerance=0.05, most_cycles=12, frequency_tolerance=0.05
    )
    monkeypatch.setattr(table51, "CURVE", coarse)
    monkeypatch.setattr(chapter5, "C_VALUES", (450.0, 650.0, 850.0))
    monkeypatch.setattr(chapter5, "ALPHA_VALUES", (2400.0, 3000.0, 3600.0))
    found = build_ledger(bench, frame_from_parameter_set("thesis"), chapters=(5,))
    asserted = ["B12", "B13", "B14", "B15", "A13b", "A14b"]
    asserted += [f"B-{kind}-{law}" for kind in ("ideal", "set-c") for law in LAWS]
    assert {name: found.claim(name).why for name in asserted if found.claim(name).verdict != "holds"} == {}
    numbers = [claim for claim in found.claims if claim.entry.kind == "table"]
    assert len(numbers) == 40
    assert sum(claim.recomputed is not None for claim in numbers) == 38
    assert found.claim("A13a").verdict == "differs"
    assert found.claim("F5-vdps-simulated").verdict == "holds"
    # nothing was traced without a run
    assert found.claim("F5-residual").verdict == "cannot-be-recomputed"


@pytest.mark.real
@pytest.mark.literature
def test_benchmarks_with_public_data(bench: Bench, public_data: Path) -> None:
    short = CaseOptions(wind_duration_s=40.0, climate=WindClimate())
    found = build_ledger(bench, frame_from_parameter_set("thesis"), short, chapters=(6,))
    numbers = [claim for claim in found.claims if claim.entry.kind == "table"]
    assert len(numbers) == 96 and all(claim.recomputed is not None for claim in numbers)
    assert found.claim("A19").recomputed == pytest.approx([0.01] * 5, rel=1e-3)
    assert found.claim("T6-frequencies").verdict == "holds"
    assert found.claim("A20a").recomputed < 0.1
    # the bearings of the thesis are linear, so that the table is computed and not said to be out of reach
    assert "linear bearings" in found.claim("T6.2-vd-J1").by


@pytest.mark.property
def test_without_public_data_surrogates_stand_in_and_say_so(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    from mrpipe.thesis import chapter6

    monkeypatch.setattr(chapter6, "public_data_directory", lambda: None)
    found = build_ledger(bench, frame_from_parameter_set("thesis"), CaseOptions(wind_duration_s=40.0), chapters=(6,))
    numbers = [claim for claim in found.claims if claim.entry.kind == "table"]
    assert sum(claim.recomputed is not None for claim in numbers) == 84
    assert "surrogate" in found.claim("T6.2-vd-J1").by and "surrogate" in found.claim("T6.3-vd-J1").by
    assert "public data" in found.claim("P4-T2-vd-J1").why
    assert found.claim("A19").verdict == "cannot-be-recomputed"
    assert found.claim("A16a").verdict == "differs" and found.claim("A18b").verdict == "holds"


@pytest.mark.property
def test_a_frame_that_does_not_exist_is_a_mistake_of_the_user() -> None:
    with pytest.raises(UserError, match="no such parameter set"):
        frame_from_parameter_set("thesys")


@pytest.mark.property
def test_units_follow_from_the_terms_that_they_stand_in() -> None:
    assert [unit_of_gamma(n) for n in (1, 2, 3)] == ["1/m^1", "1/m^2", "1/m^3"]
    assert unit_of_command("kN/A", "kN") == "A" and unit_of_command("kN*s/m/V", "kN*s/m") == "V"
    assert unit_of_command("kN/V", "kN") == "V"
