"""Findings on whole campaigns: units, clock, drive levels, frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import Campaign, Recording, load_campaign
from mrpipe.campaigns.plausibility import all_checks, judge
from tests.campaigns import builders
from tests.campaigns.plausibility.rig import sound_tests


def _bench(change: Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]] = dict, *, time: float = 1.0) -> Campaign:
    recordings = []
    for test in sound_tests(4):
        channels = {"displacement": test.displacement_m, "drive": test.drive, "force": test.force_n}
        recordings.append(
            Recording(
                name=test.name,
                role=test.role,
                sampling_rate_hz=1000.0 / time,
                time_s=test.time_s * time,
                channels=change(channels),
                segments=((0, 4000),),
            )
        )
    return Campaign("own", "damper-bench", Path("own"), tuple(recordings), drive_unit="A")


def _scaled(name: str, factor: float) -> Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]:
    return lambda channels: {**channels, name: factor * channels[name]}


def _names(campaign: Campaign) -> set[tuple[str, str]]:
    return {(item.name, item.channel) for item in judge(campaign)}


@pytest.mark.property
def test_checks_are_found_and_named_once() -> None:
    names = [check.name for check in all_checks()]
    assert {"bench-tests", "ranges", "sampling", "drive-levels", "frame-channels"} <= set(names)
    assert len(set(names)) == len(names)


@pytest.mark.planted
@pytest.mark.parametrize(("largest", "found"), [(12.0, None), (4e3, "warning"), (9e4, "error")])
def test_kilovolts_drive_an_electrorheological_damper_and_no_coil(largest: float, found: str | None) -> None:
    campaign = replace(_bench(_scaled("drive", largest / 1.5)), drive_unit="V")
    drive = [item for item in judge(campaign) if item.channel == "drive"]
    assert [item.severity for item in drive] == ([found] if found else [])
    if found == "warning":
        assert "electrorheological" in drive[0].sentence and "mV" in drive[0].remedy


@pytest.mark.planted
def test_a_current_that_is_noise_alone_is_zero_and_not_negative() -> None:
    rng = np.random.default_rng(1)

    def noise(given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {**given, "drive": 2e-3 * rng.standard_normal(given["drive"].size)}

    names = {item.name for item in judge(_bench(noise))}
    assert "drive-always-zero" in names and "drive-negative" not in names


@pytest.mark.planted
def test_a_wrong_unit_of_all_tests_is_not_said_of_one() -> None:
    """The finding had named the test with the largest amplitude, as if the others were right."""
    (finding,) = [item for item in judge(_bench(_scaled("displacement", 1e3))) if item.name == "unit-range"]
    assert finding.test == "" and ", in 4 of 4 tests; the largest is that of test " in finding.sentence


@pytest.mark.planted
def test_a_sound_campaign_is_judged_sound() -> None:
    assert judge(_bench()) == ()


@pytest.mark.planted
@pytest.mark.parametrize(
    ("channel", "factor", "place"),
    [
        ("displacement", 1e3, "displacement"),  # mm given as m
        ("displacement", 1e-3, "displacement"),
        ("force", 1e-3, "force"),  # kN given as N
        ("force", 1e6, "force"),
        ("drive", 1e3, "drive"),  # mA given as A
        ("drive", 1e-3, "drive"),
    ],
)
def test_a_unit_that_is_wrong_by_1000_in_all_tests(channel: str, factor: float, place: str) -> None:
    assert ("unit-range", place) in _names(_bench(_scaled(channel, factor)))


@pytest.mark.planted
@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_clock_in_the_wrong_unit(factor: float) -> None:
    findings = [item for item in judge(_bench(time=factor)) if item.name == "clock-unit"]
    assert [(item.channel, item.severity) for item in findings] == [("time", "error")]
    assert "in 4 of 4 tests" in findings[0].sentence


@pytest.mark.planted
@pytest.mark.parametrize(("level", "name"), [(1.0, "one-drive-level"), (0.0, "drive-always-zero")])
def test_one_drive_level_only(level: float, name: str) -> None:
    campaign = _bench(lambda channels: {**channels, "drive": np.full(4000, level)})
    (found,) = [item for item in judge(campaign) if item.channel == "drive"]
    assert found.name == name and "no inverse model is possible" in found.sentence.replace("so no", "no")


@pytest.mark.planted
def test_a_drive_that_is_negative_in_all_tests_is_an_error() -> None:
    (found,) = [item for item in judge(_bench(_scaled("drive", -1.0))) if item.name == "drive-negative"]
    assert (found.severity, found.channel, found.remedy) == ("error", "drive", "give the drive `scale: -1`")


@pytest.mark.planted
def test_a_drive_of_both_signs_is_a_warning() -> None:
    signed = iter([1.0, 1.0, 1.0, -1.0])
    (found,) = judge(_bench(lambda channels: {**channels, "drive": next(signed) * channels["drive"]}))
    assert (found.name, found.severity, found.numbers["tests"]) == ("drive-negative", "warning", 1.0)
    assert found.test and "in 1 of 4 tests" in found.sentence


@pytest.mark.planted
def test_the_offset_of_a_current_probe_is_no_negative_drive() -> None:
    assert judge(_bench(lambda channels: {**channels, "drive": channels["drive"] - 0.02})) == ()


@pytest.mark.planted
def test_a_test_at_rest_is_called_so_and_not_given_another_unit_or_clock() -> None:
    rng = np.random.default_rng(0)
    order = iter(range(4))

    def still(channels: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        if next(order) != 1:
            return channels
        size = channels["force"].size
        noise = {"displacement": 2e-6 * rng.standard_normal(size), "force": 1.0 + 0.3 * rng.standard_normal(size)}
        return {**channels, **noise}

    (found,) = judge(_bench(still))
    assert (found.name, found.severity, found.test) == ("at-rest", "warning", "T1")


def _frame(change: Callable[[dict[str, np.ndarray]], None] = lambda channels: None) -> Campaign:
    rng = np.random.default_rng(5)
    recordings = []
    for index in range(2):
        channels = {f"floor_acceleration_{floor}": rng.standard_normal(3000) for floor in (1, 2, 3)}
        channels["ground_acceleration"] = rng.standard_normal(3000)
        recordings.append(Recording(f"S{index}", "training", 200.0, np.arange(3000) / 200.0, channels, ((0, 3000),)))
    change(dict(recordings[1].channels))
    changed = dict(recordings[1].channels)
    change(changed)
    recordings[1] = replace(recordings[1], channels=changed)
    return Campaign("own", "shear-frame", Path("own"), tuple(recordings), floor_masses_kg=(1.0, 1.0, 1.0))


def _kill(channels: dict[str, np.ndarray]) -> None:
    channels["floor_acceleration_2"] = np.full(3000, 0.1)


def _decades(channels: dict[str, np.ndarray]) -> None:
    channels["floor_acceleration_2"] = 1e-3 * channels["floor_acceleration_2"]


def _spike(channels: dict[str, np.ndarray]) -> None:
    values = channels["floor_acceleration_3"].copy()
    values[700] = 200.0
    channels["floor_acceleration_3"] = values


@pytest.mark.planted
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda channels: None, set()),
        (_kill, {("dead-channel", "floor_acceleration_2")}),
        (_decades, {("unit-decades", "floor_acceleration_2")}),
        (_spike, {("spikes", "floor_acceleration_3")}),
    ],
    ids=["sound", "dead", "decades", "spike"],
)
def test_faults_of_a_frame(change: Callable[[dict[str, np.ndarray]], None], expected: set[tuple[str, str]]) -> None:
    assert _names(_frame(change)) == expected


@pytest.mark.planted
def test_missing_masses_are_said() -> None:
    (found,) = judge(replace(_frame(), floor_masses_kg=()))
    assert (found.name, found.severity) == ("masses-missing", "warning")


@pytest.mark.planted
def test_the_same_frame_record_twice() -> None:
    campaign = _frame()
    first, second = campaign.recordings
    twice = replace(campaign, recordings=(first, replace(second, channels=first.channels, role="validation")))
    assert [(item.name, item.severity) for item in judge(twice)] == [("same-record", "error")]


@pytest.mark.planted
def test_validation_files_that_are_copies_of_training_files(tmp_path: Path) -> None:
    folder = builders.campaign(tmp_path)
    (folder / "two.csv").write_bytes((folder / "one.csv").read_bytes())
    assert "same-record" in {item.name for item in judge(load_campaign(folder))}


@pytest.mark.planted
@pytest.mark.parametrize("channel", ["displacement", "force"])
def test_a_single_absurd_sample_is_a_spike_and_no_wrong_unit(channel: str) -> None:
    def spiked(channels: dict[str, np.ndarray], value: float = -1e10) -> dict[str, np.ndarray]:
        values = channels[channel].copy()
        values[2000] = value
        return {**channels, channel: values}

    assert _names(_bench(spiked)) == {("spikes", channel)}
    wrong = _names(_bench(lambda channels: spiked(_scaled(channel, 1e9)(channels), -1e25)))
    assert ("unit-range", channel) in wrong
