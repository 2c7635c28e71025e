"""The objective: weighted largest responses, and designs that exceed a limit give way to designs that keep it."""

from __future__ import annotations

import math

import pytest

from mrpipe.control.gains import Gains
from mrpipe.law_design.objective import UNACCEPTABLE, Known, Limits, Load, Objective, evaluate
from mrpipe.law_design.options import DesignSettings
from mrpipe.simulation.steady_state import CurveOptions
from tests.simulation.test_steady_state import Loop, smooth

pytestmark = pytest.mark.property

PEAKS = {"rms_x_top_m": 0.02, "max_base_shear_n": 300.0, "max_stroke_m": 0.011, "max_force_n": 50.0, "rms_drive": 1.0}
REFERENCE = {"rms_x_top_m": 0.04, "max_base_shear_n": 200.0}


def test_quantities_of_different_units_are_weighted_relative_to_the_reference() -> None:
    found = Objective({"rms_x_top_m": 1.0, "max_base_shear_n": 0.5}, REFERENCE)
    assert found.value(PEAKS) == pytest.approx(0.5 + 0.5 * 1.5)


def test_a_response_without_bound_has_a_finite_value() -> None:
    assert Objective({"rms_x_top_m": 1.0}, REFERENCE).value({**PEAKS, "rms_x_top_m": math.inf}) == UNACCEPTABLE


@pytest.mark.parametrize(
    ("setting", "quantity", "limit"),
    [
        ("stroke_limit_m", "max_stroke_m", 0.01),
        ("force_limit_n", "max_force_n", 40.0),
        ("rms_drive_limit", "rms_drive", 0.8),
    ],
)
def test_each_limit_of_the_settings_is_kept_at_a_small_price(setting: str, quantity: str, limit: float) -> None:
    limits = Limits.of(DesignSettings(**{setting: limit}))
    assert limits.excess(PEAKS) == {quantity: pytest.approx(PEAKS[quantity] / limit - 1.0)}
    objective = Objective({"rms_x_top_m": 1.0}, REFERENCE, limits)
    # a design at the limit is preferred although its response is half as large again
    kept = {**PEAKS, quantity: limit, "rms_x_top_m": 1.5 * PEAKS["rms_x_top_m"]}
    assert limits.excess(kept) == {quantity: 0.0}
    assert objective.value(kept) < objective.value(PEAKS)


def test_without_limits_nothing_is_exceeded() -> None:
    assert Limits.of(DesignSettings()).excess({}) == {}


def test_a_loop_is_not_run_again_under_the_same_conditions() -> None:
    loop, known, objective = Loop(smooth, 0.0), Known(), Objective({"rms_x_top_m": 1.0})
    options = CurveOptions(points=9, refined=("rms_x_top_m",))

    def runs_for(gain: float, amplitudes: tuple[float, ...], options: CurveOptions) -> int:
        before = loop.runs
        load = Load((6.0, 12.0), amplitudes)
        found = evaluate(lambda law, gains: loop, "vd", Gains(gain), load, objective, options, known)
        assert found.peaks["rms_x_top_m"] == pytest.approx(1.0, abs=1e-3)
        return loop.runs - before

    first = runs_for(1.0, (0.8,), options)
    assert runs_for(1.0, (0.8,), options) == 0
    # the same frequencies serve the maxima of other quantities; another amplitude, gain or accuracy does not
    assert runs_for(1.0, (0.4, 0.8), CurveOptions(points=9)) <= first + 4
    assert runs_for(2.0, (0.8,), options) == first
    assert runs_for(1.0, (0.8,), CurveOptions(points=9, tolerance=1e-3, refined=("rms_x_top_m",))) == first
