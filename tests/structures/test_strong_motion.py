"""Strong-motion records: CSMIP V2, COSMOS V2 and the zip of CESMD, as downloaded."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.files import open_data_file
from mrpipe.campaigns.readers.cosmos import read_strong_motion
from mrpipe.errors import UserError
from mrpipe.structures.records import read_motion

# numbers of full width run together, as in Fortran's fixed columns
GROUND = 100.0 * np.sin(np.arange(403) / 7.0)
GROUND[5] = -1234.567


def _block(values: np.ndarray) -> str:
    rows = [values[start : start + 8] for start in range(0, values.size, 8)]
    return "\n".join("".join(f"{value:10.3f}" for value in row) for row in rows) + "\n"


def _csmip(channel: int, place: str, values: np.ndarray) -> str:
    return (
        "Corrected accelerogram   Channel  {0}   CSMIP\nNorthridge Earthquake\n"
        "Chan  {0}: {1}        Station No. 24386\n"
        "{2}\n{3:6d} points of accel data equally spaced at  .020 sec, in cm/sec2.\n{4}"
        "{3:6d} points of veloc data equally spaced at  .020 sec, in cm/sec.\n{4}"
        "/&  ----------  End of data for channel  {0}  ----------\n"
    ).format(channel, place, "     1    2    3\n" * 7, values.size, _block(values))


def _cosmos(values: np.ndarray) -> str:
    return (
        "Corrected acceleration  (Format v01.20 with 13 text lines) Src: 0000\n"
        "Record: 12  Chan   4: 360 Deg\n 100 Real-header values follow on 20 lines, Format= (5F15.6)\n"
        "        0.010000      -999.000000       34.200000     -118.500000        5.000000\n"
        f"{values.size:8d} acceleration pts, approx   4 secs, units=cm/sec2 (04),Format=(8f10.3)\n{_block(values)}"
        "End-of-data for Chan  4 acceleration\n"
    )


@pytest.mark.golden
def test_csmip_with_two_channels(tmp_path: Path) -> None:
    path = tmp_path / "CHAN.V2"
    path.write_text(_csmip(1, "90 Deg", GROUND) + _csmip(2, "Up", 0.5 * GROUND))
    first, second = read_strong_motion(path)
    assert (first.name, first.interval_s, first.vertical) == ("1: 90 Deg", 0.02, False)
    assert second.vertical
    np.testing.assert_allclose(first.acceleration_m_s2, 1e-2 * GROUND, atol=1e-5)
    file = open_data_file(path)
    assert file.sampling_rate_hz == pytest.approx(50.0)
    np.testing.assert_allclose(file.column("2", "test"), 0.5e-2 * GROUND, atol=1e-5)


@pytest.mark.golden
def test_cosmos(tmp_path: Path) -> None:
    (tmp_path / "a.v2c").write_text(_cosmos(GROUND))
    (channel,) = read_strong_motion(tmp_path / "a.v2c")
    assert (channel.name, channel.interval_s) == ("4: 360 Deg", 0.01)
    np.testing.assert_allclose(channel.acceleration_m_s2, 1e-2 * GROUND, atol=1e-5)


@pytest.mark.golden
def test_a_zip_of_cesmd_and_as_ground_motion(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "record.zip", "w") as archive:
        archive.writestr("readme.txt", "notes")
        archive.writestr("p/CHAN001.V2", _csmip(1, "90 Deg", GROUND))
        archive.writestr("p/CHAN002.V2", _csmip(2, "Up", GROUND))
        archive.writestr("p/CHAN003.V2", _csmip(3, "360 Deg", 2.0 * GROUND))
    assert [item.name for item in read_strong_motion(tmp_path / "record.zip")] == ["1: 90 Deg", "2: Up", "3: 360 Deg"]
    motion = read_motion(tmp_path / "record.zip")
    assert motion.components == 2 and motion.interval_s == pytest.approx(0.02)
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 1], 2e-2 * GROUND, atol=1e-4)


@pytest.mark.golden
def test_a_record_that_breaks_off(tmp_path: Path) -> None:
    (tmp_path / "a.V2").write_text(_csmip(1, "90 Deg", GROUND)[:2000])
    with pytest.raises(UserError, match="promises 403 values"):
        read_strong_motion(tmp_path / "a.V2")
    (tmp_path / "b.V2").write_text("nothing of the kind\n")
    with pytest.raises(UserError, match="holds no acceleration in V2 form"):
        read_motion(tmp_path / "b.V2")
