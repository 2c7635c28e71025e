"""Delays of sensors: their sum, their correction, and what is expected of tests that were not fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.clocks.delays import SensorClock, added, corrected, estimate_clocks, expected_clocks
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.records import FrameTest, Place, Sensor
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import complex_modes, frame_from_parameter_set
from tests.modal.rig import Rig, random_test, sweep_test

RATE = 200.0
TIME = np.arange(2000) / RATE
FIRST, SECOND = Sensor(1, "", False), Sensor(2, "", False)


def _test(name: str, delays: tuple[np.ndarray, np.ndarray]) -> FrameTest:
    def motion(t: np.ndarray) -> np.ndarray:
        return np.sin(9.0 * t) + 0.4 * np.cos(23.0 * t)

    # a late sensor shows what happened before
    seen = np.column_stack([motion(TIME - delay) for delay in delays])
    return FrameTest(name, "random", RATE, motion(TIME), seen, (False, False))


@pytest.mark.property
@pytest.mark.parametrize(
    "clock",
    [
        SensorClock("a", SECOND, 0.012, 0.0),
        SensorClock("a", SECOND, 0.002, 0.0, drift=1e-3),
        SensorClock("a", SECOND, -0.004, 0.0, step_s=0.015, step_at_s=5.0),
    ],
)
def test_a_correction_takes_the_delay_out_of_its_sensor_alone(clock: SensorClock) -> None:
    zero = np.zeros_like(TIME)
    # where the recorder was late by delay(t) at the time that it wrote down
    late = _test("a", (zero, clock.delay(TIME)))
    found = corrected(late, [clock, SensorClock("b", FIRST, 0.1, 0.0)])
    expected = _test("a", (zero, zero)).responses
    inside = slice(20, -20)
    steps = np.abs(TIME[inside] - clock.step_at_s) > 0.1
    assert found.responses[inside][steps] == pytest.approx(expected[inside][steps], abs=2e-3)
    assert np.array_equal(found.responses[:, 0], late.responses[:, 0])


@pytest.mark.property
def test_corrections_add_up_sensor_by_sensor() -> None:
    first = [SensorClock("a", FIRST, 0.01, 1e-4, step_s=0.02, step_at_s=3.0)]
    second = [SensorClock("a", FIRST, -0.004, 2e-4, drift=1e-5), SensorClock("a", SECOND, 0.003, 1e-4)]
    one, other = added(first, second)
    assert one.offset_s == pytest.approx(0.006) and one.drift == 1e-5
    assert (one.step_s, one.step_at_s, one.offset_error_s) == (0.02, 3.0, 2e-4)
    assert other == second[1]


@pytest.mark.property
def test_only_a_delay_that_all_tests_share_is_expected_elsewhere() -> None:
    zero = np.zeros_like(TIME)
    tests = [_test(name, (zero, zero)) for name in "abc"]
    steady = [SensorClock("a", FIRST, 0.0100, 0.0), SensorClock("b", FIRST, 0.0104, 0.0)]
    scattered = [SensorClock("a", SECOND, 0.010, 0.0), SensorClock("b", SECOND, -0.004, 0.0)]
    found = expected_clocks([*steady, *scattered], tests[:2], tests[2:])
    assert [(item.test, item.sensor) for item in found] == [("c", FIRST)]
    assert found[0].offset_s == pytest.approx(0.0102)
    drifting = [steady[0], SensorClock("b", FIRST, 0.0104, 0.0, drift=1e-4)]
    assert expected_clocks(drifting, tests[:2], tests[2:]) == []
    assert expected_clocks(steady[:1], tests[:2], tests[2:]) == []


@pytest.mark.planted
@pytest.mark.parametrize("delay_s", [0.006, 0.05, -0.07], ids=["small", "over half a period", "near a period"])
def test_a_planted_delay_is_estimated_and_the_others_are_zero(delay_s: float) -> None:
    frame = frame_from_parameter_set("thesis")
    test = sweep_test(frame, np.random.default_rng(1), Rig(noise=0.01, rate=250.0, sweep_s=100.0))
    late = SensorClock(test.name, test.sensors[2], -delay_s, 0.0)
    spoiled = corrected(test, [late])
    truth = complex_modes(frame)
    fit = fit_modes([record_spectrum(spoiled, (0.2, 14.0))], truth.angular_frequencies, truth.damping_ratios)
    found = {clock.sensor.floor: clock for clock in estimate_clocks(fit, [spoiled])}
    # whatever form the delay takes, it has the same size from the first to the last second
    assert found[3].delay(np.linspace(0.0, 100.0, 11)) == pytest.approx(np.full(11, delay_s), abs=5e-4)
    assert all(found[floor].is_zero for floor in (1, 2, 4, 5))


@pytest.mark.planted
@pytest.mark.parametrize(
    ("excited", "noise", "offset_s", "drift"),
    [
        pytest.param(random_test, 0.03, -0.06, 9.6e-5, id="slow convergence"),
        pytest.param(sweep_test, 0.1, -0.0409, -7.96e-5, id="another minimum without a scan over drifts"),
    ],
)
def test_a_drift_of_several_radians_at_the_highest_mode_is_estimated(
    excited: Callable[..., FrameTest], noise: float, offset_s: float, drift: float
) -> None:
    frame = frame_from_parameter_set("thesis")
    test = excited(frame, np.random.default_rng(1), Rig(noise=noise, rate=90.0, sweep_s=1000.0))
    kept = replace(test, responses=test.responses[:, [2]], is_displacement=(False,), places=(Place(3),))
    spoiled = corrected(kept, [SensorClock(kept.name, kept.sensors[0], -offset_s, 0.0, -drift)])
    truth = complex_modes(frame)
    spectra = [record_spectrum(spoiled, (0.2, 14.0))]
    fit = fit_modes(spectra, truth.angular_frequencies, truth.damping_ratios, passes=1)
    (found,) = estimate_clocks(fit, [spoiled])
    expected = offset_s + drift * np.array([0.0, 1000.0])
    assert found.delay(np.array([0.0, 1000.0])) == pytest.approx(expected, abs=1e-3)


@pytest.mark.planted
def test_noise_gives_hardly_any_constant_delay_a_drift_or_a_step() -> None:
    frame = frame_from_parameter_set("thesis")
    truth = complex_modes(frame)
    changing = []
    for seed in range(8):
        test = random_test(frame, np.random.default_rng(seed), Rig(noise=0.1, rate=100.0, sweep_s=60.0))
        spoiled = corrected(test, [SensorClock(test.name, sensor, -0.004, 0.0) for sensor in test.sensors])
        spectra = [record_spectrum(spoiled, (0.2, 14.0))]
        fit = fit_modes(spectra, truth.angular_frequencies, truth.damping_ratios, passes=2, evaluations=8)
        found = estimate_clocks(fit, [spoiled])
        assert all(clock.offset_s > 0.002 for clock in found)
        changing += [clock.drift != 0.0 or clock.step_s != 0.0 for clock in found]
    # 3 of 40; 11 where lines that were left out are the only proof
    assert sum(changing) <= 5
