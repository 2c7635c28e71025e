"""Joint factors on the gains of several dampers, on responses whose minimum is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named
from mrpipe.law_design import several_dampers
from mrpipe.law_design.confirmation import OtherStarts
from mrpipe.law_design.objective import Evaluation, Load, Objective
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.several_dampers import design_as_json, design_dampers
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.simulation.windows import QUANTITIES

pytestmark = pytest.mark.property

LOAD = Load((5.0, 9.0), (0.8,))


def _rig(*laws: tuple[str, str, Gains]) -> SimpleNamespace:
    dampers = [SimpleNamespace(known=SimpleNamespace(name=name, law=law), gains=gains) for name, law, gains in laws]

    def gains(factors: dict[str, float]) -> list[Gains]:
        return [law_named(item.known.law).scaled(item.gains, factors.get(item.known.name, 1.0)) for item in dampers]

    return SimpleNamespace(dampers=dampers, gains=gains, loop_dampers=gains)


RIG = _rig(("below", "vd", Gains(400.0)), ("above", "fdns", Gains(alpha_n_m=900.0)), ("off", "passive-off", Gains()))


@pytest.fixture(autouse=True)
def starts(monkeypatch: pytest.MonkeyPatch) -> None:
    found = OtherStarts(6.0, np.array([1.0, 1.05]), 0.0)
    monkeypatch.setattr(several_dampers, "other_starts", lambda run, best, options: found)


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[Gains]:
    """Replace the loop by a response that is smallest at the factors 0.5 and 1.5."""
    tried: list[Gains] = []

    def evaluate(
        _: object, law: str, gains: Gains, load: Load, objective: Objective, options: CurveOptions
    ) -> Evaluation:
        tried.append(gains)
        top = 1.0 + np.log(gains["below"] / 0.5) ** 2 + 2.0 * np.log(gains["above"] / 1.5) ** 2
        values = np.tile([top if name == "rms_x_top_m" else 0.01 for name in QUANTITIES], (2, 1))
        curve = ResponseCurve(0.8, np.array([6.0, 7.0]), values, np.zeros_like(values), np.array([True, True]))
        found = Evaluation(law, gains, (curve,), {})
        return replace(found, value=objective.value(found.peaks))

    monkeypatch.setattr(several_dampers, "evaluate", evaluate)
    monkeypatch.setattr(several_dampers, "reference_evaluation", lambda run, law, gains, load, options: evaluate(
        run, law, gains, load, Objective({}), options
    ))  # fmt: skip
    return tried


SETTINGS = DesignSettings(weights={"rms_x_top_m": 1.0}, evaluations=40)


def test_the_factors_of_the_smallest_response_are_found(seen: list[Gains]) -> None:
    found = design_dampers(RIG, SETTINGS, LOAD, absolute=False, seed=1)  # type: ignore[arg-type]
    best = found.designed.best
    assert best.gains["below"] == pytest.approx(0.5, rel=0.05)
    assert best.gains["above"] == pytest.approx(1.5, rel=0.05)
    assert best.value < found.designed.calibrated.value == pytest.approx(1.0)
    # a damper without a gain has no factor
    assert set(seen[0]) == {"below", "above"} | set(Gains())


def test_the_json_gives_factors_and_gains(seen: list[Gains]) -> None:
    shown = design_as_json(RIG, design_dampers(RIG, SETTINGS, LOAD, absolute=False, seed=1))  # type: ignore[arg-type]
    below, off = shown["dampers"]["below"], shown["dampers"]["off"]
    assert below["gains"]["c_n_s_m"] == pytest.approx(400.0 * below["factor"])
    assert below["calibrated_gains"]["c_n_s_m"] == 400.0
    assert off["factor"] == 1.0 and off["gains"] == {}
    assert shown["improvement"] == pytest.approx(1.0 - shown["best"]["objective"])
    assert shown["evaluations"] == len(seen) - 2
    assert shown["exceeds_limits"] == {}
    assert shown["starts"] == {"frequency_rad_s": 6.0, "rms_x_top_m": [1.0, 1.05], "differ": True}


def test_a_limit_that_no_gain_keeps_is_reported_with_its_excess(seen: list[Gains]) -> None:
    tight = DesignSettings(weights={"rms_x_top_m": 1.0}, evaluations=3, stroke_limit_m=0.008, force_limit_n=0.02)
    found = design_dampers(RIG, tight, LOAD, absolute=False, seed=1)  # type: ignore[arg-type]
    shown = design_as_json(RIG, found)  # type: ignore[arg-type]
    assert shown["exceeds_limits"] == {"max_stroke_m": pytest.approx(0.25)}


def test_without_gains_the_calibration_stays(seen: list[Gains], monkeypatch: pytest.MonkeyPatch) -> None:
    rig = _rig(("below", "passive-off", Gains()))
    monkeypatch.setattr(several_dampers, "reference_evaluation", lambda *_: Evaluation("x", Gains(), (
        ResponseCurve(0.8, np.array([6.0]), *np.ones((2, 1, len(QUANTITIES))), np.array([True])),
    ), {}))  # fmt: skip
    found = design_dampers(rig, SETTINGS, LOAD, absolute=False, seed=1)  # type: ignore[arg-type]
    assert found.designed.best is found.designed.calibrated and seen == []
