"""Strong-motion records: CSMIP V2, COSMOS V2 and the zip of CESMD, as downloaded."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.files import open_data_file
from mrpipe.campaigns.readers.strong_motion import read_strong_motion
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
    with pytest.raises(UserError, match=r"line 1: begins with 'nothing of the kind'.*points of accel data"):
        read_motion(tmp_path / "b.V2")


def _cosmos_120(channel: str, unit: str, form: str, rows: str, *, step_ms: float, azimuth: int, seconds: int) -> str:
    """Return a record with the complete headers of COSMOS V1.20, as CESMD writes them."""
    integers = [-999] * 100
    integers[53] = azimuth
    reals = [-999.0] * 100
    reals[29], reals[33], reals[61] = 0.02, 0.005, step_ms
    count = len(rows.split())
    return (
        "Corrected acceleration    (Format v01.20 with 13 text lines) Src: 0000\n" + 7 * "Text\n"
        f"Sta Chan {channel} (Rcrdr Chan  1) Location:Roof: East\n"
        "Raw record length = 120.900 sec, Uncor max =    0.000        at    0.000 sec\n" + 3 * "Text\n"
        " 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
        + "\n".join("".join(f"{value:8d}" for value in integers[at : at + 10]) for at in range(0, 100, 10))
        + "\n 100 Real-header values follow on  20 lines, Format= (5F15.6)\n"
        + "\n".join("".join(f"{value:15.6f}" for value in reals[at : at + 5]) for at in range(0, 100, 5))
        + '\n   1 Comment line(s) follow, each starting with a "|":\n|<PROCESS> AUTO\n'
        f"{count:8d} acceleration pts, approx {seconds:4d} secs, units={unit},Format={form}\n{rows}\n"
        f"End-of-data for Chan  1 acceleration\n"
    )


COLUMN = "\n".join(f"{value:15.6E}" for value in GROUND)


@pytest.mark.golden
@pytest.mark.parametrize("form", ["(1E15.6)", "(1F15.6E)", "(1P1E15.6)"])
def test_one_number_in_a_line_with_an_exponent(tmp_path: Path, form: str) -> None:
    text = _cosmos_120("HNE: 90 deg", "cm/sec2(04)", form, COLUMN, step_ms=8.0, azimuth=90, seconds=3)
    (tmp_path / "a.V2c").write_text(text)
    (channel,) = read_strong_motion(tmp_path / "a.V2c")
    assert (channel.name, channel.interval_s) == ("HNE: 90 deg, Roof: East", 0.008)
    np.testing.assert_allclose(channel.acceleration_m_s2, 1e-2 * GROUND, rtol=1e-6, atol=1e-9)


@pytest.mark.golden
def test_units_of_cosmos_and_azimuths_of_vertical_channels(tmp_path: Path) -> None:
    for unit, factor in (("g (02)", 9.80665), ("g/10 (11)", 0.980665), ("in/sec2 (07)", 0.0254)):
        text = _cosmos_120("1: Up", unit, "(1E15.6)", COLUMN, step_ms=-999.0, azimuth=400, seconds=2)
        (tmp_path / "a.v2").write_text(text.replace("1: Up", "1: 400 deg"))
        (channel,) = read_strong_motion(tmp_path / "a.v2")
        assert channel.vertical and channel.interval_s == 0.005
        np.testing.assert_allclose(channel.acceleration_m_s2, factor * GROUND, rtol=1e-6, atol=1e-6)
    (tmp_path / "a.v1").write_text(text.replace("units=in/sec2 (07)", "units=counts (50)"))
    with pytest.raises(UserError, match="samples in counts, which is not a unit of acceleration"):
        read_strong_motion(tmp_path / "a.v1")


@pytest.mark.golden
def test_an_uncorrected_record_and_its_numbers_without_a_format(tmp_path: Path) -> None:
    rows = "  -0.269     0.387    -0.111\n" * 10
    (tmp_path / "a.v1").write_text(f"Sta Chan 2: 360 deg (Rcrdr Chan  2)\n30 uncor. accel. pts, approx 1 secs\n{rows}")
    (channel,) = read_strong_motion(tmp_path / "a.v1")
    assert channel.name == "2: 360 deg"
    np.testing.assert_allclose(channel.acceleration_m_s2[:4], [-0.00269, 0.00387, -0.00111, -0.00269])


@pytest.mark.golden
def test_a_zip_of_several_stations(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "station.zip", "w") as archive:
        archive.writestr("ce24386/processed/CHAN001.V2", _csmip(1, "90 Deg", GROUND))
        archive.writestr("ce24386/raw/CHAN001.V1", _csmip(1, "90 Deg", 7.0 * GROUND))
        archive.writestr("__MACOSX/ce24386/._CHAN001.V2", b"\x00\x05\x16\x07")
    with zipfile.ZipFile(tmp_path / "event.zip", "w") as archive:
        archive.write(tmp_path / "station.zip", "Northridge/station.zip")
    (channel,) = read_strong_motion(tmp_path / "event.zip")
    np.testing.assert_allclose(channel.acceleration_m_s2, 1e-2 * GROUND, atol=1e-5)
    (tmp_path / "no.zip").write_text("an error page")
    with pytest.raises(UserError, match="is not a zip file that can be read"):
        read_strong_motion(tmp_path / "no.zip")


def _at2(header: str, values: np.ndarray) -> str:
    rows = [values[at : at + 5] for at in range(0, values.size, 5)]
    body = "\n".join("".join(f"{value:15.7E}" for value in row) for row in rows)
    return f"PEER NGA DATABASE\nImperial Valley-02, El Centro, 180\nACCELERATION IN UNITS OF G\n{header}\n{body}\n"


@pytest.mark.golden
def test_peer_records_as_a_file_of_a_campaign_and_in_their_zip(tmp_path: Path) -> None:
    record = 1e-4 * GROUND
    heads = ("NPTS=    403, DT=   .0050 SEC", "  403   0.0050   NPTS, DT")
    for head in heads:
        (tmp_path / "a.AT2").write_text(_at2(head, record))
        file = open_data_file(tmp_path / "a.AT2")
        assert file.sampling_rate_hz == pytest.approx(200.0)
        np.testing.assert_allclose(file.column("a", "test"), 9.80665 * record, atol=1e-6)
    with zipfile.ZipFile(tmp_path / "PEERNGARecords_Unscaled.zip", "w") as archive:
        for name, share in (("ELC-UP", 0.5), ("ELC180", 1.0), ("ELC270", 2.0)):
            archive.writestr(f"RSN6_{name}.AT2", _at2(heads[0], share * record))
            archive.writestr(f"RSN6_{name}.VT2", _at2(heads[0], share * record))
        archive.writestr("_SearchResults.csv", "a,b")
    motion = read_motion(tmp_path / "PEERNGARecords_Unscaled.zip")
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 1], 2.0 * 9.80665 * record, atol=1e-5)
    assert "RSN6_ELC180 and RSN6_ELC270" in motion.notes[0]
    (tmp_path / "a.VT2").write_text("")
    with pytest.raises(UserError, match=r"is a record of velocity; give the \.AT2 file"):
        read_motion(tmp_path / "a.VT2")


@pytest.mark.golden
def test_csmip_volume_1_in_units_of_g(tmp_path: Path) -> None:
    """The line before the samples and their columns are those of a volume 1 file of CSMIP from 2012."""
    path = tmp_path / "CE89146.V1"
    path.write_text(
        "Uncorrected Accelerogram Data             Processed: 02/13/12, CGS  146be002    \n"
        "Chan  1: 360 Deg                                                                \n"
        "     4 Accelerogram points at 200 pts/sec in units of g .      Format: (8f9.6)  \n"
        "  .000010  .000010 -.000007-1.000002\n"
    )
    (found,) = read_strong_motion(path)
    np.testing.assert_allclose(found.acceleration_m_s2, 9.80665 * np.array([1e-5, 1e-5, -7e-6, -1.000002]))
    assert (found.name, found.interval_s, found.vertical) == ("1: 360 Deg", 0.005, False)
