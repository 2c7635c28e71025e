"""The bench campaign: the plan, what the sensors say, what is told and what is sealed."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import campaign_files, load_campaign
from mrpipe.errors import UserError
from mrpipe.laboratory import plans
from mrpipe.laboratory.bench import record_bench
from mrpipe.laboratory.blind import record_blind
from mrpipe.laboratory.damper import TrueDamper
from mrpipe.laboratory.effects import Planted, find_form
from mrpipe.laboratory.options import BenchRig, BenchSensors
from mrpipe.laboratory.plans import compact, discriminating, table_2_1
from mrpipe.laboratory.sealing import open_sealed, sealed_path
from tests.laboratory.conftest import QUIET

FEW = [test for test in table_2_1() if test.name in ("5a-2.2Hz", "5b-2.2Hz", "15a-2.2Hz", "1a-2.2Hz", "11a-2.2Hz")]


@pytest.mark.literature
def test_table_2_1_has_nineteen_sets_twice_at_five_frequencies() -> None:
    tests = table_2_1()
    assert Counter(test.role for test in tests) == {"training": 95, "validation": 95}
    rows = sum(10 / test.frequency_hz * 200.0 for test in tests if test.role == "training")
    assert rows == pytest.approx(182_000, rel=0.005)
    first = [replace(test, name="") for test in tests if test.name.startswith("1a-")]
    eleventh = [replace(test, name="", current="constant") for test in tests if test.name.startswith("11a-")]
    assert first == eleventh


@pytest.mark.golden
def test_compact_plan_is_44_tests_with_unlike_validation() -> None:
    tests = compact()
    assert len(tests) == 44
    assert len({test.name for test in tests}) == 44
    motions = {
        role: {(test.motion, test.current) for test in tests if test.role == role}
        for role in ("training", "validation")
    }
    assert motions["validation"] - motions["training"]
    assert motions["validation"] & motions["training"]
    names = {test.name for test in tests}
    assert all(test.repeat_of in names for test in tests if test.role == "repeat")


@pytest.mark.golden
def test_discriminating_plan_asks_what_the_notes_ask() -> None:
    tests = discriminating()
    speeds = sorted({4.0 * test.amplitude_m * test.frequency_hz for test in tests if test.name.startswith("speed")})
    assert speeds[-1] / speeds[0] > 30.0
    assert {"steps", "constant", "half-sine"} <= {test.current for test in tests}
    assert {"dwell", "hold", "triangle"} <= {test.motion for test in tests}
    assert any(test.role == "repeat" for test in tests)
    with pytest.raises(UserError, match=r"one of table-2\.1, compact, discriminating"):
        plans.tests_of("compact+everything")


@pytest.mark.property
def test_threads_change_nothing(damper: TrueDamper) -> None:
    one, two = (record_bench(damper, FEW, BenchRig(), np.random.default_rng(1), jobs=jobs) for jobs in (1, 2))
    assert one.truth == two.truth
    for first, second in zip(one.tests, two.tests, strict=True):
        assert first.name == second.name
        assert all(np.array_equal(first.columns[key], second.columns[key]) for key in first.columns)


@pytest.mark.property
def test_the_same_seed_gives_the_same_campaign_and_another_another(damper: TrueDamper) -> None:
    forces = [record_bench(damper, FEW, BenchRig(), np.random.default_rng(s)).tests[0].columns["F"] for s in (1, 1, 2)]
    assert np.array_equal(forces[0], forces[1])
    assert not np.array_equal(forces[0], forces[2])


@pytest.mark.golden
def test_training_and_validation_differ_in_phase_and_noise(damper: TrueDamper) -> None:
    tests = {test.name: test.columns for test in record_bench(damper, FEW, BenchRig(), np.random.default_rng(1)).tests}
    x, y = tests["5a-2.2Hz"]["x"], tests["5b-2.2Hz"]["x"]
    assert np.abs(np.corrcoef(x[2000:4000], y[2000:4000])[0, 1]) < 0.999
    assert x.max() == pytest.approx(5.0, abs=0.4)


@pytest.mark.golden
def test_sensor_noise_and_offset_are_those_asked_for(damper: TrueDamper) -> None:
    sensors = QUIET.changed(force_noise_n=0.5, force_offset_n=3.0)
    loud = record_bench(damper, FEW, BenchRig(sensors=sensors), np.random.default_rng(1))
    quiet = record_bench(damper, FEW, BenchRig(sensors=QUIET), np.random.default_rng(1))
    error = np.concatenate([a.columns["F"] - b.columns["F"] for a, b in zip(loud.tests, quiet.tests, strict=True)])
    assert error.std() == pytest.approx(0.5, rel=0.02)
    assert error.mean() == pytest.approx(loud.truth["offsets"]["force"], abs=0.01)
    assert abs(error.mean()) > 0.1


@pytest.mark.golden
def test_coloured_noise_is_slow(damper: TrueDamper) -> None:
    def neighbours(colour: str) -> float:
        sensors = QUIET.changed(force_noise_n=0.5, colour=colour)
        noisy = record_bench(damper, FEW[:1], BenchRig(sensors=sensors), np.random.default_rng(1)).tests[0].columns["F"]
        exact = record_bench(damper, FEW[:1], BenchRig(sensors=QUIET), np.random.default_rng(1)).tests[0].columns["F"]
        error = noisy - exact
        assert error.std() == pytest.approx(0.5, rel=0.15)
        return float(np.corrcoef(error[:-1], error[1:])[0, 1])

    assert abs(neighbours("white")) < 0.05
    assert neighbours("coloured") > 0.9


@pytest.mark.golden
def test_the_knock_of_the_play_shows_in_the_acceleration(damper: TrueDamper) -> None:
    rig = BenchRig(sensors=QUIET)
    loose = damper.with_effects([Planted(find_form("backlash", "held"), {"gap": 15e-6}, declared=True)])
    a = [record_bench(item, FEW[:1], rig, np.random.default_rng(1)).tests[0].columns["a"] for item in (loose, damper)]
    knock = np.abs(a[0] - a[1])
    assert knock.max() > 5 * BenchSensors().acceleration_noise_m_s2
    assert np.mean(knock > 0.1) < 0.3


@pytest.mark.planted
def test_truth_lies_beside_the_campaign_and_not_in_it(tmp_path: Path) -> None:
    directory = record_blind(tmp_path / "blind", 4, names=("heating",), share=0.05)
    campaign = load_campaign(directory)
    assert campaign.declared_effects == ()
    assert len(campaign.recordings) == 44
    assert campaign.findings == ()
    assert sealed_path(directory).parent.parent == directory.parent
    assert not any(path.is_relative_to(sealed_path(directory).parent) for path in campaign_files(directory))
    assert "heating" not in "".join(path.read_text() for path in directory.glob("*.yaml"))
    truth = open_sealed(directory)
    assert [item["name"] for item in truth["effects"]] == ["heating"]
    assert truth["effects"][0]["share_of_force_rms"] == pytest.approx(0.05, rel=0.05)
    assert 0.002 < truth["noise_floor_nrmse"] < 0.01


@pytest.mark.planted
def test_two_effects_at_once_and_none(tmp_path: Path) -> None:
    tests = [test for test in compact(2.0) if test.current != "random"][::4]
    pair = record_blind(tmp_path / "pair", 8, names=("inertia", "asymmetry"), count=2, share=0.08, tests=tests)
    assert {item["name"] for item in open_sealed(pair)["effects"]} == {"inertia", "asymmetry"}
    clean = record_blind(tmp_path / "clean", 8, count=0, tests=tests)
    assert open_sealed(clean)["effects"] == []
