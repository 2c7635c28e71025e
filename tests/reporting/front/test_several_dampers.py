"""Several dampers in the report: laws, damping together, forces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from mrpipe.reporting.facts import ReportStage, RunFacts
from mrpipe.reporting.front import laws, several_dampers
from mrpipe.reporting.front.sections import sections
from mrpipe.reporting.headlines import headline

pytestmark = pytest.mark.property

CALIBRATED = {
    "dampers": [
        {"name": "base", "law": "vd", "gains": {"c_n_s_m": 5.9e6}},
        {"name": "roof", "law": "vdps", "gains": {"c_n_s_m": 6.5e6, "k_n_m": 2e6}},
    ],
    "together": {"modes": [1, 2], "damping_ratios": [0.106, 0.035], "stable": True},
}
_ONE = {
    "law": "vd", "rms_damper_displacement_m": 0.0018, "peak_damper_displacement_m": 0.009, "rms_force_n": 76932.0,
    "peak_force_n": 494059.0, "force_tracking_nrmse": 0.71,
}  # fmt: skip
SIMULATED = {
    "rms_x_top_m": 0.0198, "rms_x1_m": 0.0018, "rms_a1_m_s2": 1.36,
    "dampers": [{**_ONE, "name": "base"}, {**_ONE, "name": "roof", "law": "vdps"}],
}  # fmt: skip


def facts_of(folder: Path) -> RunFacts:
    stages = [("calibrate", CALIBRATED), ("simulate-dampers", SIMULATED)]
    return RunFacts(folder, "tower", "", [ReportStage(name, "", [], summary, [], "", 1.0) for name, summary in stages])


def test_the_report_states_laws_damping_and_forces_of_each_damper(tmp_path: Path) -> None:
    """The page showed neither, and its lines were `omega_0 - rad/s, 0 laws` and `damping ratio -`."""
    facts = facts_of(tmp_path)
    text = several_dampers.answer(facts)
    assert text.startswith("2 dampers: base (law vd) and roof (law vdps).")
    assert "11 % in mode 1 and 3.5 % in mode 2" in text
    found = several_dampers.rows(facts)
    assert [row["k [kN/m]"] for row in found] == ["-", "2000"] and found[0]["rms force [kN]"] == "76.9"
    control = next(section for section in sections(facts) if section.anchor == "control")
    assert any(item["kind"] == "table" and item["name"] == "dampers" for item in control.items)


def test_dampers_that_are_too_weak_for_their_laws_are_named(tmp_path: Path) -> None:
    facts = facts_of(tmp_path)
    calibrate, *others = facts.stages
    demand = {"largest_force_n": 1217152.0, "exceeds_damper": True, "limited_by_residual_force": False}
    dampers = [{**item, "force_demand": demand} for item in CALIBRATED["dampers"]]
    facts = RunFacts(tmp_path, "tower", "", [replace(calibrate, summary={**CALIBRATED, "dampers": dampers}), *others])
    found = " ".join(laws.doubts(facts))
    assert "base and roof need more force than the damper gives at the stroke of the calibration (1.22 MN)" in found


def test_the_lines_of_the_appendix_name_the_dampers() -> None:
    assert headline("calibrate", CALIBRATED) == "base with vd, roof with vdps: damping ratio 0.106 in the first mode"
    assert headline("simulate-dampers", SIMULATED).endswith("rms force of base 76.9 kN, roof 76.9 kN")
