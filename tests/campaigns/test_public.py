"""The public campaigns as the mappings of configs/campaigns read them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import config_directory
from mrpipe.campaigns import Campaign, campaign_files, describe, load_campaign, require_varying
from mrpipe.errors import UserError


def read(name: str) -> Campaign:
    return load_campaign(config_directory() / "campaigns" / f"{name}.yaml")


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "roles", "unit", "rates", "set_point"),
    [
        ("utfsm", (18, 12), "A", {200.0, 1000.0}, True),
        ("utfsm-raw", (9, 6), "A", {200.0, 1000.0}, True),
        ("labcontrol", (28, 9), "V", {100.0}, True),
        ("dyke", (1, 1), "V", {3004.8}, False),
    ],
)
def test_each_is_read_whole(
    public_data: Path, name: str, roles: tuple[int, int], unit: str, rates: set[float], set_point: bool
) -> None:
    campaign = read(name)
    assert (len(campaign.with_role("training")), len(campaign.with_role("validation"))) == roles
    assert (campaign.drive_unit, campaign.drive_is_set_point) == (unit, set_point)
    assert {test.sampling_rate_hz for test in campaign.recordings} == rates
    assert campaign.findings == ()
    require_varying({test.name: test.used("drive") for test in campaign.with_role("training")}, name)
    assert all(file.is_file() for file in campaign_files(config_directory() / "campaigns" / f"{name}.yaml"))


@pytest.mark.real
def test_figures_that_the_data_are_known_by(public_data: Path) -> None:
    by_name = {test.name: test for test in read("utfsm").recordings}
    peaks = {
        current: max(np.abs(test.channels["force"]).max() for name, test in by_name.items() if name.endswith(current))
        for current in ("-0A", "-1A")
    }
    assert peaks["-0A"] == pytest.approx(225, abs=1) and peaks["-1A"] == pytest.approx(1560, rel=0.01)
    assert np.ptp(by_name["2mm-5Hz-1A"].channels["displacement"]) / 2 == pytest.approx(1.62e-3, rel=0.01)
    raw = {test.name: test for test in read("utfsm-raw").recordings}
    # the processed records are the raw ones but for the authors' smoothing and their choice of zero
    for name in ("5mm-3Hz-1A", "25mm-0.5Hz-0.5A"):
        for channel in ("displacement", "force"):
            ratio = np.ptp(raw[name].channels[channel]) / np.ptp(by_name[name].channels[channel])
            assert 0.99 < ratio < 1.1
    dyke = read("dyke").recordings
    assert np.mean(np.concatenate([test.channels["force"] for test in dyke])) == pytest.approx(-120, abs=10)
    assert dyke[0].time_s[-1] == pytest.approx(12.0, abs=1e-3) and dyke[1].time_s[-1] == pytest.approx(20.5, abs=1e-3)


@pytest.mark.real
def test_a_description_holds_what_a_reader_asks_first(public_data: Path) -> None:
    told = describe(read("labcontrol"))
    assert told["test_count"] == 37 and told["roles"] == {"training": 28, "validation": 9, "repeat": 0}
    assert told["drive_unit"] == "V" and told["drive_is_set_point"] is True
    first = told["tests"][0]
    assert first["name"] == "ensaio1.1" and first["duration_s"] == pytest.approx(30.01)
    assert first["channels"]["displacement"]["maximum"] == pytest.approx(24.7e-3)


@pytest.mark.golden
def test_missing_public_data_are_told_in_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MRPIPE_DATA", str(tmp_path))
    with pytest.raises(
        UserError, match=r"line \d+, directory: the public measurements 'utfsm' are not on this machine"
    ):
        read("utfsm")
