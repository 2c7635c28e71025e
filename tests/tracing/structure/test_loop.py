"""The closed loop of a structure: a late command, a brace that gives, the damper's own effects behind floor 1."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.model import Recording
from mrpipe.effects.library import damper_effects
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.rules import DelayRules
from mrpipe.tracing.structure.damper import find_brace, prepared_loops, trace_damper
from mrpipe.tracing.structure.delay import LoopSignals, drive_lag, law_lag
from mrpipe.tracing.structure.loop import bench_of, damper_motion, motion_noise
from tests.tracing.bench.rig import RATE, campaign, force_of

OPTIONS = TracingOptions(refits=1, bootstrap_draws=50, most_effects=1, observation_filter=False)


def loop(delay_s: float, law_delay_s: float = 0.0) -> list[LoopSignals]:
    """Return tests of a velocity law whose drive (or whose law) is late, with a square-root inverse and a hold."""
    tests = []
    time = np.arange(int(20.0 * RATE)) / RATE
    for name, role, level in (("vd-a", "training", 1.0), ("vd-b", "training", 0.7), ("vd-c", "validation", 0.85)):
        envelope = level * (1.0 + 0.3 * np.sin(0.5 * time))

        def motion(t: np.ndarray, envelope: np.ndarray = envelope) -> tuple[np.ndarray, np.ndarray]:
            x = 8e-3 * np.sin(8.0 * t) + 2e-3 * np.sin(21.0 * t)
            v = 0.064 * np.cos(8.0 * t) + 0.042 * np.cos(21.0 * t)
            return envelope * x, envelope * v

        late_x, late_v = motion(time - law_delay_s)
        desired = 650.0 * late_v + 300.0 * late_x
        shifted = np.interp(time - delay_s, time, desired)
        drive = np.where(np.abs(shifted) > 18.0, np.sqrt(np.abs(shifted)) / 3.0, 0.0)
        x, v = motion(time)
        tests.append(LoopSignals(name, role, RATE, x, v, drive, desired, 200.0))
    return tests


@pytest.mark.planted
@pytest.mark.parametrize("delay", [0.0, 0.012, 0.03])
def test_a_late_drive_is_found(delay: float) -> None:
    found = drive_lag(loop(delay))
    assert found is not None
    assert found.late == (delay > 0.0)
    assert found.lag_s == pytest.approx(delay, abs=0.0004)


@pytest.mark.planted
@pytest.mark.parametrize("delay", [0.0, 0.015])
def test_a_late_law_is_found(delay: float) -> None:
    found = law_lag(loop(0.0, delay), {"vd-a": "vd", "vd-b": "vd", "vd-c": "vd"})
    assert found is not None
    assert found.late == (delay > 0.0)
    assert found.lag_s == pytest.approx(delay, abs=0.0004)


@pytest.mark.property
def test_a_declared_filter_and_the_rules_decide_what_is_late() -> None:
    late = drive_lag(loop(0.012))
    assert late is not None and late.late
    # a second-order filter at 20 Hz delays by 11 ms
    filtered = drive_lag([replace(item, command_filter_hz=20.0) for item in loop(0.012)])
    assert filtered is not None and not filtered.late
    assert filtered.granted_s == pytest.approx(0.0113, abs=1e-4)
    generous = drive_lag(loop(0.012), DelayRules(least_periods=0.05))
    assert generous is not None and not generous.late


@pytest.mark.planted
@pytest.mark.parametrize("delay", [0.008, 0.012, 0.02])
def test_the_interval_of_a_dead_time_contains_it_whatever_the_controller_is_granted(delay: float) -> None:
    """Without a declared filter the lag that is granted may belong to the dead time: the interval is wider by it."""
    unknown = drive_lag(loop(delay))
    assert unknown is not None and unknown.late
    low, high = unknown.delay_interval_s
    assert low <= delay <= high
    assert unknown.granted_error_s == unknown.granted_s > 0.0
    declared = drive_lag([replace(item, command_filter_hz=200.0) for item in loop(delay)])
    assert declared is not None and declared.granted_error_s == 0.0
    assert np.ptp(declared.delay_interval_s) < np.ptp(unknown.delay_interval_s)


@pytest.mark.property
def test_lags_are_judged_by_the_period_of_the_motion() -> None:
    slow, fast = ([replace(item, rate_hz=item.rate_hz * factor) for item in loop(0.012)] for factor in (0.5, 1.0))
    # the same samples on a clock of half the rate: all times are doubled
    found = [
        drive_lag([replace(item, velocity=item.velocity * item.rate_hz / RATE) for item in tests])
        for tests in (slow, fast)
    ]
    assert found[0] is not None and found[1] is not None
    assert found[0].lag_s == pytest.approx(2.0 * found[1].lag_s, rel=1e-6)
    assert found[0].late == found[1].late


def recordings(effect: str, compliance: float = 0.0, training: int = 5) -> list[Recording]:
    """Return tests of the damper of the tests' own rig as a frame would show them: floor 1, drive, force."""
    found = []
    for test in [*campaign(effect)[4 : 4 + training], *campaign(effect)[11:13]]:
        floor = test.displacement_m
        force = test.force_n
        if compliance:
            # the rod's motion is what is prescribed: the floor moves by the brace's stretch more
            force = force_of(
                test.displacement_m, test.velocity_m_s, test.acceleration_m_s2, test.drive, test.time_s, effect
            )
            floor = test.displacement_m + compliance * force
        rng = np.random.default_rng(len(found))
        channels = {
            "floor_displacement_1": floor + 4e-6 * rng.standard_normal(len(floor)),
            "drive": test.drive,
            "damper_force": force + 0.5 * rng.standard_normal(len(force)),
        }
        whole = ((0, len(floor)),)
        found.append(Recording(test.name, test.role, RATE, test.time_s, channels, whole, "closed-loop", {}))
    return found


