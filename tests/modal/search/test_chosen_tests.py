"""Which tests the modes are fitted to: training tests first, validation tests only where they are needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.modal.clocks.delays import SensorClock, corrected
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.chosen_tests import _estimated, choose_tests, training_first, with_clocks, without_complex
from mrpipe.modal.search.selection import Layout
from mrpipe.structures import complex_modes
from tests.modal.rig import Rig, random_frame, sweep_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3)
MASSES = np.diag(FRAME.mass)
LAYOUT = Layout(3, MASSES)
RIG = Rig(noise=0.01, rate=100.0, sweep_s=80.0)
OPTIONS = IdentificationOptions()


def _sweep(name: str, role: str, seed: int = 1) -> FrameTest:
    return replace(sweep_test(FRAME, np.random.default_rng(seed), RIG), name=name, role=role)


def _noise(name: str, role: str) -> FrameTest:
    """Return a test that shows no mode at all."""
    rng, like = np.random.default_rng(9), _sweep("a", "training")
    return replace(
        like, name=name, role=role, kind="random", excitation=rng.standard_normal(like.responses.shape[0]),
        responses=rng.standard_normal(like.responses.shape),
    )  # fmt: skip


def _tests(*forced: FrameTest) -> FrameTests:
    return FrameTests(forced, (), MASSES, Path("campaign.yaml"))


def test_validation_tests_come_last_and_the_order_stays() -> None:
    tests = (_sweep("v", "validation"), _sweep("a", "training"), _sweep("b", "repeat"))
    assert [test.name for test in training_first(tests)] == ["a", "b", "v"]


def test_a_good_training_test_is_enough() -> None:
    forced = (_sweep("a", "training"), _sweep("v", "validation", 2))
    chosen, notes = choose_tests(forced, _tests(*forced), LAYOUT, OPTIONS)
    assert [test.name for test in chosen.tests] == ["a"] and notes == []
    assert chosen.search.fit.angular_frequencies == pytest.approx(complex_modes(FRAME).angular_frequencies, rel=2e-3)
    assert without_complex(chosen.search) is chosen.search


def test_validation_tests_are_used_where_the_others_show_no_modes_and_this_is_said() -> None:
    low = replace(sweep_test(FRAME, np.random.default_rng(1), replace(RIG, top_hz=4.0)), name="a")
    forced = (low, _sweep("v", "validation", 2))
    chosen, notes = choose_tests(forced, _tests(*forced), LAYOUT, OPTIONS)
    assert "v" in {test.name for test in chosen.tests}
    assert notes == ["modes are weak in the training tests: validation tests were used in the fit (v)"]


def test_a_campaign_without_modes_is_refused() -> None:
    forced = (_noise("a", "training"),)
    with pytest.raises(UserError, match=r"no mode found.*kind: ambient"):
        choose_tests(forced, _tests(*forced), LAYOUT, OPTIONS)


def test_a_late_sensor_is_corrected_and_sensors_in_time_are_left() -> None:
    good = _sweep("a", "training")
    chosen, _ = choose_tests((good,), _tests(good), LAYOUT, OPTIONS)
    same, clocks = with_clocks(chosen, _tests(good), LAYOUT, OPTIONS)
    assert same is chosen and clocks == ()
    late = corrected(good, [SensorClock("a", good.sensors[1], -0.012, 0.0)])
    spoiled, _ = choose_tests((late,), _tests(late), LAYOUT, OPTIONS)
    moved, clocks = with_clocks(spoiled, _tests(late), LAYOUT, OPTIONS)
    assert {clock.sensor.floor: round(1e3 * clock.offset_s) for clock in clocks if not clock.is_zero} == {2: 12}
    error = np.abs(moved.tests[0].responses - good.responses)[50:-50, 1].max()
    assert error < 0.1 * np.abs(late.responses - good.responses)[50:-50, 1].max()


def test_steps_of_clocks_wait_until_all_modes_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mode that was not found disturbs a sweep from the time at which it is passed, as a step of the clock does."""
    forced = (_sweep("a", "training"),)
    chosen, _ = choose_tests(forced, _tests(*forced), LAYOUT, OPTIONS)
    incomplete = replace(
        chosen, search=replace(chosen.search, fit=chosen.search.fit.only([0, 1]), numbers=chosen.search.numbers[:2])
    )
    allowed = []

    def seen(fit: MultiModeFit, tests: Sequence[FrameTest], steps: bool = True) -> list[SensorClock]:
        allowed.append((fit.angular_frequencies.size, steps))
        return [SensorClock("a", tests[0].sensors[0], 1e-6, 1e-6)] if len(allowed) == 1 else []

    monkeypatch.setattr("mrpipe.modal.search.chosen_tests.estimate_clocks", seen)
    monkeypatch.setattr("mrpipe.modal.search.chosen_tests._imaginary_part", lambda *_: 1e6 - 1e3 * len(allowed))
    with_clocks(incomplete, _tests(*forced), LAYOUT, OPTIONS)
    assert allowed[0] == (2, False)
    assert (3, True) in allowed


def test_with_other_modes_clocks_are_estimated_again_from_the_records_as_measured(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A drift that was wrong because modes were missing would leave a rest that is neither a drift nor a step."""
    forced = (_sweep("a", "training"),)
    chosen, _ = choose_tests(forced, _tests(*forced), LAYOUT, OPTIONS)
    incomplete = replace(
        chosen, search=replace(chosen.search, fit=chosen.search.fit.only([0, 1]), numbers=chosen.search.numbers[:2])
    )
    as_measured: list[tuple[int, bool]] = []

    def seen(fit: MultiModeFit, tests: Sequence[FrameTest], steps: bool = True) -> list[SensorClock]:
        as_measured.append((fit.angular_frequencies.size, np.array_equal(tests[0].responses, forced[0].responses)))
        return [SensorClock("a", tests[0].sensors[0], 1e-3, 1e-6)] if len(as_measured) in (1, 3) else []

    monkeypatch.setattr("mrpipe.modal.search.chosen_tests.estimate_clocks", seen)
    monkeypatch.setattr("mrpipe.modal.search.chosen_tests._imaginary_part", lambda *_: 1e6 - 1e3 * len(as_measured))
    with_clocks(incomplete, _tests(*forced), LAYOUT, OPTIONS)
    # two rounds with two modes, then two with three modes; the first round of each sees the records as measured
    assert as_measured[:4] == [(2, True), (2, False), (3, True), (3, False)]


def test_clocks_are_corrected_where_a_mode_that_was_not_found_makes_shapes_complex(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The correction halves the imaginary parts, and reduces the errors of the residues to a tenth."""
    forced = (_sweep("a", "training"),)
    chosen, _ = choose_tests(forced, _tests(*forced), LAYOUT, OPTIONS)
    fit = chosen.search.fit
    complex_fit = replace(fit, residues=fit.residues.real + 20j * fit.residue_errors)
    better = replace(fit, residues=fit.residues.real + 10j * fit.residue_errors, residue_errors=fit.residue_errors / 10)
    late = SensorClock("a", forced[0].sensors[0], 1e-3, 1e-6)
    found = iter([[late], []])
    monkeypatch.setattr("mrpipe.modal.search.chosen_tests.estimate_clocks", lambda *_: next(found))
    monkeypatch.setattr("mrpipe.modal.search.chosen_tests.fit_again", lambda *_, **__: better)
    clocks, _ = _estimated(complex_fit, forced, [], 0, False)
    assert clocks == [late]
