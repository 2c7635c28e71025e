"""Strong-motion records in the layouts that data centres deliver; names and values are invented.

The layouts are those of files of CSMIP (bridge of 2021, film record of 1983), of the Southern California network (2019,
CRLF), of the Alaskan network in COSMOS form (2018), and of PEER and its users. All of them were read before.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.files import open_data_file
from mrpipe.campaigns.proposal.propose import propose_campaigns
from mrpipe.campaigns.readers.channel_header import channel_name, is_vertical, start_s
from mrpipe.campaigns.readers.fortran import row_of_numbers
from mrpipe.campaigns.readers.strong_motion import read_strong_motion
from mrpipe.errors import UserError
from mrpipe.simulation.ground_record import read_histories
from mrpipe.structures.records import read_motion

RECORD = np.round(3.0 * np.sin(np.arange(403) / 7.0) * np.hanning(403), 7)


def _fixed(values: np.ndarray, width: int = 10, digits: int = 7, per_row: int = 8) -> str:
    rows = [values[at : at + per_row] for at in range(0, values.size, per_row)]
    return "\n".join("".join(f"{value:{width}.{digits}f}" for value in row) for row in rows)


def _bridge(number: int, direction: str, location: str, values: np.ndarray, *, station: int = 0, start: str) -> str:
    """Return a channel in the layout of a bridge record of 2021: columns that run together, names that are cut."""
    other = f"    (Sta Chn: {station})" if station else ""
    return (
        f"Corrected accelerogram   00001-G0000-21116.07       Chan {number:2d}:  {direction}       from   \n"
        "Uncorrected Accelerogram Data             Processed: 05/19/21, CGS  00001001    \n"
        f"00001-G0000-21116.07                 Start time:  {start} UTC (GPS) \n"
        "Station No. 00001   37.000N, 122.000W    Granit  s/n  000  (2 Chns of 20 at Sta)\n"
        "Somewhere - Long Name of an Interchange Bridge  CGS   Data: Acceleration              \n"
        f"Chan {number:2d}:  {direction}{other}     Location: {location}  \n"
        f"{values.size:6d} points of instrument- and baseline-corrected accel, veloc and displ data\n"
        "At equally-spaced intervals of   0.005  sec.\n"
        f"00001-G0000-21116.07      Somewhere - Long Name of an Interchange Bridge  CGChan {number:2d}:\n{direction}\n"
        "    2  100   25    2   20  200    1    3    2   24   30  133    000001    3    0\n"
        " 1.5717213-0.0391561 0.0226947 49.000000 25.000000 35.900002 13.700000 71.959999\n"
        f"{values.size:6d} points of accel data equally spaced at 0.005 sec, in cm/sec2. (8f10.7)\n{_fixed(values)}\n"
        f"{values.size:6d} points of veloc data equally spaced at 0.005 sec, in cm/sec.  (8f10.7)\n{_fixed(values)}\n"
        f"/&  ----------  End of data for channel {number:2d}  ----------\n"
    )


START = "4/26/21, 17:09:54.0"


@pytest.mark.golden
def test_a_bridge_with_one_file_for_each_channel_in_a_zip(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "bridge.zip", "w") as archive:
        archive.writestr("b/chan001.v2", _bridge(1, "Up", "Abutment 1", RECORD, start=START))
        archive.writestr("b/chan002.v2", _bridge(2, "Tran", "Deck Level near Abut 1", 0.5 * RECORD, start=START))
        text = _bridge(2, "Tran", "Bent 4: South Column, Grnd Level", RECORD, station=25, start=START)
        archive.writestr("b/chan025.v2", text.replace("\n", "\r\n"))
    up, deck, ground = read_strong_motion(tmp_path / "bridge.zip")
    assert [up.name, deck.name] == ["1: Up, Abutment 1", "2: Tran, Deck Level near Abut 1"]
    assert ground.name == "25: Tran, Bent 4: South Column, Grnd Level", "the station's number, not the recorder's"
    assert (up.vertical, deck.vertical, ground.vertical) == (True, False, False)
    np.testing.assert_allclose(ground.acceleration_m_s2, 1e-2 * RECORD, atol=1e-12)
    np.testing.assert_allclose(open_data_file(tmp_path / "bridge.zip").column("25", "test"), 1e-2 * RECORD, atol=1e-12)
    proposal = propose_campaigns(tmp_path, "bridge", None, tmp_path)[0]
    assert proposal.rig == "frame"
    assert proposal.channels["ground_acceleration"] == "25: Tran, Bent 4: South Column, Grnd Level [m/s^2]"
    assert proposal.channels["floor_acceleration_1"] == "2: Tran, Deck Level near Abut 1 [m/s^2]"
    assert "Columns not used: 1: Up" in proposal.text and proposal.tests == (("bridge", "random"),)


@pytest.mark.golden
def test_recorders_that_start_and_stop_at_their_own_times(tmp_path: Path) -> None:
    path = tmp_path / "a.V2"
    late = RECORD[200:]
    path.write_text(
        _bridge(1, "Tran", "Deck", RECORD, start=START) + _bridge(2, "Tran", "Pier", late, start="4/26/21, 17:09:55.0")
    )
    file = open_data_file(path)
    np.testing.assert_allclose(file.column("1", "test"), file.column("2", "test"))
    assert file.time_s is not None and file.time_s.size == late.size
    time_s, histories = read_histories(path, "m/s^2")
    assert histories.shape == (late.size, 2) and time_s[1] == pytest.approx(0.005)
    np.testing.assert_allclose(read_motion(path, unit="m/s^2").acceleration_m_s2[:, 0], 1e-2 * late, atol=1e-12)
    path.write_text(
        _bridge(1, "Tran", "Deck", RECORD, start=START) + _bridge(2, "Tran", "Pier", late, start="4/27/21, 17:09:54.0")
    )
    with pytest.raises(UserError, match="share no time: they start up to 86400 s apart"):
        open_data_file(path)


@pytest.mark.golden
def test_a_film_record_in_capitals_with_a_unit_in_brackets(tmp_path: Path) -> None:
    text = (
        "CORRECTED ACCELEROGRAM   00001-S0000-83123.01       CHAN  1:  90 DEG     FROM\n"
        "00001-S0000-83123.01               TRIGGER TIME: 05/02/83, 16:42:48.2 PDT\n"
        "SOMEWHERE FAULT ZONE 14\nCHAN  1:  90 DEG\n"
        f"  {RECORD.size} POINTS OF INSTRUMENT- AND BASELINE-CORRECTED ACCEL, VELOC AND DISPL DATA\n"
        "PEAK ACCELERATION =    -2.999    CM/SEC/SEC  AT   10.940   SEC.\n"
        "00001-S0000-83123.01      SOMEWHERE FAULT ZONE 14   CHAN  1:  90 DEG\n\n"
        f" {RECORD.size} POINTS OF ACCEL DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: UNIT)\n{_fixed(RECORD, digits=3)}\n"
    )
    for unit, factor in (("CM/SEC/SEC", 1e-2), ("G", 9.80665)):
        (tmp_path / "a.V2").write_text(text.replace("UNIT)", f"{unit})"))
        (found,) = read_strong_motion(tmp_path / "a.V2")
        assert (found.name, found.interval_s) == ("1: 90 DEG", 0.02)
        np.testing.assert_allclose(found.acceleration_m_s2, factor * RECORD, atol=factor * 6e-4)


@pytest.mark.golden
def test_a_raw_record_and_pairs_of_a_film(tmp_path: Path) -> None:
    head = (
        "Uncorrected Accelerogram Data             Processed: 07/06/19, CGS  somewh   \r\n"
        "1.AB.CDE.--.HN                Start time:  7/06/19, 03:16: 8.0 UTC (GPS) \r\n"
        "Chan  {0}:  {1}                                                                \r\n"
        "Units of uncor data are sec and g.         Max  =  -.567 g, at   39.410 sec.    \r\n"
        " {2} Accelerogram points at 100 pts/sec in units of g.       Format: (8f9.6)  \r\n{3}\r\n"
    )
    parts = [(1, "90 Deg", RECORD), (2, "360 Deg", RECORD[:-8]), (3, "Up", RECORD[:-3])]
    text = "".join(head.format(number, way, x.size, _fixed(x, 9, 6)) for number, way, x in parts)
    (tmp_path / "AB.RAW").write_bytes(text.encode())
    found = read_strong_motion(tmp_path / "AB.RAW")
    assert [item.acceleration_m_s2.size for item in found] == [403, 395, 400]
    assert found[0].interval_s == 0.01 and found[2].vertical
    np.testing.assert_allclose(found[0].acceleration_m_s2, 9.80665 * RECORD, atol=1e-5)
    assert open_data_file(tmp_path / "AB.RAW").column("3", "test").size == 395, "cut to the time that all share"
    film = "UNITS OF UNCOR ACCEL ARE SEC AND G/10.     MAX  =  -.200 G\n   .000  -.006   .005   .007   .010   .007\n"
    (tmp_path / "film.RAW").write_text(film)
    with pytest.raises(UserError, match="digitised film record"):
        read_strong_motion(tmp_path / "film.RAW")


@pytest.mark.golden
def test_a_cosmos_channel_without_a_number() -> None:
    header = (
        "Rcrd start time: 2018/11/30 17:29:39.137 UTC (Q=5) RcrdId: (see comment)\n"
        "Sta Chan   ?:Other   (Rcrdr Chan  ?) Location:\n|<SCNL>ABC.BN{}.AB.--    <AUTH> 2019/02/01 21:38:15.000\n"
    )
    for code, vertical in (("Z", True), ("E", False)):
        name = channel_name(header.format(code))
        assert name.text == f"BN{code}: Other"
        assert is_vertical(name, header.format(code)) is vertical
    assert start_s(header) is not None
    assert start_s(header.replace("39.137", "40.137")) == pytest.approx((start_s(header) or 0.0) + 1.0)
    assert start_s("Start time: 13/45/21, 10:00:00.0") is None
    same = ("TRIGGER TIME: 05/02/83, 16:42:48.2 PDT", "Rcrd start time:05/02/1983, 23:42:48.200 UTC (Q=2)")
    assert start_s(same[0]) == pytest.approx(start_s(same[1]))
    assert start_s("Start time: 05/02/83, 16:42:48.2 XYZ") is None
    place = channel_name("Sta Chan  3: 90 deg (Rcrdr Chan  3) Location: Top of vertical shaft")
    assert not is_vertical(place, "")


@pytest.mark.golden
@pytest.mark.parametrize(
    ("line", "width", "numbers"),
    [
        (" 0.0000295-0.0000208-0.0000096", 10, [2.95e-5, -2.08e-5, -9.6e-6]),
        ("  -.1234567E-01-.2000000E-01", None, [-0.01234567, -0.02]),
        ("   3.437285e-04", None, [3.437285e-4]),
        ("  .1D-03, -.25D+01", None, [1e-4, -2.5]),
        (" 0.1234567-101-0.5", None, [0.1234567e-101, -0.5]),
        ("1234.5671234.567", 8, [1234.567, 1234.567]),
        ("", 10, []),
        ("******** 0.5", None, None),
        ("End-of-data for Chan  1", 10, None),
    ],
)
def test_rows_of_fortran(line: str, width: int | None, numbers: list[float] | None) -> None:
    assert row_of_numbers(line, width) == pytest.approx(numbers)


def _at2(head: str, rows: str) -> str:
    return f"PEER STRONG MOTION DATABASE RECORD.\nSOMEWHERE, 05/07/84, 17:50, STATION, WE\n{head}\n{rows}\n"


@pytest.mark.golden
@pytest.mark.parametrize(
    ("head", "rows"),
    [
        ("ACCELERATION IN UNITS OF G. FILTER POINTS: HP=0.6 Hz LP=30.0 Hz\nNPTS=   403, dt=  .00244", "5"),
        ("The units are (g)\nNPTS=  403, DT= .00244 SEC", "8"),
        ("  rotation angle - clockwise   -37.0\n  azimuth =   233.0\n  Acceleration in g\n403 0.00244 NPTS, DT ", "5"),
        ("ACCELERATION IN UNITS OF G\nNPTS=  403, DT= .00244 SEC,", "padded"),
    ],
)
def test_headers_and_rows_of_peer(tmp_path: Path, head: str, rows: str) -> None:
    values = np.append(RECORD, [0.0, 0.0]) if rows == "padded" else RECORD
    body = _fixed(values, per_row=8 if rows == "8" else 5)
    (tmp_path / "a.AT2").write_bytes((_at2(head, body).replace("\n", "\r\n") + "\x1a").encode())
    (found,) = read_strong_motion(tmp_path / "a.AT2")
    assert found.interval_s == 0.00244
    np.testing.assert_allclose(found.acceleration_m_s2, 9.80665 * RECORD, atol=1e-12)


@pytest.mark.planted
def test_bad_rows_intervals_and_other_records_get_one_line(tmp_path: Path) -> None:
    head = "ACCELERATION IN UNITS OF G\nNPTS=  403, DT= .005 SEC"
    cases = {
        "stars.at2": (_at2(head, _fixed(RECORD[:8]) + "\n*********\n"), "line 6: is not a row of numbers"),
        "nan.at2": (_at2(head, _fixed(RECORD[:-1]) + "\n nan"), "not finite"),
        "dt.at2": (_at2(head.replace(".005", "0.0"), _fixed(RECORD)), "DT: is 0 s"),
        "cut.V2": (_bridge(1, "Tran", "Deck", RECORD, start=START)[:3000], "promises 403 values"),
        "stars.V2": (
            _bridge(1, "Tran", "Deck", RECORD, start=START).replace(_fixed(RECORD)[80:91], "*" * 10 + "\n", 1),
            "is not a row of numbers",
        ),
    }
    for name, (text, words) in cases.items():
        (tmp_path / name).write_text(text)
        with pytest.raises(UserError, match=words):
            read_strong_motion(tmp_path / name)
    for ending, words in (
        (".VT2", "velocity"),
        (".DT2", "displacement"),
        (".V3", "response spectra"),
        (".V1A", "GeoNet"),
    ):
        (tmp_path / f"a{ending}").write_text("")
        for read in (read_motion, lambda path: read_histories(path, "g")):
            with pytest.raises(UserError, match=words):
                read(tmp_path / f"a{ending}")


@pytest.mark.planted
def test_the_ground_of_a_structure_is_not_guessed(tmp_path: Path) -> None:
    path = tmp_path / "building.V2"
    places = ((1, "Roof"), (2, "3rd Floor"), (3, "Basement"))
    path.write_text("".join(_bridge(n, "90 Deg", place, n * RECORD, start=START) for n, place in places))
    with pytest.raises(UserError, match=r"3 horizontal channels.*name one or two of 1: 90 Deg, Roof, .*file_channels"):
        read_histories(path, "m/s^2")
    _, histories = read_histories(path, "m/s^2", channels=[3])
    np.testing.assert_allclose(histories[:, 0], 3e-2 * RECORD, atol=1e-6)
    channels = propose_campaigns(tmp_path, "building", None, tmp_path)[0].channels
    assert channels["ground_acceleration"].startswith("3: 90 Deg, Basement")
    (tmp_path / "building.V2").unlink()
    (tmp_path / "one.v2").write_text(_bridge(1, "90 Deg", "Roof", RECORD, start=START))
    with pytest.raises(UserError, match="put the channels of a record into one zip file"):
        propose_campaigns(tmp_path, "building", None, tmp_path)


@pytest.mark.golden
def test_channels_of_two_stations_are_named_by_their_files(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "event.zip", "w") as archive:
        for name in ("CE001", "CE002"):
            archive.writestr(f"{name}/{name}.V2", _bridge(1, "90 Deg", "Ground", RECORD, start=START))
    names = [item.name for item in read_strong_motion(tmp_path / "event.zip")]
    assert names == ["1: 90 Deg, Ground (CE001)", "1: 90 Deg, Ground (CE002)"]
    with pytest.raises(UserError, match="no column '1'"):
        open_data_file(tmp_path / "event.zip").column("1", "test")


@pytest.mark.property
def test_a_channel_of_one_sample_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.V2"
    path.write_text(_bridge(1, "Tran", "Deck", RECORD[:1], start=START))
    with pytest.raises(UserError, match="fewer than two samples"):
        open_data_file(path)


@pytest.mark.property
def test_recorders_with_different_intervals_are_brought_to_the_shortest(tmp_path: Path) -> None:
    # two film recorders of the same bridge were digitised at 0.02 and 0.01 s
    clock = np.arange(800) * 0.005
    slow = 2.0 * np.sin(2.0 * np.pi * 3.0 * clock) * np.hanning(clock.size)
    with zipfile.ZipFile(tmp_path / "bridge.zip", "w") as archive:
        every_fourth = _bridge(2, "Tran", "Deck: Middle", slow[::4], start=START)
        archive.writestr("chan02.v2", every_fourth.replace("0.005", "0.020"))
        archive.writestr("chan03.v2", _bridge(3, "Tran", "Center Column at Grnd Level", slow, start=START))
    file = open_data_file(tmp_path / "bridge.zip")
    assert file.sampling_rate_hz == 200.0
    np.testing.assert_allclose(file.column("2", "test"), 0.01 * slow, atol=2e-5)
    np.testing.assert_allclose(file.column("3", "test"), 0.01 * slow, atol=1e-8)


@pytest.mark.planted
def test_supports_and_soil_near_a_bridge_are_not_floors(tmp_path: Path) -> None:
    places = {
        1: "Abutment 1",
        2: "Freefield",
        3: "Deck: Near West Abutment",
        4: "Middle Bent: Top of Column",
        5: "Middle Bent: Column at Grnd Level",
        6: "On Ground: Near East Abutment",
        7: "South Embankment",
    }
    path = tmp_path / "bridge.V2"
    path.write_text("".join(_bridge(n, "Tran", place, RECORD / n, start=START) for n, place in places.items()))
    channels = propose_campaigns(tmp_path, "bridge", None, tmp_path)[0].channels
    assert channels["ground_acceleration"].startswith("5: Tran")
    assert [channels[name][:1] for name in channels if name.startswith("floor")] == ["3", "4"]


@pytest.mark.planted
def test_the_free_field_is_the_ground_only_where_nothing_else_is(tmp_path: Path) -> None:
    path = tmp_path / "bridge.V2"
    channels = ((1, "Freefield"), (2, "Deck: Middle"))
    path.write_text("".join(_bridge(n, "Tran", place, RECORD / n, start=START) for n, place in channels))
    proposal = propose_campaigns(tmp_path, "bridge", None, tmp_path)[0]
    assert proposal.channels["ground_acceleration"].startswith("1: Tran, Freefield")
    assert any("may move differently" in line for line in proposal.unsure)
