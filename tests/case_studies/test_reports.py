"""Summary and report of the three structures on short motions: every law, index and figure, consistent numbers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.artifacts.plain import plain
from mrpipe.case_studies.base_isolated import report as isolated
from mrpipe.case_studies.base_isolated.structure import surrogate_building
from mrpipe.case_studies.base_isolated.study import capacity_sensitivity, isolation_study, run_cases
from mrpipe.case_studies.motion import spectrum_compatible_motion
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.run import BinghamDevice
from mrpipe.case_studies.ten_storey import report as ten_storey_report
from mrpipe.case_studies.ten_storey.structure import ten_storey
from mrpipe.case_studies.ten_storey.study import ten_storey_study
from mrpipe.case_studies.wind import report as wind
from mrpipe.case_studies.wind.load import synthetic_wind
from mrpipe.case_studies.wind.structure import HEIGHT_M, WIDTH_M, place_device, surrogate_tower
from mrpipe.case_studies.wind.study import run_wind_cases, wind_response, wind_sensitivity, wind_study
from mrpipe.dampers.model import damper_from_parameter_set
from tests.case_studies.section import Kept

pytestmark = pytest.mark.golden

LAWS = ("vd", "passive-on")
PRINTED = {"vd": {"J1": 0.5, "J2": 0.6}}


def _checked(summary: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = plain(summary)
    json.dumps(found)
    assert found["energy_balance_error"] < 0.02
    assert found["thesis"] == PRINTED
    assert np.array(found["periods_s"]) * np.array(found["frequencies_hz"]) == pytest.approx(1.0)
    assert set(found["laws"]) == set(LAWS)
    return found


def test_ten_storeys() -> None:
    motion = spectrum_compatible_motion(np.random.default_rng(11), duration_s=6.0)
    chain = damper_from_parameter_set(load_parameter_set("dampers", "p4-1000kn")).chain()
    study = ten_storey_study(ten_storey("ten-storey-heavy"), motion, device=BinghamDevice(), chain=chain)
    studies = {"heavy": (study, study.cases(LAWS))}
    sweep = study.sensitivity(LAWS, (0.5, 1.0))
    found = _checked(ten_storey_report.summary(studies, sweep, PRINTED))
    # constant voltages have one variant, laws all
    assert set(found["variants"]["heavy"]["ideal"]) == {"vd"}
    assert set(found["absolute_acceleration"]) == {"filtered/vd", "unfiltered/vd", "clipped/vd", "ideal/vd",
                                                   "filtered/passive-on"}  # fmt: skip
    assert found["sensitivity"]["1"] == pytest.approx(found["laws"]["vd"])
    assert set(found["gains"]) == {"vd"} and found["gains"]["vd"]["c_n_s_m"] > 0.0
    sink = Kept()
    ten_storey_report.describe(sink, studies, sweep, PRINTED)
    assert {"top-floor", "floors", "loops", "indices", "sensitivity"} == set(sink.figures)
    assert sink.tables["sensitivity"]["dampers"].tolist() == [0.5, 1.0]
    assert "heavy-filtered" in sink.tables


def test_base_isolated_building() -> None:
    motion = spectrum_compatible_motion(np.random.default_rng(8), duration_s=6.0)
    study = isolation_study(
        surrogate_building(), device=BinghamDevice(), network=None, damping_ratio=0.1, stiffness_share=0.2,
        lqg=LqgWeights(),
    )  # fmt: skip
    free, cases = run_cases(study, motion, LAWS)
    sweep = capacity_sensitivity(study, motion, "vd", (1.0, 3.0))
    motions = {motion.name: {case.law: {**case.indices, **case.summary} for case in cases}}
    result = isolated.IsolationResult(study, motion, free, cases, motions, "vd", sweep, None)
    found = _checked(isolated.summary(result, PRINTED))
    assert found["sensitivity"]["law"] == "vd" and set(found["sensitivity"]) == {"law", "1", "3"}
    assert found["runs"]["vd"]["peak_force_n"] == pytest.approx(np.abs(cases[0].response.forces).max())
    assert found["isolated_period_s"] > found["fixed_base_periods_s"][0]
    sink = Kept()
    isolated.describe(sink, result, PRINTED)
    tops = {f"top-{word}-{axis}" for word in ("acceleration", "displacement") for axis in "xy"}
    assert tops | {"force-diagram", "indices", "floors", "loops", "motion", "sensitivity"} == set(sink.figures)
    assert len(sink.tables["motions"]) == len(LAWS)


def test_tower_in_wind() -> None:
    load = synthetic_wind(np.random.default_rng(4), 76, HEIGHT_M, WIDTH_M, duration_s=20.0)
    tower = surrogate_tower()
    placed = place_device(tower, "outrigger", floor=40, arm_m=21.0, mass_kg=500e3, frequency_ratio=0.99)
    study = wind_study(
        tower, placed, load, device=BinghamDevice(), network=None, stiffness_share=0.5, tuned_mass_kg=500e3,
        lqg=LqgWeights(displacement=1000.0, acceleration=10.0, force_n=1e6, interval_s=0.001), dampers=4.0,
    )  # fmt: skip
    cases = run_wind_cases(study, LAWS)
    sweep = wind_sensitivity(study, "vd", (2.0, 4.0))
    result = wind.WindResult(study, cases, "vd", sweep, None)
    found = _checked(wind.summary(result, PRINTED))
    free = wind_response(study.uncontrolled)
    assert found["uncontrolled"]["peak_x76_m"] == pytest.approx(np.abs(free.displacement_m[:, -1]).max())
    assert found["uncontrolled"]["rms_x76_m"] < found["uncontrolled"]["peak_x76_m"]
    assert found["sensitivity"]["4"]["J1"] == pytest.approx(found["laws"]["vd"]["J1"])
    sink = Kept()
    wind.describe(sink, result, PRINTED)
    expected = {"force-diagram", "top-displacement", "top-acceleration", "floors", "loops", "indices", "sensitivity"}
    assert expected == set(sink.figures)
