"""Records in SMC form and corrected records of GeoNet; the layouts are those of distributed files, the values invented.

Layouts: the San Francisco records of 1989 in SMC form (several comment lines, samples that run together), and a V2A
file of 2018 (three components with velocity and displacement).
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.files import open_data_file
from mrpipe.campaigns.readers.strong_motion import read_strong_motion
from mrpipe.errors import UserError
from mrpipe.simulation.ground_record import read_histories
from mrpipe.structures.records import read_motion

pytestmark = pytest.mark.golden

COUNT = 203
RECORD = np.round(-120.0 * np.sin(np.arange(COUNT) / 7.0) * np.hanning(COUNT), 3)
"""Acceleration [cm/s^2]."""
NONE, NO_REAL = -32768, 0.17e39


def smc(
    values: np.ndarray = RECORD,
    *,
    kind: str = "2 CORRECTED ACCELEROGRAM",
    from_vertical: int = 90,
    azimuth: int = 360,
    channel: int = 1,
    rate: float = 200.0,
    fine: bool = False,
    start: tuple[int, ...] = (1989, 291, 0, 4, 0, NONE),
) -> str:
    component = str(azimuth) if from_vertical == 90 else "up"
    text = [kind, "*", "SAF0A", "     1989  10  18    0004 Somewhere, CA", "Moment Mag=      7.1 Ms=      7.1"]
    text += [f"station = Somewhere, 1 Main St       F component=    {component}", "epicentral dist =     89.0"]
    text += ["inst type=SMA-1      data source = USGS", "*", "*", "*"]
    integers = np.full(48, NONE)
    integers[1:7] = start
    integers[7:17] = (111, channel, 3, 3, NONE, from_vertical, azimuth, 101, 3, len(values))
    integers[46] = 8 if fine else NONE
    reals = np.full(50, NO_REAL)
    reals[1] = rate
    rows = ["".join(f"{value:10d}" for value in integers[at : at + 8]) for at in range(0, 48, 8)]
    rows += ["".join(f"{value:15.7E}" for value in reals[at : at + 5]) for at in range(0, 50, 5)]
    comments = ["|", "|ref - 1989 8.0 9.0", "|"]
    per_row, digits, width = (5, 7, 14) if fine else (8, 4, 10)

    def written(value: float) -> str:
        # Fortran writes one digit of the exponent: 1.5057E+0, so that negative numbers run together
        mantissa, _, exponent = f"{value:.{digits}E}".partition("E")
        return f"{mantissa}E{exponent[0]}{int(exponent[1:])}".rjust(width)

    samples = ["".join(map(written, values[at : at + per_row])) for at in range(0, len(values), per_row)]
    return "\n".join([*text, *rows, *comments, *samples]) + "\n"


def test_a_horizontal_component_in_smc_form(tmp_path: Path) -> None:
    path = tmp_path / "0111a.smc"
    path.write_text(smc())
    [found] = read_strong_motion(path)
    np.testing.assert_allclose(found.acceleration_m_s2, 0.01 * RECORD, rtol=5.1e-5)
    assert (found.name, found.vertical, found.start_s) == ("1: 360 Deg, Somewhere, 1 Main St F", False, None)
    assert found.interval_s == pytest.approx(0.005)
    assert "1" in open_data_file(path).aliases
    time_s, histories = read_histories(path, "m/s^2")
    assert histories.shape == (COUNT, 1) and time_s[-1] == pytest.approx(0.005 * (COUNT - 1))
    motion = read_motion(path)
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 0], 0.01 * RECORD, atol=1e-4)


def test_fine_samples_a_vertical_component_and_a_start(tmp_path: Path) -> None:
    path = tmp_path / "up.SMC"
    path.write_text(smc(fine=True, from_vertical=0, channel=2, rate=100.0, start=(1994, 17, 12, 31, 5, 250)))
    [found] = read_strong_motion(path)
    np.testing.assert_allclose(found.acceleration_m_s2, 0.01 * RECORD, rtol=1e-7, atol=1e-12)
    assert found.vertical and found.name.startswith("2: up")
    later = tmp_path / "later.smc"
    later.write_text(smc(start=(1994, 18, 12, 31, 5, 500)))
    assert read_strong_motion(later)[0].start_s == pytest.approx((found.start_s or 0.0) + 86400.25)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (smc(kind="3 VELOCITY"), "line 1: begins with '3 VELOCITY' and holds no accelerogram"),
        (smc(kind="1 UNCORRECTED ACCELEROGRAM", rate=NO_REAL), "pairs of time and acceleration at uneven times"),
        (smc()[:-900], "integer header 17: promises 203 finite samples"),
        ("\n".join(smc().splitlines()[:15]), "is not a row of the header in SMC form"),
        ("", "line 1: begins with"),
    ],
)
def test_what_an_smc_file_lacks_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "a.smc"
    path.write_text(text)
    with pytest.raises(UserError, match=words) as caught:
        read_strong_motion(path)
    assert "\n" not in str(caught.value)


def geonet(directions: tuple[str, ...] = ("S16W", "N74W", "Up"), scale: tuple[float, ...] = (1.0, -0.5, 0.25)) -> str:
    lines = []
    for direction, factor in zip(directions, scale, strict=True):
        lines += ["Corrected accelerogram 20180212_211554_ABCD_20 GNS Science", "Site ABCD", "Somewhere"]
        lines += ["Instrument Basalt_1", "Resolution: 24-bit", "Accelerogram", "6 km south", "2018 February 12"]
        lines += ["Epicentre", "Number of points", "Instrument corrected data at 0.020 sec intervals", "Band-pass"]
        lines += [
            f"Component {direction}  Longitudinal Accelerometer Axis",
            "Acceleration:",
            "Velocity:",
            "Displacement:",
        ]
        integers = np.zeros(40, dtype=int)
        integers[[8, 9, 18, 19]] = (2018, 2, 12, 21)
        integers[[30, 33, 34, 35, 38, 39]] = (21200, COUNT, COUNT, COUNT, 15, 17000)
        reals = np.zeros(60)
        reals[[24, 25, 29]] = (0.005, 0.02, 9806.6)
        lines += ["".join(f"{value:8d}" for value in integers[at : at + 10]) for at in range(0, 40, 10)]
        lines += ["".join(f"{value:8.4f}"[:8] for value in reals[at : at + 10]) for at in range(0, 60, 10)]
        for values in (10.0 * factor * RECORD, np.ones(COUNT), 2.0 * np.ones(COUNT)):
            lines += ["".join(f"{value:8.1f}" for value in values[at : at + 10]) for at in range(0, COUNT, 10)]
    return "\n".join(lines) + "\n"


def test_three_components_of_geonet(tmp_path: Path) -> None:
    path = tmp_path / "20180212_211557_ABCD_20.V2A"
    path.write_text(geonet())
    first, second, up = read_strong_motion(path)
    np.testing.assert_allclose(first.acceleration_m_s2, 0.01 * RECORD, atol=1e-4)
    np.testing.assert_allclose(second.acceleration_m_s2, -0.005 * RECORD, atol=1e-4)
    assert (first.name, second.name, up.name) == ("1: S16W", "2: N74W", "3: Up")
    assert not first.vertical and not second.vertical and up.vertical
    assert first.interval_s == 0.02 and first.start_s == up.start_s is not None
    assert read_histories(path, "m/s^2")[1].shape == (COUNT, 2)


def test_what_a_geonet_file_lacks_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.v2a"
    path.write_text("Uncorrected accelerogram 2018 GNS Science\n")
    with pytest.raises(UserError, match="line 1: begins component 1 with 'Uncorrected"):
        read_strong_motion(path)
    path.write_text("\n".join(geonet().splitlines()[:40]))
    with pytest.raises(UserError, match="numbers, 203 are promised"):
        read_strong_motion(path)
    uncorrected = tmp_path / "a.V1A"
    uncorrected.write_text("Uncorrected accelerogram")
    with pytest.raises(UserError, match=r"uncorrected record of GeoNet.*give the \.V2A file"):
        read_histories(uncorrected, "m/s^2")


def test_records_of_both_forms_in_a_zip(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "download.zip", "w") as archive:
        archive.writestr("a/0111a.smc", smc())
        archive.writestr("a/0111b.smc", smc(channel=3, azimuth=90))
    names = [item.name for item in read_strong_motion(tmp_path / "download.zip")]
    assert [name[:8] for name in names] == ["1: 360 D", "3: 90 De"]
