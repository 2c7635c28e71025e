"""Results of an interrupted design are used again, but only for the same problem."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mrpipe.control.gains import Gains
from mrpipe.law_design.kept import Designed, Kept, LawUnderDesign
from mrpipe.law_design.objective import Evaluation
from mrpipe.law_design.search import FreeGain
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.windows import QUANTITIES

ENTRY = LawUnderDesign("vd", Gains(650.0), (FreeGain("c_n_s_m", 10.0, 2000.0),), "vd")


def evaluation(c: float, peak: float) -> Evaluation:
    values = np.full((2, len(QUANTITIES)), peak)
    curve = ResponseCurve(0.79, np.array([8.0, 9.0]), values, 0.01 * np.ones_like(values), np.array([True, False]))
    return Evaluation("vd", Gains(c), (curve,), {"quake": dict.fromkeys(QUANTITIES, 0.02)}, 0.9)


FOUND = Designed(ENTRY, evaluation(624.0, 0.03), evaluation(650.0, 0.031), (evaluation(10.0, math.inf),))


@pytest.mark.property
def test_what_was_written_is_read(tmp_path: Path) -> None:
    kept = Kept(tmp_path / "kept", "a problem")
    assert kept.read(ENTRY) is None
    kept.write(FOUND)
    again = kept.read(ENTRY)
    assert again is not None
    assert again.best.gains == Gains(624.0)
    assert again.best.peaks["rms_x_top_m"] == 0.03
    assert math.isinf(again.tried[0].peaks["rms_x_top_m"])
    np.testing.assert_array_equal(again.best.curves[0].steady, [True, False])
    assert again.best.curves[0].peak_error("rms_x_top_m") == 0.01
    kept.clear()
    assert not (tmp_path / "kept").exists()


@pytest.mark.property
def test_another_problem_and_a_damaged_file_are_computed_again(tmp_path: Path) -> None:
    kept = Kept(tmp_path, "a problem")
    kept.write(FOUND)
    assert Kept(tmp_path, "another problem").read(ENTRY) is None
    other = LawUnderDesign("vd", Gains(650.0), (FreeGain("c_n_s_m", 10.0, 900.0),), "vd")
    assert kept.read(other) is None
    next(tmp_path.glob("*.json")).write_text("{", encoding="utf-8")
    assert kept.read(ENTRY) is None


@pytest.mark.property
def test_nothing_is_kept_without_a_folder() -> None:
    kept = Kept()
    kept.write(FOUND)
    assert kept.read(ENTRY) is None
    kept.clear()
