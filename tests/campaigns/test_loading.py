"""Reading campaigns: what is accepted, and one line for each fault of the contract."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import load_campaign, require_varying
from mrpipe.errors import UserError
from mrpipe.modal.recordings import frame_tests
from tests.campaigns.builders import CHANNELS, campaign, content, motion, write_csv


def told(path: Path) -> str:
    """Return the one line with which a campaign is refused."""
    with pytest.raises(UserError) as caught:
        load_campaign(path)
    message = str(caught.value)
    assert "\n" not in message and message.startswith(str(path))
    return message


@pytest.mark.golden
def test_a_plain_campaign_is_read_in_si(tmp_path: Path) -> None:
    read = load_campaign(campaign(tmp_path))
    one = read.recordings[0]
    columns = motion(drive=1.0)
    assert (read.name, read.rig, read.drive_unit, read.drive_is_set_point) == ("rig", "damper-bench", "A", False)
    assert [test.role for test in read.recordings] == ["training", "validation"]
    np.testing.assert_allclose(one.channels["displacement"], columns["x"] * 1e-3, rtol=1e-9)
    np.testing.assert_allclose(one.channels["force"], columns["F"], rtol=1e-9)
    assert one.sampling_rate_hz == 1000.0 and one.segments == ((0, 4000),)
    assert read.findings == ()


@pytest.mark.golden
def test_the_clock_is_told_by_the_rate_or_by_time_alone(tmp_path: Path) -> None:
    by_time = load_campaign(campaign(tmp_path / "a", sampling_rate_hz=None))
    channels = {key: value for key, value in CHANNELS.items() if key != "time"}
    by_rate = load_campaign(campaign(tmp_path / "b", channels=channels))
    for read in (by_time, by_rate):
        assert read.recordings[0].sampling_rate_hz == 1000.0
        np.testing.assert_allclose(read.recordings[0].time_s, np.arange(4000) / 1000.0, atol=1e-9)


@pytest.mark.golden
def test_scale_offset_constants_and_overrides(tmp_path: Path) -> None:
    channels = {key: dict(value) for key, value in CHANNELS.items()}
    channels["force"] |= {"scale": 50.0, "offset": -3.0}
    tests = [
        {"name": "one", "file": "one.csv", "role": "training", "drive": {"value": 250, "unit": "mA"}},
        {
            "name": "two",
            "file": "one.csv",
            "role": "validation",
            "segments_s": [[1.0, 2.5]],
            "channels": {"force": {"scale": 2.0}, "drive": {"value": 0.5}},
        },
    ]
    read = load_campaign(campaign(tmp_path, channels=channels, tests=tests))
    force = motion(drive=1.0)["F"]
    one, two = read.recordings
    np.testing.assert_allclose(one.channels["force"], 50.0 * force - 3.0, rtol=1e-9)
    np.testing.assert_allclose(two.channels["force"], 2.0 * force[1000:2500] - 3.0, rtol=1e-8)
    assert np.all(one.channels["drive"] == 0.25) and np.all(two.channels["drive"] == 0.5)
    assert read.drive_is_set_point
    assert two.segments == ((0, 1500),) and two.time_s[0] == pytest.approx(1.0)


@pytest.mark.golden
def test_several_segments_keep_what_lies_between_them_out(tmp_path: Path) -> None:
    columns = motion()
    columns["F"][2000:2100] = np.nan
    tests = [
        {"name": "one", "file": "one.csv", "role": "training", "segments_s": [[0.5, 1.5], [2.5, 3.5]]},
        {"name": "two", "file": "two.csv", "role": "validation"},
    ]
    with pytest.raises(UserError, match=r"test one, force, row 2002: is NaN"):
        load_campaign(campaign(tmp_path / "a", columns, tests=[tests[0] | {"segments_s": [[0.5, 3.5]]}, tests[1]]))
    read = load_campaign(campaign(tmp_path / "b", columns, tests=tests))
    assert read.recordings[0].segments == ((0, 1000), (2000, 3000))


@pytest.mark.golden
@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"rigg": "x"}, "line 27, rigg: unknown key; did you mean rig?"),
        ({"rig": "table"}, "line 2, rig: is 'table'"),
        ({"channels": None}, "channels: is missing; write channels: ..."),
        ({"channels": {**CHANNELS, "forc": {"column": "F", "unit": "N"}}}, "unknown channel; did you mean force?"),
        (
            {"channels": {**CHANNELS, "force": {"colum": "F", "unit": "N"}}},
            "force.colum: unknown key; did you mean col",
        ),
        ({"channels": {**CHANNELS, "force": {"column": "F"}}}, "line 17, channels.force.unit: is missing"),
        ({"channels": {**CHANNELS, "force": {"column": "F", "unit": "Nm"}}}, "unit 'Nm': is not a unit of force"),
        ({"channels": {**CHANNELS, "force": {"column": "F", "unit": "newt"}}}, "unit 'newt': is not a unit"),
        (
            {"channels": {**CHANNELS, "force": {"column": "Ft", "unit": "N"}}},
            "test one, force: no column 'Ft'; did you mean",
        ),
        (
            {"channels": {**CHANNELS, "force": {"column": 7, "unit": "N"}}},
            "no column 7, the table has 5; count from 0 to",
        ),
        ({"channels": {"displacement": CHANNELS["displacement"]}}, "channels: no channel force; write force: {column"),
        ({"sampling_rate_hz": 500}, "the clock runs at 1000 Hz, but sampling_rate_hz says 500"),
        ({"sampling_rate_hz": -1}, "sampling_rate_hz: is -1"),
        ({"tests": []}, "tests: is empty; list at least one test"),
        ({"directory": "elsewhere"}, "directory: 'elsewhere' is not a directory"),
    ],
)
def test_each_fault_of_the_campaign_file_has_its_line(tmp_path: Path, changes: dict, expected: str) -> None:
    directory = campaign(tmp_path, **changes)
    assert expected in told(directory).replace(str(tmp_path), "")


@pytest.mark.golden
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"file": "three.csv"}, "three.csv: data file not found; correct `file:`"),
        ({"role": "test"}, "tests[0].role: is 'test'; 'training', 'validation' or 'repeat' expected"),
        ({"role": None}, "tests[0].role: is missing"),
        ({"rolle": "x"}, "tests[0].rolle: unknown key"),
        ({"segments_s": [[3, 2]]}, "pairs [begin, end] with begin before end expected"),
        ({"segments_s": [2, 5]}, "a list of pairs expected, such as [[2, 5]]"),
        ({"segments_s": [[0, 2], [1, 3]]}, "segments overlap: one ends at 2 s, another begins at 1 s"),
        ({"name": "."}, "a name without '/' expected, with at least one letter or digit"),
        ({"channels": {"force": {"scale": 0}}}, "a finite number other than 0 expected"),
        ({"channels": {"force": {"column": True}}}, "write the name of a column in quotes, or its number"),
        ({"segments_s": [[30, 40]]}, "[30, 40] holds no sample; the clock of one.csv runs from 0 to 3.999 s"),
        ({"name": "two"}, "tests[1].name: 'two' is used twice"),
        ({"part": 2}, "part: is 2, the file has 1"),
        ({"file": "one.xls"}, "one.xls: data file not found"),
        ({"drive": {"value": 1.0, "unit": "V"}}, "drive: is in A in tests[1] and in V in the tests before"),
        (
            {"drive": {"value": 1.0, "unit": "V"}},
            "a command in V becomes the current with unit: A, scale:",
        ),
        ({"drive": {"value": 1.0, "column": "i", "unit": "A"}}, "either column or value expected, not both"),
        ({"drive": {"value": float("inf"), "unit": "A"}}, "a finite number expected"),
    ],
)
def test_each_fault_of_a_test_has_its_line(tmp_path: Path, change: dict, expected: str) -> None:
    tests = content()["tests"]
    tests[0] = {key: value for key, value in (tests[0] | change).items() if value is not None}
    message = told(campaign(tmp_path, tests=tests)).replace(str(tmp_path), "")
    assert expected in message


@pytest.mark.golden
@pytest.mark.parametrize("unit", ["%", "1", "Nm"])
def test_a_drive_that_is_no_current_and_no_voltage_is_told_how_to_become_one(tmp_path: Path, unit: str) -> None:
    channels = {**CHANNELS, "drive": {"column": "i", "unit": unit}}
    assert "is not a unit of current or voltage; write A or V; for percent" in told(
        campaign(tmp_path, channels=channels)
    )


@pytest.mark.golden
def test_a_faulty_channel_is_told_where_it_is_written(tmp_path: Path) -> None:
    channels = {**CHANNELS, "displacement": {"unit": "mm"}}
    assert "line 8, channels.displacement: has neither" in told(campaign(tmp_path / "a", channels=channels))
    tests = content()["tests"]
    tests[1]["channels"] = {"force": {"unit": "mm"}}
    channels = {**CHANNELS, "drive": {"column": "i", "unit": "mv"}}
    message = told(campaign(tmp_path / "c", channels=channels))
    assert (
        "campaign.yaml: line " in message and ", channels.drive: unit 'mv': is not a unit; did you mean mV?" in message
    )
    assert ", tests[1].channels.force: unit 'mm': is not a unit of force" in told(campaign(tmp_path / "b", tests=tests))


@pytest.mark.golden
def test_two_channels_of_one_column_are_refused(tmp_path: Path) -> None:
    channels = {**CHANNELS, "force": {"column": "x", "unit": "N"}}
    expected = "channels.force: names the column 'x', which is also that of displacement"
    assert expected in told(campaign(tmp_path, channels=channels))


@pytest.mark.golden
@pytest.mark.parametrize("role", ["training", "validation"])
def test_a_missing_role_is_told(tmp_path: Path, role: str) -> None:
    tests = [test | {"role": "repeat" if test["role"] == role else test["role"]} for test in content()["tests"]]
    assert f"tests: no {role} test; give at least one test" in told(campaign(tmp_path, tests=tests))


@pytest.mark.golden
@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        ("F", np.nan, "test one, force, row 1236: is NaN (no number), 1 such sample in all"),
        ("x", np.inf, "test one, displacement, row 1236: is infinite"),
        ("t", 0.5, "test one, row 1236: time goes from 1.233 to 0.5 s; a clock that increases"),
        ("t", np.nan, "test one, row 1236: time is nan"),
    ],
)
def test_bad_samples_are_told_with_their_row(tmp_path: Path, column: str, value: float, expected: str) -> None:
    columns = motion()
    columns[column][1234] = value
    assert expected in told(campaign(tmp_path, columns))


@pytest.mark.golden
def test_a_column_without_any_number_is_called_so(tmp_path: Path) -> None:
    columns = motion()
    columns["F"][:] = np.nan
    assert "test one, force: holds no number in any of 4000 samples; name another column" in told(
        campaign(tmp_path, columns)
    )


@pytest.mark.golden
def test_a_channel_that_nobody_uses_may_hold_anything(tmp_path: Path) -> None:
    columns = motion() | {"notes": np.full(4000, np.nan)}
    assert load_campaign(campaign(tmp_path, columns)).recordings[0].time_s.size == 4000


@pytest.mark.golden
def test_words_among_numbers_are_told_with_their_line(tmp_path: Path) -> None:
    directory = campaign(tmp_path)
    lines = (tmp_path / "one.csv").read_text().splitlines()
    lines[7] = lines[7].replace(lines[7].split(",")[4], "overload")
    (tmp_path / "one.csv").write_text("\n".join(lines))
    assert "one.csv: line 8, column F: 'overload' is not a number" in told(directory)


@pytest.mark.golden
def test_yaml_faults_are_told_with_their_line(tmp_path: Path) -> None:
    directory = campaign(tmp_path)
    text = (directory / "campaign.yaml").read_text()
    (directory / "campaign.yaml").write_text(text + "rig: shear-frame\n")
    assert "rig: appears already in line 2; keep one" in told(directory)
    (directory / "campaign.yaml").write_text("campaign: [1, 2\nrig: x\n")
    assert "campaign.yaml: line 2" in told(directory)
    (directory / "campaign.yaml").write_text("just words\n")
    assert "is not a mapping" in told(directory)


@pytest.mark.planted
def test_yaml_of_a_stranger_runs_nothing(tmp_path: Path) -> None:
    directory = campaign(tmp_path)
    mark = tmp_path / "ran"
    (directory / "campaign.yaml").write_text(f"campaign: !!python/object/apply:os.system ['touch {mark}']\n")
    told(directory)
    assert not mark.exists()


@pytest.mark.planted
def test_compression_as_positive_is_found_and_turned_round(tmp_path: Path) -> None:
    right = load_campaign(campaign(tmp_path / "a"))
    channels = {**CHANNELS, "force": {"column": "F", "unit": "N", "scale": -1.0}}
    wrong = load_campaign(campaign(tmp_path / "b", channels=channels))
    assert any("positive in compression" in line for line in wrong.findings)
    np.testing.assert_allclose(wrong.recordings[0].channels["force"], right.recordings[0].channels["force"])


@pytest.mark.golden
def test_a_mass_driver_needs_its_mass(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,u,a1\n" + "".join(f"{k / 10},{k % 3},{k % 4}\n" for k in range(50)))
    (tmp_path / "campaign.yaml").write_text(
        "campaign: driver\nrig: shear-frame\nchannels:\n"
        "  time: {column: t, unit: s}\n"
        "  input_force: {column: u, unit: m/s^2, floor: 1}\n"
        "  floor_acceleration_1: {column: a1, unit: m/s^2}\n"
        "tests:\n  - {name: one, file: a.csv, kind: sweep, role: training}\n"
    )
    with pytest.raises(UserError, match=r"input_force: unit 'm/s\^2': is not a unit of force; give mass_kg"):
        load_campaign(tmp_path)


@pytest.mark.property
@pytest.mark.parametrize("name", ["campaign.yaml", "own-rig.yaml"])
def test_messages_name_the_campaign_file_that_was_read(tmp_path: Path, name: str) -> None:
    campaign(tmp_path).joinpath("campaign.yaml").rename(tmp_path / name)
    loaded = load_campaign(tmp_path / name)
    assert loaded.file == tmp_path / name
    with pytest.raises(UserError, match=f"{name}: rig"):
        frame_tests(loaded)


@pytest.mark.planted
def test_clipping_dropouts_and_jitter_are_reported(tmp_path: Path) -> None:
    columns = motion()
    columns["F"] = np.clip(columns["F"], -70.0, 1e9)
    keep = np.ones(4000, dtype=bool)
    keep[1500:1520] = False
    rng = np.random.default_rng(3)
    columns["t"] = columns["t"] + 1e-4 * rng.uniform(-1, 1, 4000)
    findings = load_campaign(campaign(tmp_path, {key: value[keep] for key, value in columns.items()})).findings
    assert any(line.startswith("test one: force looks clipped") for line in findings)
    assert any("1 gap in the clock, 20 samples are missing; the first gap is at 1.499 s" in line for line in findings)
    assert any("clock jitter of" in line for line in findings)
    assert not any("test two" in line for line in findings)


@pytest.mark.planted
def test_strong_jitter_is_not_reported_as_lost_samples(tmp_path: Path) -> None:
    columns = motion()
    columns["t"] = columns["t"] + 4e-4 * np.random.default_rng(3).uniform(-1, 1, 4000)
    findings = load_campaign(campaign(tmp_path, columns)).findings
    assert [line.split(" of ")[0] for line in findings] == ["test one: clock jitter"]


@pytest.mark.planted
def test_channels_that_freeze_or_fall_out_are_reported(tmp_path: Path) -> None:
    columns = motion()
    columns["x"][2000:2030] = columns["x"][2000]
    columns["F"][3300:3303] = 0.0
    findings = load_campaign(campaign(tmp_path, columns)).findings
    assert "test one: displacement repeats one value for 30 samples at 2 s and then jumps" in findings
    assert "test one: force falls to exactly 0 in 3 samples, the first at 3.3 s" in findings
    assert len(findings) == 2


@pytest.mark.planted
def test_a_coarsely_resolved_peak_and_a_rest_are_no_clipping(tmp_path: Path) -> None:
    columns = motion()
    columns["x"] = np.round(columns["x"] / 0.05) * 0.05
    columns["x"][:500] = columns["x"].min()
    assert load_campaign(campaign(tmp_path, columns)).findings == ()


@pytest.mark.golden
def test_printed_times_are_no_jitter(tmp_path: Path) -> None:
    columns = motion(rate=3004.8)
    columns["t"] = np.array([float(f"{item:.6g}") for item in columns["t"] + 10.0])
    tests = content()["tests"]
    tests[0]["sampling_rate_hz"] = 3004.8
    read = load_campaign(campaign(tmp_path, columns, tests=tests))
    assert read.findings == ()
    np.testing.assert_allclose(np.diff(read.recordings[0].time_s), 1 / 3004.8, rtol=1e-4)


@pytest.mark.golden
def test_an_inverse_model_needs_a_drive_that_changes(tmp_path: Path) -> None:
    constant = load_campaign(campaign(tmp_path / "a"))
    with pytest.raises(UserError, match=r"drive: never changes in the training tests \(1\)"):
        require_varying({test.name: test.used("drive") for test in constant.with_role("training")}, "a")
    columns = motion()
    columns["i"] = columns["i"] * np.abs(np.sin(2 * np.pi * columns["t"]))
    varying = load_campaign(campaign(tmp_path / "b", columns))
    require_varying({test.name: test.used("drive") for test in varying.with_role("training")}, "b")


@pytest.mark.planted
def test_the_noise_of_a_current_sensor_is_not_a_drive_that_changes() -> None:
    """The means of a zero current differ by more than 1 % of their largest, so that an inverse model was trained."""
    rng = np.random.default_rng(1)
    noise = {name: 2e-3 * rng.standard_normal(3000) for name in "abcd"}
    with pytest.raises(UserError, match="never changes in the training tests"):
        require_varying(noise, "a")
    close = {name: values + level for (name, values), level in zip(noise.items(), (1.0, 1.0, 1.02, 1.02), strict=True)}
    require_varying(close, "b")
    ramp = {name: values + np.linspace(0.0, 0.05, 3000) for name, values in noise.items()}
    require_varying(ramp, "c")


FRAME = {
    "rig": "shear-frame",
    "frame": {"floor_masses_kg": [5.95, 5.95]},
    "channels": {
        "ground_acceleration": {"column": "g", "unit": "g"},
        "floor_acceleration_1": {"column": "a1", "unit": "m/s^2"},
        "floor_acceleration_2": {"column": "a2", "unit": "m/s^2"},
        "floor_displacement_2": {"column": "x2", "unit": "mm"},
    },
}


def frame(directory: Path, **changes: object) -> Path:
    rng = np.random.default_rng(5)
    columns = {name: rng.standard_normal(500) for name in ("g", "a1", "a2", "x2", "u", "f")}
    directory.mkdir()
    write_csv(directory / "sweep.csv", {key: columns[key] for key in ("g", "a1", "a2", "x2", "u")})
    write_csv(directory / "loop.csv", {key: columns[key] for key in ("g", "a1", "a2", "x2", "f")})
    tests = [
        {"name": "sweep", "file": "sweep.csv", "role": "training", "kind": "sweep"},
        {"name": "decay", "file": "sweep.csv", "mode": 2},
        {"name": "loop", "file": "loop.csv", "role": "validation", "law": "vd", "c_n_s_m": 650.0},
    ]
    import yaml

    whole = {"campaign": "f", "sampling_rate_hz": 200, "tests": tests, **FRAME, **changes}
    (directory / "campaign.yaml").write_text(yaml.safe_dump(whole))
    return directory


@pytest.mark.golden
def test_a_frame_campaign_is_read(tmp_path: Path) -> None:
    channels = FRAME["channels"] | {"damper_force": {"column": "f", "unit": "N"}}
    read = load_campaign(frame(tmp_path / "a", channels=channels))
    assert read.floor_masses_kg == (5.95, 5.95)
    sweep, decay, loop = read.recordings
    assert (sweep.kind, decay.kind, loop.kind) == ("sweep", "free-decay", "closed-loop")
    assert decay.details == {"mode": 2}
    assert loop.details == {"law": "vd", "gains": {"c_n_s_m": 650.0}}
    assert "damper_force" in loop.channels and "damper_force" not in sweep.channels
    assert np.std(sweep.channels["ground_acceleration"]) == pytest.approx(9.80665, rel=0.1)


@pytest.mark.golden
def test_a_shaker_on_a_floor(tmp_path: Path) -> None:
    channels = {key: value for key, value in FRAME["channels"].items() if key != "ground_acceleration"}
    channels["input_force"] = {"column": "u", "unit": "N", "floor": 2}
    tests = [{"name": "s", "file": "sweep.csv", "kind": "random", "role": "training"}]
    (test,) = load_campaign(frame(tmp_path / "a", channels=channels, tests=tests)).recordings
    assert test.details == {"input_force_floor": 2} and "input_force" in test.channels


@pytest.mark.golden
def test_a_mass_driver_and_unknown_masses(tmp_path: Path) -> None:
    channels = {key: value for key, value in FRAME["channels"].items() if key != "ground_acceleration"}
    channels["input_force"] = {"column": "u", "unit": "m/s^2", "floor": 2, "mass_kg": 3.0}
    channels["input_force_2"] = {"column": "u", "unit": "N", "floor": 1, "direction": "y"}
    tests = [{"name": "s", "file": "sweep.csv", "kind": "ambient", "role": "training"}]
    campaign = load_campaign(
        frame(tmp_path / "a", channels=channels, tests=tests, frame={"floor_masses_kg": [None, 2.0, 4.0]})
    )
    (test,) = campaign.recordings
    assert test.kind == "ambient"
    np.testing.assert_allclose(test.channels["input_force"], -3.0 * test.channels["input_force_2"])
    assert (test.details["input_force_floor"], test.details["input_force_2_floor"]) == (2, 1)
    assert test.details["input_force_2_direction"] == "y"
    assert np.isnan(campaign.floor_masses_kg[0]) and campaign.floor_masses_kg[1:] == (2.0, 4.0)


@pytest.mark.golden
@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"frame": {"floor_masses_kg": [1.0]}}, "has 1 of 2 masses; give one for each measured floor"),
        ({"frame": {"floor_masses_kg": [1.0, -2.0]}}, "masses above zero expected"),
        ({"tests": [{"name": "s", "file": "sweep.csv"}]}, "kind: is missing; write kind: sweep, free-decay"),
        ({"channels": {"floor_acc_1": {"column": "a1", "unit": "m/s^2"}}}, "unknown channel; did you mean"),
    ],
)
def test_faults_of_a_frame_campaign(tmp_path: Path, changes: dict, expected: str) -> None:
    assert expected in told(frame(tmp_path / "a", **changes))


@pytest.mark.property
def test_messages_name_files_without_detours(tmp_path: Path) -> None:
    campaign(tmp_path / "project" / "data", directory="../../files")
    files = tmp_path / "files"
    files.mkdir()
    with pytest.raises(UserError, match="data file not found") as caught:
        load_campaign(tmp_path / "project" / "data")
    assert str(caught.value).startswith(f"{files}/")
