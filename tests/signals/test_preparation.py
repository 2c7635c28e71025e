"""Preparation of whole campaigns: what comes out agrees with the truth that went in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray, Provenance, config_directory
from mrpipe.campaigns import Campaign, Recording, load_campaign
from mrpipe.errors import UserError
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import Preparation, common_rate, prepare_campaign
from mrpipe.signals.prepared import read_prepared, write_prepared

OMEGA = 2 * np.pi * 1.0
NOISE = {"displacement": 20e-6, "acceleration": 0.1, "drive": 0.01, "force": 0.3}
OFFSET = {"displacement": 1.5e-3, "acceleration": 0.3, "drive": 0.0, "force": -12.0}


def truth(t: FloatArray, drive: float = 2.0) -> dict[str, FloatArray]:
    v = 5e-3 * OMEGA * np.cos(OMEGA * t)
    current = drive * np.abs(np.sin(OMEGA * t + 0.6))
    return {
        "displacement": 5e-3 * np.sin(OMEGA * t),
        "velocity": v,
        "acceleration": -(OMEGA**2) * 5e-3 * np.sin(OMEGA * t),
        "drive": current,
        "force": (20 + 40 * current) * np.tanh(v / 5e-3) + 150 * v,
    }


def recording(
    name: str, role: str = "training", *, rate: float = 1000.0, seconds: float = 13.0, seed: int = 0
) -> Recording:
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    exact = truth(t)
    channels = {key: exact[key] + OFFSET[key] + NOISE[key] * rng.standard_normal(t.size) for key in NOISE}
    return Recording(name, role, rate, t, channels, ((0, t.size),))


def campaign(*recordings: Recording, rig: str = "damper-bench") -> Campaign:
    return Campaign("c", rig, Path("c"), recordings, drive_unit="A")


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def errors(item: Preparation) -> Mapping[str, float]:
    """Return relative rms errors over the steady cycles."""
    test = item.test
    part = slice(int(test.cycles[0]), int(test.cycles[-1]))
    exact = truth(test.time_s[part])
    ours = {
        "displacement": test.displacement_m,
        "velocity": test.velocity_m_s,
        "acceleration": test.acceleration_m_s2,
        "drive": test.drive,
        "force": test.force_n,
    }
    return {key: rms(ours[key][part] - exact[key]) / rms(exact[key]) for key in ours}


def velocity_limit(rate: float) -> float:
    """Return the relative velocity error that the displacement's white noise leaves below 20 Hz, and a fifth more.

    White noise of 20 um has the density 2 sigma^2/rate; differentiated and passed by the squared Butterworth gain
    1/(1 + (f/fd)^4), fd = 20/0.802 Hz, its variance is 8 pi^2 sigma^2/rate times the integral of f^2/(1 + (f/fd)^4)^2.
    """
    f = np.linspace(0.0, 200.0, 20001)
    gain = 1.0 / (1.0 + (f / (20.0 / (np.sqrt(2.0) - 1.0) ** 0.25)) ** 4)
    variance = 8 * np.pi**2 * NOISE["displacement"] ** 2 / rate * float(np.sum((f * gain) ** 2) * (f[1] - f[0]))
    return 1.2 * float(np.sqrt(variance)) / rms(truth(np.arange(1000) / 1000.0)["velocity"])


@pytest.mark.planted
def test_the_default_gives_back_the_truth() -> None:
    (item,) = prepare_campaign(campaign(recording("one")), PreparationOptions()).tests
    found = errors(item)
    # a low-pass at 100 Hz rounds the jump of the force at reversal; the acceleration of 0.14 m/s2 rms drowns in noise
    velocity = velocity_limit(1000.0)
    limits = {"displacement": 0.004, "velocity": velocity, "acceleration": 0.4, "drive": 0.015, "force": 0.02}
    assert {key: value for key, value in found.items() if value > limits[key]} == {}
    assert item.test.force_offset_n == pytest.approx(-12.0, abs=0.5)
    assert item.test.displacement_offset_m == pytest.approx(1.5e-3, abs=10e-6)
    assert item.test.cycles.size == 11 and item.test.excitation == "periodic"
    assert item.frequency_hz == pytest.approx(1.0, rel=1e-3)
    assert item.test.drive.min() >= -0.05


@pytest.mark.planted
@pytest.mark.parametrize("method", ["backward", "central", "savitzky-golay", "kalman"])
def test_every_way_to_the_velocity(method: str) -> None:
    options = PreparationOptions(differentiation=method)  # type: ignore[arg-type]
    (item,) = prepare_campaign(campaign(recording("one")), options).tests
    assert errors(item)["velocity"] < 0.03
    part = slice(int(item.test.cycles[0]), int(item.test.cycles[-1]))
    velocity, exact = item.test.velocity_m_s[part], truth(item.test.time_s[part])
    late = -np.sum((velocity - exact["velocity"]) * exact["acceleration"]) / np.sum(exact["acceleration"] ** 2)
    assert abs(late) < 3e-4


@pytest.mark.planted
def test_noise_levels_of_zero_are_found_in_the_spectra() -> None:
    test = recording("one").channels
    gains = PreparationOptions(kalman_displacement_noise_m=0.0, kalman_acceleration_noise_m_s2=0.0).gains(
        test["displacement"], test["acceleration"], 1000.0
    )
    assert gains.l == pytest.approx(NOISE["acceleration"] / NOISE["displacement"], rel=0.15)


@pytest.mark.literature
def test_the_causal_way_of_the_thesis_is_late_and_says_so_by_its_signs() -> None:
    (item,) = prepare_campaign(campaign(recording("one")), PreparationOptions(phase="causal")).tests
    part = slice(int(item.test.cycles[0]), int(item.test.cycles[-1]))
    exact = truth(item.test.time_s[part])
    velocity = item.test.velocity_m_s[part]
    late = -np.sum((velocity - exact["velocity"]) * exact["acceleration"]) / np.sum(exact["acceleration"] ** 2)
    # 2.2 ms of the 100 Hz filter, half a sample, 11.25 ms of the 20 Hz filter
    assert late == pytest.approx(14e-3, rel=0.05)
    wrong = np.mean(np.sign(velocity) != np.sign(exact["velocity"]))
    assert 0.02 < wrong < 0.05


@pytest.mark.planted
def test_a_missing_acceleration_is_derived() -> None:
    test = recording("one")
    channels = {key: value for key, value in test.channels.items() if key != "acceleration"}
    (item,) = prepare_campaign(campaign(replace(test, channels=channels)), PreparationOptions()).tests
    (sensor,) = prepare_campaign(campaign(test), PreparationOptions()).tests
    assert errors(item)["acceleration"] < 1.5 * errors(sensor)["acceleration"]
    options = PreparationOptions(differentiation="kalman")
    (item,) = prepare_campaign(campaign(replace(test, channels=channels)), options).tests
    assert any("no acceleration for the Kalman filter" in line for line in item.findings)


@pytest.mark.planted
@pytest.mark.parametrize("late", [0.0043, -0.0017])
def test_a_displacement_recorded_late_is_brought_in_time(late: float) -> None:
    test = recording("one")
    moved = truth(test.time_s - late)["displacement"]
    source = campaign(replace(test, channels={**test.channels, "displacement": moved}))
    (skewed,) = prepare_campaign(source, PreparationOptions()).tests
    (mended,) = prepare_campaign(source, PreparationOptions(displacement_late_s=late)).tests
    assert errors(skewed)["velocity"] > 0.9 * OMEGA * abs(late)
    assert errors(mended)["velocity"] < 1e-3 and errors(mended)["displacement"] < 1e-3


@pytest.mark.planted
def test_tests_of_different_rates_come_to_one() -> None:
    source = campaign(recording("fast"), recording("slow", rate=250.0), recording("odd", rate=3004.8))
    for asked, expected in ((0.0, 250.0), (500.0, 500.0), (1500.0, 1500.0)):
        items = prepare_campaign(source, PreparationOptions(working_rate_hz=asked)).tests
        assert {item.test.sampling_rate_hz for item in items} == {expected}
        for item in items:
            assert errors(item)["force"] < 0.08
            native = {"fast": 1000.0, "slow": 250.0, "odd": 3004.8}[item.test.name]
            assert errors(item)["velocity"] < velocity_limit(native)


@pytest.mark.golden
@pytest.mark.parametrize(
    ("rates", "expected"), [([1000.0, 200.0], 200.0), ([100.0, 50.0], 100.0), ([100.0, 1000.0, 3004.8], 1000.0)]
)
def test_the_rate_of_a_mixed_campaign(rates: list[float], expected: float) -> None:
    assert common_rate(rates) == expected


@pytest.mark.planted
def test_an_accelerometer_mounted_upside_down_is_turned_round() -> None:
    test = recording("one")
    turned = replace(test, channels={**test.channels, "acceleration": -test.channels["acceleration"]})
    prepared = prepare_campaign(campaign(turned), PreparationOptions())
    assert any("opposite sign" in line for line in prepared.findings)
    assert errors(prepared.tests[0])["acceleration"] < 0.4
    scaled = replace(test, channels={**test.channels, "acceleration": test.channels["acceleration"] / 9.81})
    findings = prepare_campaign(campaign(scaled), PreparationOptions()).findings
    assert any(line.startswith("acceleration is 0.10") and "check unit" in line for line in findings)


@pytest.mark.planted
def test_offsets_by_test_by_campaign_and_not_at_all() -> None:
    tests = [recording(str(seed), seed=seed) for seed in range(3)]
    moved = replace(tests[2], channels={**tests[2].channels, "force": tests[2].channels["force"] + 30.0})
    source = campaign(tests[0], tests[1], moved)
    offsets = {
        choice: [
            item.test.force_offset_n
            for item in prepare_campaign(source, PreparationOptions(offset=choice)).tests  # type: ignore[arg-type]
        ]
        for choice in ("test", "campaign", "off")
    }
    assert offsets["test"] == pytest.approx([-12.0, -12.0, 18.0], abs=0.5)
    assert offsets["campaign"] == pytest.approx([-12.0] * 3, abs=0.5)
    assert offsets["off"] == [0.0] * 3


def lopsided(seed: int) -> Recording:
    """Return a short test of random motion with a drive that steps, which shows no offset well."""
    rng = np.random.default_rng(seed)
    t = np.arange(5000) / 1000.0
    tones, phases = rng.uniform(0.2, 3.0, 30), rng.uniform(0, 6.28, 30)
    waves = 2 * np.pi * tones[:, None] * t + phases[:, None]
    v = np.sum(1e-3 * (2 * np.pi * tones)[:, None] * np.cos(waves), axis=0)
    drive = np.repeat(rng.uniform(0, 4.0, 10), 500)
    exact = {
        "displacement": np.sum(1e-3 * np.sin(waves), axis=0),
        "acceleration": np.gradient(v, 1e-3),
        "drive": drive,
        "force": (20 + 40 * drive) * np.tanh(v / 5e-3) + 150 * v,
    }
    channels = {key: exact[key] + OFFSET[key] + NOISE[key] * rng.standard_normal(t.size) for key in NOISE}
    return Recording(f"random-{seed}", "training", 1000.0, t, channels, ((0, 5000),))


@pytest.mark.planted
def test_a_test_that_shows_no_offset_borrows_that_of_the_others() -> None:
    sines = [recording(str(seed), seed=seed) for seed in range(2)]
    alone = prepare_campaign(campaign(lopsided(1), lopsided(2)), PreparationOptions()).tests
    lent = prepare_campaign(campaign(*sines, lopsided(1), lopsided(2)), PreparationOptions()).tests[2:]
    for item in lent:
        assert item.test.excitation == "random"
        assert item.test.force_offset_n == pytest.approx(-12.0, abs=0.3)
        assert item.test.displacement_offset_m == pytest.approx(1.5e-3, abs=1e-5)
    # without such others they share what they show together
    assert alone[0].test.force_offset_n == alone[1].test.force_offset_n
    assert alone[0].test.force_offset_n == pytest.approx(-12.0, abs=8.0)


@pytest.mark.planted
def test_offsets_that_differ_between_tests_are_lent_to_none() -> None:
    sines = [recording(str(seed), seed=seed) for seed in range(3)]
    moved = [
        replace(test, channels={**test.channels, "force": test.channels["force"] + 60.0 * index})
        for index, test in enumerate(sines)
    ]
    item = prepare_campaign(campaign(*moved, lopsided(1)), PreparationOptions()).tests[-1]
    assert item.test.force_offset_n == pytest.approx(-12.0, abs=10.0)


@pytest.mark.planted
def test_fixed_cutoffs_are_for_sines() -> None:
    test = recording("one")
    triangle = 5e-3 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * 2.0 * test.time_s))
    noise = 5e-6 * np.random.default_rng(0).standard_normal(triangle.size)
    other = replace(test, name="two", channels={**test.channels, "displacement": triangle + noise})
    sine, corner = prepare_campaign(campaign(test, other), PreparationOptions()).tests
    assert sine.cutoffs_hz["displacement"] == 100.0 and sine.cutoffs_hz["velocity"] == 20.0
    assert "velocity" not in corner.cutoffs_hz
    exact = 40e-3 * np.sign(np.cos(2 * np.pi * 2.0 * test.time_s))
    fixed = prepare_campaign(campaign(test, other), PreparationOptions(cutoff_choice="fixed")).tests[1]
    assert rms(corner.test.velocity_m_s - exact) < 0.8 * rms(fixed.test.velocity_m_s - exact)


@pytest.mark.planted
def test_each_segment_becomes_a_test() -> None:
    test = replace(recording("one", seconds=14.0), segments=((0, 6000), (7000, 14000)))
    first, second = prepare_campaign(campaign(test), PreparationOptions()).tests
    assert (first.test.name, second.test.name) == ("one-1", "one-2")
    assert (first.test.time_s.size, second.test.time_s.size) == (6000, 7000)
    assert second.test.time_s[0] == pytest.approx(7.0)


@pytest.mark.planted
def test_jitter_and_dropouts_are_bridged() -> None:
    test = recording("one")
    rng = np.random.default_rng(5)
    keep = rng.random(test.time_s.size) > 0.002
    t = test.time_s + 1e-4 * rng.uniform(-1, 1, test.time_s.size)
    exact = truth(t)
    channels = {key: (exact[key] + OFFSET[key])[keep] for key in test.channels}
    (item,) = prepare_campaign(
        campaign(replace(test, time_s=t[keep], channels=channels, segments=((0, int(keep.sum())),))),
        PreparationOptions(),
    ).tests
    assert np.allclose(np.diff(item.test.time_s), 1e-3)
    assert errors(item)["velocity"] < 0.01


@pytest.mark.golden
def test_what_does_not_fit_is_told_in_a_line() -> None:
    with pytest.raises(
        UserError, match=r"c: test one: has 100 samples at 1000 Hz, its filters need 151; give a test of"
    ):
        prepare_campaign(campaign(recording("one", seconds=0.1)), PreparationOptions())
    with pytest.raises(UserError, match="rig: is shear-frame; prepare works on a damper-bench"):
        prepare_campaign(campaign(recording("one"), rig="shear-frame"), PreparationOptions())


@pytest.mark.golden
def test_cutoffs_that_the_sampling_rate_or_the_motion_do_not_allow() -> None:
    (item,) = prepare_campaign(campaign(recording("one", rate=100.0)), PreparationOptions()).tests
    assert any("no low-pass at 100 Hz" in line for line in item.findings)
    assert "displacement" not in item.cutoffs_hz and item.cutoffs_hz["velocity"] == 20.0
    assert errors(item)["velocity"] < velocity_limit(100.0)
    (item,) = prepare_campaign(campaign(recording("one")), PreparationOptions(velocity_cutoff_hz=2.0)).tests
    assert any("set prepare.velocity_cutoff_hz to" in line for line in item.findings)


@pytest.mark.golden
def test_prepared_tests_are_stored_and_read_again(tmp_path: Path) -> None:
    tests = [
        item.test for item in prepare_campaign(campaign(recording("b"), recording("a")), PreparationOptions()).tests
    ]
    with ArtifactWriter.create(tmp_path / "prepared.h5", Provenance("prepare")) as artifact:
        write_prepared(artifact, tests)
    again = read_prepared(Artifact(tmp_path / "prepared.h5"))
    assert [test.name for test in again] == ["b", "a"]
    for ours, stored in zip(tests, again, strict=True):
        for key, value in vars(ours).items():
            np.testing.assert_array_equal(getattr(stored, key), value)


@pytest.mark.real
@pytest.mark.parametrize("name", ["utfsm", "utfsm-raw", "labcontrol"])
def test_the_public_sine_tests(public_data: Path, name: str) -> None:
    source = load_campaign(config_directory() / "campaigns" / f"{name}.yaml")
    items = prepare_campaign(source, PreparationOptions()).tests
    for item in items:
        test = item.test
        assert test.excitation == "periodic" and test.cycles.size >= 4
        part = slice(int(test.cycles[0]), int(test.cycles[-1]))
        # a damper takes energy out in every cycle
        assert np.sum(test.force_n[part] * test.velocity_m_s[part]) > 0.0


@pytest.mark.real
def test_offsets_of_labcontrol_are_those_its_notes_tell_of(public_data: Path) -> None:
    source = load_campaign(config_directory() / "campaigns" / "labcontrol.yaml")
    for item in prepare_campaign(source, PreparationOptions()).tests:
        name, offset = item.test.name, item.test.force_offset_n
        if name.endswith(".2.2") or name in {"ensaio.B.5", "ensaio.B.10", "ensaio.vali.1"}:
            assert abs(offset) < 20.0, name
        else:
            assert 100.0 < offset < 150.0, name


@pytest.mark.real
def test_the_public_random_test(public_data: Path) -> None:
    items = prepare_campaign(load_campaign(config_directory() / "campaigns" / "dyke.yaml"), PreparationOptions()).tests
    for item in items:
        assert item.test.excitation == "random" and item.test.cycles.size == 0
        # the motion reaches up to 250 Hz: 40 Hz was found to spoil every model
        assert 200.0 < item.cutoffs_hz["displacement"] < 500.0
        assert item.test.force_offset_n == pytest.approx(-110.0, abs=30.0)
        raw = np.gradient(item.test.displacement_raw_m, 1 / item.test.sampling_rate_hz)
        assert rms(item.test.velocity_m_s) == pytest.approx(rms(raw), rel=0.05)


@pytest.mark.planted
def test_faults_of_the_load_cell_that_are_known_are_taken_out() -> None:
    test = recording("one")
    lag, rate = 0.01, 1000.0
    keep = np.exp(-1.0 / (rate * lag))
    drive = test.channels["drive"]
    late = np.empty_like(drive)
    late[0] = drive[0]
    for k in range(1, drive.size):
        late[k] = keep * late[k - 1] + (1.0 - keep) * drive[k]
    faults = {
        "force_per_drive_n": 3.0,
        "force_per_drive_squared_n": -0.5,
        "drive_lag_s": lag,
        "force_drift_n_s": 0.4,
        "force_offset_n": {"one": 7.0},
    }
    wrong = test.channels["force"] + 3.0 * late - 0.5 * late**2 + 0.4 * test.time_s + 7.0
    source = campaign(replace(test, channels={**test.channels, "force": wrong}))
    (plain,) = prepare_campaign(campaign(test), PreparationOptions()).tests
    (mended,) = prepare_campaign(source, PreparationOptions(corrections=faults)).tests  # type: ignore[arg-type]
    assert mended.test.force_n == pytest.approx(plain.test.force_n, abs=1e-9)
    # what was taken out is not an offset that the test remembers: tracing it again finds it gone
    assert mended.test.force_offset_n == pytest.approx(plain.test.force_offset_n, abs=1e-9)


@pytest.mark.planted
def test_a_force_recorded_late_is_brought_in_time() -> None:
    test = recording("one")
    late = 0.0035
    moved = truth(test.time_s - late)["force"]
    source = campaign(replace(test, channels={**test.channels, "force": moved}))
    (mended,) = prepare_campaign(source, PreparationOptions(corrections={"force_late_s": late})).tests
    (skewed,) = prepare_campaign(source, PreparationOptions()).tests
    assert errors(mended)["force"] < 0.3 * errors(skewed)["force"]


@pytest.mark.property
def test_an_offset_for_a_test_that_is_not_there_is_refused() -> None:
    options = PreparationOptions(corrections={"force_offset_n": {"two": 1.0}})
    with pytest.raises(UserError, match=r"force_offset_n: two: the campaign has no such test; one of one"):
        prepare_campaign(campaign(recording("one")), options)


@pytest.mark.property
def test_a_rate_that_cannot_carry_the_velocity_is_refused() -> None:
    source = Campaign(name="c", directory=Path("c"), rig="damper-bench", drive_unit="A", recordings=())
    with pytest.raises(UserError, match=r"working_rate_hz: is 3, too slow .* give 50 Hz at least"):
        prepare_campaign(source, PreparationOptions(working_rate_hz=3.0))


@pytest.mark.planted
def test_motion_from_both_sensors() -> None:
    plain, fused = (
        prepare_campaign(campaign(recording("a")), PreparationOptions(motion=motion))
        for motion in ("displacement", "displacement-and-acceleration")
    )
    raw = [item.tests[0].test.displacement_raw_m for item in (plain, fused)]
    exact = truth(plain.tests[0].test.time_s)["displacement"]
    assert rms(np.diff(raw[1] - exact)) < 0.1 * rms(np.diff(raw[0] - exact))
    assert any("the motion follows the displacement below" in line for line in fused.findings)


@pytest.mark.property
def test_motion_from_both_sensors_is_not_causal() -> None:
    with pytest.raises(ValueError, match="set phase to zero"):
        PreparationOptions(motion="displacement-and-acceleration", phase="causal")
