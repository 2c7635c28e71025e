"""Directions, units and quantities in headers of PEER records; the layouts are those of distributed files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.readers.peer import is_vertical
from mrpipe.campaigns.readers.strong_motion import read_strong_motion
from mrpipe.errors import UserError

pytestmark = pytest.mark.golden

SAMPLES = np.round(0.2 * np.sin(np.arange(23) / 3.0), 7)


def at2(second: str = "SOMEWHERE 01/16/95 2046, STATION, 090 (XYZ)", third: str = "IN UNITS OF G") -> str:
    rows = ["".join(f"{value:15.7E}" for value in SAMPLES[at : at + 5]) for at in range(0, SAMPLES.size, 5)]
    head = ["PEER NGA STRONG MOTION DATABASE RECORD", second, third, "NPTS=    23, DT=   .0050 SEC,"]
    return "\n".join([*head, *rows, ""])


@pytest.mark.parametrize(
    ("name", "vertical"),
    [
        ("RSN1_A_IWT010UD", True),
        ("45C00DN", True),
        ("I-ELC-UP", True),
        ("NISUP", True),
        ("CHY080-V", True),
        ("AKBMRHNZ", True),
        ("I-ELC180", False),
        ("IWT010EW", False),
        ("CLOUD", False),
        ("LINDN090", False),
    ],
)
def test_a_vertical_component_by_its_name(name: str, vertical: bool) -> None:
    assert is_vertical(name) is vertical


def test_a_vertical_component_by_its_header(tmp_path: Path) -> None:
    for component, vertical in (("UP (CUE)", True), ("UD", True), ("V", True), ("HNZ", True), ("090 (CUE)", False)):
        (tmp_path / "a.AT2").write_text(at2(f"Somewhere, 6/13/2008, Station, {component}"))
        assert read_strong_motion(tmp_path / "a.AT2")[0].vertical is vertical


@pytest.mark.parametrize(
    ("third", "factor"),
    [
        ("ACCELERATION TIME SERIES IN UNITS OF G", 9.80665),
        ("ACCELERATION TIME SERIES (CM/SEC/SEC)", 1e-2),
        ("Acceleration in cm/s/s, band-pass in Hz", 1e-2),
        ("The units are m/s^2", 1.0),
        ("ACCELERATION TIME SERIES", 9.80665),
    ],
)
def test_the_unit_in_the_words_of_other_programs(tmp_path: Path, third: str, factor: float) -> None:
    (tmp_path / "a.AT2").write_text(at2(third=third))
    np.testing.assert_allclose(read_strong_motion(tmp_path / "a.AT2")[0].acceleration_m_s2, factor * SAMPLES)


@pytest.mark.planted
def test_a_velocity_under_another_ending_is_refused(tmp_path: Path) -> None:
    for third in ("VELOCITY TIME SERIES IN UNITS OF CM/S", "DISPLACEMENT TIME SERIES"):
        (tmp_path / "a.AT2").write_text(at2(third=third))
        with pytest.raises(UserError, match=r"a\.AT2: header: .*not an acceleration"):
            read_strong_motion(tmp_path / "a.AT2")
