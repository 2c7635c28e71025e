"""What is no physics of the damper: gains of records and sessions, a drive that falls otherwise than it rises."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.fitting.recordings import Recordings, record_tests
from mrpipe.fitting.start import best_fit, first_problem
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.noise.baseline import declared_base
from mrpipe.tracing.bench.residuals.nuisances import RecordGain, record_gains, session_gain, with_lag_apart
from tests.tracing.bench.rig import RATE, hysteresis


def recordings(tests: int = 6, seconds: float = 6.0) -> Recordings:
    rng = np.random.default_rng(3)
    t = np.arange(int(seconds * RATE)) / RATE
    found = []
    for k in range(tests):
        x = 0.006 * np.sin(2 * np.pi * (0.8 + 0.1 * k) * t)
        zeros = np.zeros_like(t)
        force = 100.0 * np.tanh(np.gradient(x, 1 / RATE) / 0.01) + rng.normal(0, 1.0, len(t))
        found.append(
            PreparedTest(
                f"t{k}", "training", RATE, t, x, np.gradient(x, 1 / RATE), zeros, zeros, force, x, force,
                np.array([], dtype=np.int64), "A",
            )
        )  # fmt: skip
    return record_tests(found, rate_hz=100.0)


@pytest.mark.property
def test_a_record_that_is_weaker_says_so_with_its_interval() -> None:
    given = recordings()
    simulated = 100.0 * np.tanh(given.velocity / 0.01)
    measured = np.where(given.test == 2, 0.9, 1.0) * given.force
    gains = record_gains(given, measured, simulated)
    assert gains["t2"].value == pytest.approx(0.9, abs=0.01)
    assert gains["t2"].deviates
    assert [name for name, item in gains.items() if item.deviates] == ["t2"]


@pytest.mark.planted
def test_the_gain_of_a_session_is_named_and_judged_on_what_its_estimate_has_not_seen() -> None:
    given = recordings()
    simulated = 100.0 * np.tanh(given.velocity / 0.01)
    weak = np.array([1.0, 0.9, 0.91, 0.89, 0.9, 1.0])[given.test]
    trained = {f"a{k}": RecordGain(1.0 + 0.01 * (-1) ** k, (0.9, 1.1)) for k in range(8)}
    found = session_gain(given, weak * given.force, simulated, trained)
    assert found is not None
    assert found.tests == ("t1", "t2", "t3", "t4")
    assert found.interval[0] < 0.9 < found.interval[1]
    assert found.with_it < 0.4 * found.without
    # at a drive that no training test had, it is the model between the levels that errs
    assert session_gain(given, weak * given.force, simulated, trained, np.array([1.0, 2.0])) is None


@pytest.mark.planted
@pytest.mark.parametrize(
    ("gains", "spread"),
    [
        ([1.0, 0.9, 0.91, 1.0, 1.0, 1.0], 0.01),  # two records are no session
        ([1.0, 0.9, 0.91, 0.89, 0.9, 1.0], 0.08),  # the training tests differ as much
        ([0.95, 0.6, 0.8, 0.95, 1.0, 1.0], 0.005),  # they do not agree
    ],
)
def test_no_gain_of_a_session_is_confirmed_where_the_records_do_not_bear_it(gains, spread) -> None:
    given = recordings()
    simulated = 100.0 * np.tanh(given.velocity / 0.01)
    trained = {f"a{k}": RecordGain(1.0 + spread * (-1) ** k, (0.9, 1.1)) for k in range(8)}
    assert session_gain(given, np.array(gains)[given.test] * given.force, simulated, trained) is None


def switched(rise: float, fall: float) -> Recordings:
    """Return a damper under a switching drive whose lag has these rates [1/s], by small steps of its own."""
    rng = np.random.default_rng(5)
    t = np.arange(int(2 * RATE)) / RATE
    found = []
    for k in range(3):
        drive = np.repeat(rng.choice([0.0, 1.0, 2.0], size=10), len(t) // 10)
        u = np.zeros_like(drive)
        for i in range(1, len(u)):
            # the command runs straight between samples; 20 Euler steps of it
            u[i] = u[i - 1]
            for part in np.linspace(0.025, 0.975, 20):
                command = drive[i - 1] + part * (drive[i] - drive[i - 1])
                u[i] += (rise if command > u[i] else fall) * (command - u[i]) / (20 * RATE)
        x = 0.006 * np.sin(2 * np.pi * (1.1 + 0.2 * k) * t)
        v = np.gradient(x, 1 / RATE)
        force = (20.0 + 30.0 * u) * hysteresis(x, 4e-4) + 80.0 * v + rng.normal(0, 0.3, len(t))
        zeros = np.zeros_like(t)
        found.append(
            PreparedTest(
                f"s{k}", "training", RATE, t, x, v, zeros, drive, force, x, force, np.array([], dtype=np.int64), "A"
            )
        )
    return record_tests(found, rate_hz=RATE)


@pytest.mark.planted
def test_a_drive_that_falls_slowly_is_told_from_one_lag_for_both() -> None:
    given = switched(150.0, 40.0)
    found = best_fit(first_problem(given, declared_base(given, "bouc-wen", 1, 0)))
    apart = with_lag_apart(found)
    assert apart.base_values["eta"] == pytest.approx(150.0, rel=0.15)
    assert apart.base_values["eta_fall"] == pytest.approx(40.0, rel=0.15)


@pytest.mark.planted
def test_one_lag_stays_one() -> None:
    given = switched(90.0, 90.0)
    found = best_fit(first_problem(given, declared_base(given, "bouc-wen", 1, 0)))
    assert with_lag_apart(found) is found
