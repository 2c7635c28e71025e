"""The table of tests that `prepare` prints."""

from __future__ import annotations

from typing import Any

import pytest

from mrpipe.cli.output import print_summary
from mrpipe.reporting.prepared_rows import to_read

pytestmark = pytest.mark.golden

ROW: dict[str, Any] = {
    "name": "a",
    "role": "training",
    "excitation": "periodic",
    "duration_s": 6.0,
    "frequency_hz": 0.9998,
    "amplitude_m": 0.005003,
    "cycles": 3,
    "displacement_offset_m": -4.992e-7,
    "force_offset_n": -0.1316,
    "displacement_peak_m": 0.005004,
    "force_peak_n": 162.2,
    "velocity_peak_m_s": 0.03283,
    "drive_mean": -2.538e-5,
    "cutoffs_hz": {"force": 100.0},
}
RANDOM = {**ROW, "name": "b", "excitation": "random", "frequency_hz": 0.0, "amplitude_m": 0.0, "cycles": 0}


def test_prepared_tests_are_in_usual_units_without_numbers_of_noise() -> None:
    row, other = to_read("prepare", {"drive_unit": "V", "tests": [ROW, RANDOM]})["tests"]
    assert row == {
        "test": "a",
        "role": "training",
        "motion": "periodic",
        "duration [s]": "6.00",
        "frequency [Hz]": "1.00",
        "amplitude [mm]": "5.00",
        "cycles": "3",
        "drive mean [V]": "0.000",
        "force peak [N]": "162",
        "speed peak [m/s]": "0.0328",
        "displacement peak [mm]": "5.00",
        "force offset [N]": "-0.132",
        "displacement offset [mm]": "0.000",
        "force cutoff [Hz]": "100",
    }
    assert [other[name] for name in ("frequency [Hz]", "amplitude [mm]", "cycles")] == [None] * 3


def test_a_campaign_without_drive_has_no_column_of_it_and_the_rest_stays(capsys: pytest.CaptureFixture[str]) -> None:
    summary = to_read("prepare", {"campaign": "rig", "drive_unit": "", "tests": [ROW, RANDOM]})
    assert not any("drive" in name for name in summary["tests"][0])
    print_summary("prepare", summary)
    lines = capsys.readouterr().out.splitlines()
    assert "  campaign: rig" in lines
    assert lines[-1].split() == ["b", "5.00", "-0.132", "0.000", "100"], "a part of the table begins with the test"
    assert any(line.split()[:7] == ["b", "training", "random", "6.00", "-", "-", "-"] for line in lines)
    assert to_read("sweep", {"tests": [ROW]}) == {"tests": [ROW]}
