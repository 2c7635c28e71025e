"""The layout of the benchmark, the rigs' sensors and the campaign on disk."""

import numpy as np
import pytest

from benchmarks.rigs.bases import BASES
from benchmarks.rigs.campaign import record, write
from benchmarks.rigs.cases import case_of
from benchmarks.rigs.effects import EFFECTS
from benchmarks.rigs.motion import plan
from benchmarks.rigs.sensors import NOISES, draw_sensors, measured
from mrpipe.campaigns import load_campaign

pytestmark = pytest.mark.property


def test_a_third_of_the_cases_are_clean_rigs_of_all_base_forms():
    cases = [case_of(seed) for seed in range(50_000, 50_240)]
    clean = [case for case in cases if case.kind == "clean"]
    assert len(clean) == 80
    counts = [sum(case.base == base for case in clean) for base in BASES]
    assert min(counts) >= 4


def test_single_effects_meet_every_base_form():
    singles = [case for case in map(case_of, range(576)) if case.kind == "single"]
    assert {(case.base, case.planted[0]) for case in singles} == {(b, e) for b in BASES for e in EFFECTS}


def test_validation_unlike_training_has_motions_and_drives_of_its_own():
    tests = plan("regular", "unlike", False)
    training = {(test.motion, test.drive) for test in tests if test.role == "training"}
    validation = [test for test in tests if test.role == "validation"]
    assert sum((test.motion, test.drive) not in training for test in validation) >= 4


@pytest.mark.parametrize("kind", NOISES)
def test_noise_has_the_deviation_that_is_drawn(kind):
    rng = np.random.default_rng(8)
    sensors = draw_sensors(kind, rng, stroke=0.01, force_rms=1000.0, drive=2.0)
    channel = sensors.force
    exact = 1000.0 * np.sin(np.arange(40_000) * 0.01)
    error = measured(exact, channel, sensors.corner_hz, 1000.0, rng) - exact - channel.offset
    variance = channel.deviation**2 + 0.5 * 1.16 * channel.hum**2 + channel.step**2 / 12.0
    assert np.sqrt(np.mean(error**2)) == pytest.approx(np.sqrt(variance), rel=0.1)
    lag = np.corrcoef(error[1:], error[:-1])[0, 1]
    assert (lag > 0.5) if kind in ("coloured", "harmonics") else (abs(lag) < 0.1)


def test_a_campaign_is_the_same_each_time_and_holds_no_truth(tmp_path):
    case = case_of(10)
    found = record(case)
    assert case.kind == "clean"
    directory = write(found, tmp_path / "campaign")
    campaign = load_campaign(directory)
    assert [test.role for test in campaign.recordings].count("validation") == 7
    text = (directory / "campaign.yaml").read_text(encoding="utf-8")
    assert case.base not in text
    again = record(case)
    for first, second in zip(found.records, again.records, strict=True):
        np.testing.assert_array_equal(first.force, second.force)
    # no model can be better than the noise of the force, and the true model is not much worse
    assert found.truth["force_noise_nrmse"] * 0.95 < found.truth["true_model_nrmse"] < 0.03
