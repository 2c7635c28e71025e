"""Search, accurate check and comparison of laws, on loops whose response is a formula."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from mrpipe.artifacts import no_progress
from mrpipe.control.gains import Gains
from mrpipe.errors import DivergedError
from mrpipe.law_design import study
from mrpipe.law_design.kept import Kept, LawUnderDesign
from mrpipe.law_design.objective import Evaluation, Load, Objective
from mrpipe.law_design.search import FreeGain, SearchOptions
from mrpipe.law_design.study import COARSE, Loops, design_all, design_law, pareto_front, reference_evaluation
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.simulation.windows import QUANTITIES

pytestmark = pytest.mark.property

LOAD = Load((5.0, 9.0), (0.4, 0.8))
FINAL = CurveOptions(points=15, tolerance=5e-3)
OBJECTIVE = Objective({"rms_x_top_m": 1.0})
VISCOSITY = FreeGain("c_n_s_m", 10.0, 10000.0)


def _evaluation(law: str, gains: Gains, peaks: dict[str, float]) -> Evaluation:
    values = np.tile([peaks.get(name, 1.0) for name in QUANTITIES], (2, 1))
    curve = ResponseCurve(0.8, np.array([6.0, 7.0]), values, np.zeros_like(values), np.array([True, True]))
    return Evaluation(law, gains, (curve,), {}, OBJECTIVE.value({"rms_stroke_m": 0.0, **peaks}))


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Load, CurveOptions]]:
    """Replace the loops by formulas; return what was evaluated. A `run_of` is here the best gain."""
    seen: list[tuple[str, Load, CurveOptions]] = []

    def evaluate(
        best: float, law: str, gains: Gains, load: Load, objective: Objective, options: CurveOptions, *_: object
    ) -> Evaluation:
        seen.append((law, load, options))
        return _evaluation(law, gains, {"rms_x_top_m": 1.0 + np.log(gains.c_n_s_m / best) ** 2})

    monkeypatch.setattr(study, "evaluate", evaluate)
    return seen


def _design(accurate: float, searched: float, start: float) -> study.Designed:
    entry = LawUnderDesign("vd", Gains(start), (VISCOSITY,), "vd")
    loops = Loops(accurate, searched)  # type: ignore[arg-type]
    return design_law(loops, entry, LOAD, OBJECTIVE, SearchOptions(), FINAL)


def test_the_accurate_loop_decides_where_the_coarse_one_is_off(calls: list) -> None:
    found = _design(accurate=600.0, searched=700.0, start=100.0)
    assert found.best.gains.c_n_s_m == pytest.approx(600.0, rel=0.03)
    assert found.calibrated.gains.c_n_s_m == 100.0
    assert all(options.tolerance == COARSE.tolerance for _, _, options in calls[1:-20])
    # the search sees the largest amplitude alone, the result both
    assert calls[1][1].amplitudes_m_s2 == (0.8,) and calls[-1][1] == LOAD


def test_calibrated_gains_stay_if_the_search_finds_nothing_better(calls: list) -> None:
    # the coarse loop misleads by more than the second search looks around
    found = _design(accurate=100.0, searched=5000.0, start=100.0)
    assert found.best is found.calibrated


def test_a_law_without_free_gains_is_evaluated_once(calls: list) -> None:
    entry = LawUnderDesign("passive-on", Gains(1.0), (), "passive-on")
    found = design_law(Loops(1.0, 1.0), entry, LOAD, OBJECTIVE, SearchOptions(), FINAL)  # type: ignore[arg-type]
    assert found.best is found.calibrated and not found.tried and len(calls) == 1


def test_results_come_in_the_order_of_the_laws_and_are_kept(calls: list, tmp_path) -> None:
    entries = [
        LawUnderDesign("passive-on", Gains(1.0), (), "passive-on"),
        LawUnderDesign("vd", Gains(100.0), (VISCOSITY,), "vd"),
    ]
    loops = Loops(600.0, 600.0)  # type: ignore[arg-type]
    options = (SearchOptions(), FINAL)
    for repeat in range(2):
        found = design_all(loops, entries, LOAD, OBJECTIVE, options, Kept(tmp_path, "a"), 2, no_progress)
        assert list(found) == ["passive-on", "vd"]
        assert found["vd"].best.gains.c_n_s_m == pytest.approx(600.0, rel=0.03)
        if repeat == 0:
            count = len(calls)
    assert len(calls) == count


def test_an_unstable_reference_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def unstable(*_: object) -> Evaluation:
        return _evaluation("vd", Gains(1.0), {"rms_x_top_m": math.inf})

    monkeypatch.setattr(study, "evaluate", unstable)
    run_of: Callable = None  # type: ignore[assignment]
    with pytest.raises(DivergedError, match="under law vd is unstable"):
        reference_evaluation(run_of, "vd", Gains(1.0), LOAD, FINAL)


def test_the_front_leaves_out_what_another_design_beats() -> None:
    pairs = [(1.0, 9.0), (2.0, 5.0), (2.0, 4.0), (3.0, 4.5), (4.0, 1.0), (math.inf, 0.5)]
    items = [_evaluation("vd", Gains(1.0), {"rms_x_top_m": x, "rms_a_top_m_s2": a}) for x, a in pairs]
    front = [(item.peaks["rms_x_top_m"], item.peaks["rms_a_top_m_s2"]) for item in pareto_front(items)]
    assert front == [(1.0, 9.0), (2.0, 4.0), (4.0, 1.0)]