@pytest.mark.planted
@pytest.mark.parametrize("compliance", [0.0, 1.5e-5])
def test_the_compliance_of_a_brace_comes_out(compliance: float) -> None:
    bench = bench_of(recordings("none", compliance, training=3), Path("nowhere"), "loop", "A")
    assert bench is not None
    found = find_brace(prepared_loops(bench), OPTIONS, [])
    assert found.compliance_m_n == pytest.approx(compliance, rel=0.15, abs=1e-6)
    assert (found.share > 0.5 and found.nrmse_after < 0.6 * found.nrmse_before) == (compliance > 0.0)


@pytest.mark.property
def test_the_noise_of_laser_and_accelerometers_together_is_what_is_told() -> None:
    rng = np.random.default_rng(8)
    time = np.arange(int(60.0 * RATE)) / RATE
    x, a = 5e-3 * np.sin(8.0 * time), -0.32 * np.sin(8.0 * time)
    channels = {
        "floor_displacement_1": x + 2e-5 * rng.standard_normal(len(x)),
        "floor_acceleration_1": a + 0.05 * rng.standard_normal(len(x)),
        "ground_acceleration": 0.05 * rng.standard_normal(len(x)),
    }
    whole = ((0, len(x)),)
    record = Recording("a", "training", RATE, time, channels, whole, "closed-loop", {})
    moved = damper_motion(record, slice(None))
    assert moved is not None
    inside = slice(2000, -2000)
    assert np.std((moved - x)[inside]) == pytest.approx(motion_noise(record)[0], rel=0.15)


@pytest.mark.property
def test_tests_whose_rod_hardly_moves_are_left_out() -> None:
    found = recordings("none", training=3)
    rng = np.random.default_rng(9)
    for number, item in enumerate(found):
        place = item.channels["floor_displacement_1"]
        if number == 1:
            place = 1e-3 * place
        item.channels["floor_displacement_1"] = place + 2e-5 * rng.standard_normal(len(place))
        item.channels["floor_acceleration_1"] = np.gradient(np.gradient(place, 1.0 / RATE), 1.0 / RATE)
        item.channels["floor_acceleration_1"] += 0.05 * rng.standard_normal(len(place))
        item.channels["ground_acceleration"] = np.zeros(len(place))
    bench = bench_of(found, Path("nowhere"), "loop", "A")
    assert bench is not None
    assert {test.name for test in prepared_loops(bench)} == {item.name for item in found} - {found[1].name}


@pytest.mark.planted
def test_remanence_is_seen_through_the_structure() -> None:
    bench = bench_of(recordings("remanence"), Path("nowhere"), "loop", "A")
    assert bench is not None
    library = {name: damper_effects()[name] for name in ("remanence", "backlash", "inertia")}
    rng = np.random.default_rng(1)
    options = OPTIONS.model_copy(update={"base_forms": ("bouc-wen", "dahl", "hyperbolic-tangent")})
    found = trace_damper(prepared_loops(bench), library, [], options, rng=rng).summary
    assert found["effects"][0]["name"] == "remanence"
    assert found["after"]["nrmse"] < 0.7 * found["before"]["nrmse"]
