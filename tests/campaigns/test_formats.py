"""Formats that laboratories have: each file is read as its maker writes it."""

from __future__ import annotations

import gzip
import logging
import sys
from datetime import datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pytest

from mrpipe.campaigns import load_campaign
from mrpipe.campaigns.files import all_readers, open_data_file
from mrpipe.errors import UserError
from tests.campaigns.builders import campaign, content, motion

TIME = np.arange(200) / 100.0
FORCE = 50.0 * np.sin(6.0 * TIME)
TRAVEL = 5.0 * np.cos(6.0 * TIME)


def _table(separator: str = ",", decimal: str = ".") -> str:
    rows = np.column_stack([TIME, TRAVEL, FORCE])
    text = [separator.join(f"{value:.6f}".replace(".", decimal) for value in row) for row in rows]
    return "\n".join(text) + "\n"


def _require(path: Path, *columns: str, tolerance: float = 1e-5) -> None:
    file = open_data_file(path)
    for name, values in zip(columns, (TRAVEL, FORCE), strict=True):
        np.testing.assert_allclose(file.column(name, "test"), values, atol=tolerance)


@pytest.mark.golden
def test_a_quoted_header_that_contains_the_delimiter(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('"Time (s)","Disp, LVDT (mm)","Force, cell 1 (N)"\n' + _table())
    _require(path, "Disp, LVDT (mm)", "Force, cell 1 (N)")
    assert open_data_file(path).names == ("Time (s)", "Disp, LVDT (mm)", "Force, cell 1 (N)")


@pytest.mark.golden
def test_quoted_numbers_with_decimal_commas(tmp_path: Path) -> None:
    rows = ['"' + '","'.join(line.split(";")) + '"' for line in _table(";", ",").splitlines()]
    (tmp_path / "a.csv").write_text("t,x,F\n" + "\n".join(rows) + "\n")
    _require(tmp_path / "a.csv", "x", "F")


@pytest.mark.golden
def test_a_header_with_one_more_name_than_the_rows(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("X_Value\tWeg\tKraft\tComment\n" + _table("\t"))
    _require(tmp_path / "a.txt", "Weg", "Kraft")


@pytest.mark.golden
def test_a_dspace_csv(tmp_path: Path) -> None:
    rows = _table().splitlines()
    lines = ["type,recording,,", "id,1,2,3", "name,Time,Travel,Force", "unit,s,mm,N", f"trace_values,{rows[0]}"]
    (tmp_path / "a.csv").write_text("\n".join([*lines, *(f",{row}" for row in rows[1:])]) + "\n")
    _require(tmp_path / "a.csv", "Travel", "Force")


@pytest.mark.golden
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "latin-1", "utf-8-sig"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    text = "Zeit;Weg;Kraft (µN)\n" + _table(";", ",")
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    _require(tmp_path / "a.csv", "Weg", "Kraft (µN)")


@pytest.mark.golden
def test_compressed_text(tmp_path: Path) -> None:
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(("t,x,F\n" + _table()).encode()))
    _require(tmp_path / "a.csv.gz", "x", "F")


@pytest.mark.golden
@pytest.mark.parametrize(
    "form",
    ["%Y-%m-%dT%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S.%f", "%H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S.%fZ"],
)
def test_time_stamps_become_seconds(tmp_path: Path, form: str) -> None:
    begun = datetime(2026, 3, 1, 23, 0, 0)
    stamps = [(begun + timedelta(seconds=float(item))).strftime(form) for item in TIME]
    rows = [f"{stamp},{x:.6f},{f:.6f}" for stamp, x, f in zip(stamps, TRAVEL, FORCE, strict=True)]
    (tmp_path / "a.csv").write_text("stamp,x,F\n" + "\n".join(rows) + "\n")
    np.testing.assert_allclose(open_data_file(tmp_path / "a.csv").column("stamp", "test"), TIME, atol=1e-6)
    _require(tmp_path / "a.csv", "x", "F")


@pytest.mark.oracle
def test_tdms_as_nptdms_writes_it(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    clock = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    with TdmsWriter(str(tmp_path / "a.tdms")) as writer:
        channels = [
            ChannelObject("rig", name, values, properties=clock) for name, values in (("x", TRAVEL), ("F", FORCE))
        ]
        writer.write_segment(channels)
    _require(tmp_path / "a.tdms", "rig/x", "F")
    file = open_data_file(tmp_path / "a.tdms")
    assert file.sampling_rate_hz == pytest.approx(100.0)
    assert file.time_s is not None and file.time_s[-1] == pytest.approx(TIME[-1])


@pytest.mark.oracle
def test_mdf_with_two_rates_as_asammdf_writes_it(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    file = MDF(version="4.10")
    file.append([Signal(TRAVEL, TIME, name="x", unit="mm"), Signal(FORCE, TIME, name="F", unit="N")])
    file.append([Signal(np.linspace(0.0, 1.0, 20), TIME[::10], name="slow", unit="A")])
    file.save(tmp_path / "a.mf4")
    _require(tmp_path / "a.mf4", "x", "F")
    read = open_data_file(tmp_path / "a.mf4")
    assert read.sampling_rate_hz == pytest.approx(100.0)
    slow = read.column("slow", "test")
    assert slow.size == TIME.size and slow[5] == pytest.approx(0.5 / 19.0)


LVM = """\
LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\tOne
Time_Pref\tRelative
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t200\t200\t
X0\t0{decimal}0\t0{decimal}0\t
Delta_X\t0{decimal}01\t0{decimal}01\t
***End_of_Header***\t\t\t
X_Value\tWeg\tKraft\tComment
"""


@pytest.mark.golden
@pytest.mark.parametrize("ending", ["lvm", "txt"])
@pytest.mark.parametrize("decimal", [".", ","])
def test_labview_measurement(tmp_path: Path, ending: str, decimal: str) -> None:
    path = tmp_path / f"a.{ending}"
    path.write_text(LVM.format(decimal=decimal) + _table("\t", decimal))
    # a pickle beside the file must never be loaded
    (tmp_path / f"a.{ending}.pkl").write_bytes(b"cos\nsystem\n(S'exit 1'\ntR.")
    _require(path, "Weg", "Kraft")
    assert open_data_file(path).sampling_rate_hz == pytest.approx(100.0)


@pytest.mark.oracle
def test_parquet(tmp_path: Path) -> None:
    import pandas as pd

    stamps = pd.Timestamp("2026-03-01") + pd.to_timedelta(TIME, unit="s")
    pd.DataFrame({"t": stamps, "x": TRAVEL, "F": FORCE}).to_parquet(tmp_path / "a.parquet")
    _require(tmp_path / "a.parquet", "x", "F")
    np.testing.assert_allclose(open_data_file(tmp_path / "a.parquet").column("t", "test"), TIME, atol=1e-6)


@pytest.mark.oracle
def test_xlsx_with_a_title_and_a_second_sheet(tmp_path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["only notes"])
    sheet = book.create_sheet("data")
    sheet.append(["Messung 7"])
    sheet.append(["Zeit [s]", "Weg [mm]", "Kraft (kN)"])
    for row in zip(TIME, TRAVEL, FORCE, strict=True):
        sheet.append([float(item) for item in row])
    book.save(tmp_path / "a.xlsx")
    _require(tmp_path / "a.xlsx", "Weg [mm]", "Kraft (kN)")


@pytest.mark.oracle
def test_each_sheet_of_a_workbook_with_a_record_can_be_named(tmp_path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["only notes"])
    for title, count in (("short", 150), ("long", 200)):
        sheet = book.create_sheet(title)
        sheet.append(["Zeit [s]", "Weg [mm]", "Kraft (kN)"])
        for row in list(zip(TIME, TRAVEL * (1.0 if title == "long" else 2.0), FORCE, strict=True))[:count]:
            sheet.append([float(item) for item in row])
    book.save(tmp_path / "a.xlsx")
    file = open_data_file(tmp_path / "a.xlsx")
    assert "short!Weg [mm]" in file.names and file.separator == "!"
    np.testing.assert_allclose(file.column("short!Weg [mm]", "test"), 2.0 * TRAVEL[:150])
    # a plain name and a position are those of the sheet with the most rows
    for column in ("Weg [mm]", "long!Weg [mm]", 1):
        np.testing.assert_allclose(file.column(column, "test"), TRAVEL)


@pytest.mark.golden
def test_units_and_empty_lines_of_a_labview_file(tmp_path: Path) -> None:
    rows = [",".join(f"{value:.6f}" for value in row) for row in np.column_stack([TIME, TRAVEL, FORCE])]
    text = [
        *("LabVIEW Measurement,", "Separator,Comma", "X_Columns,One", "***End_of_Header***,", ",,,".replace(",", "\t")),
        *(
            "Channels,2,,",
            "Y_Unit_Label,mm,kN",
            "Delta_X,0.01,0.01",
            "***End_of_Header***,,",
            "X_Value,Weg,Kraft,Comment",
        ),
    ]
    (tmp_path / "a.lvm").write_text("\n".join([*text, *rows]) + "\n", encoding="utf-8")
    file = open_data_file(tmp_path / "a.lvm")
    assert file.units == {"Weg": "mm", "Kraft": "kN"}
    np.testing.assert_allclose(file.column("Kraft", "test"), FORCE, atol=1e-5)


@pytest.mark.golden
@pytest.mark.parametrize(
    ("ending", "module", "extra"),
    [
        (".tdms", "nptdms", "tdms"),
        (".mf4", "asammdf", "mdf"),
        (".lvm", "lvm_read", "labview"),
        (".parquet", "pyarrow.parquet", "parquet"),
        (".xlsx", "openpyxl", "excel"),
        (".uff", "pyuff", "uff"),
    ],
)
def test_a_missing_package_names_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, module: str, extra: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / f"a{ending}").write_text(LVM.format(decimal=".") + _table("\t"))
    with pytest.raises(UserError, match=rf"which is not installed; pip install 'mrpipe\[{extra}\]'"):
        open_data_file(tmp_path / f"a{ending}")


@pytest.mark.property
@pytest.mark.parametrize("ending", sorted(set(all_readers()) - {".csv", ".txt", ".dat", ".tsv", ".asc"}))
def test_garbage_under_each_ending_is_one_line(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    path.write_bytes(np.random.default_rng(1).bytes(5000))
    with pytest.raises(UserError) as caught:
        open_data_file(path)
    assert "\n" not in str(caught.value) and str(caught.value).startswith(str(path))


@pytest.mark.property
def test_an_hdf5_file_that_declares_37_gib(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as handle:
        handle.create_dataset("F", shape=(5_000_000_000,), dtype="f8", chunks=(1_000_000,), compression="gzip")
    with pytest.raises(UserError, match=r"claims 37\.3 GiB of data, but stores"):
        open_data_file(tmp_path / "a.h5").column("F", "test")


@pytest.mark.property
def test_a_gzip_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    member = gzip.compress(b"0,0\n" * (2**22))
    (tmp_path / "a.csv.gz").write_bytes(18 * member)
    with pytest.raises(UserError, match=r"claims .* GiB of data"):
        open_data_file(tmp_path / "a.csv.gz")


@pytest.mark.golden
def test_file_names_that_the_system_refuses(tmp_path: Path) -> None:
    for name in ("x" * 3000, "a\0b", ".", "*.csv"):
        tests = content()["tests"]
        tests[0]["file"] = name
        with pytest.raises(UserError) as caught:
            load_campaign(campaign(tmp_path, tests=tests))
        assert "\n" not in str(caught.value)
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(UserError, match="is a directory"):
        open_data_file(tmp_path / "folder.csv")


@pytest.mark.golden
def test_a_campaign_of_mixed_formats(tmp_path: Path) -> None:
    import pandas as pd

    pd.DataFrame(motion(drive=1.0)).to_parquet(tmp_path / "one.parquet")
    tests = content()["tests"]
    tests[0]["file"] = "one.parquet"
    read = load_campaign(campaign(tmp_path, tests=tests))
    assert [test.sampling_rate_hz for test in read.recordings] == [1000.0, 1000.0]


@pytest.mark.golden
def test_a_tdms_file_that_was_cut_off_is_one_line(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "cut.tdms"
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([nptdms.ChannelObject("g", name, FORCE) for name in ("x", "F")])
    path.write_bytes(path.read_bytes()[:-1000])
    loggers = [logging.getLogger(name) for name in ("nptdms", "nptdms.reader")]
    before = [logger.level for logger in loggers]
    with pytest.raises(UserError, match=r"cut.tdms: is cut off: its last segment is shorter"):
        open_data_file(path)
    assert [logger.level for logger in loggers] == before, "a reader must not change what a program of the user logs"
    assert caplog.records == []


@pytest.mark.golden
def test_variables_of_matlab_that_are_no_numbers_name_the_remedy(tmp_path: Path) -> None:
    from scipy.io import savemat

    cells = np.empty((1, 2), dtype=object)
    cells[0, :] = [TIME, FORCE]
    savemat(tmp_path / "a.mat", {"c": cells, "z": FORCE + 1j})
    old = open_data_file(tmp_path / "a.mat")
    with pytest.raises(UserError, match=r"column 'c' holds no numbers; save each signal in MATLAB as a numeric vector"):
        old.column("c", "")
    with pytest.raises(UserError, match="complex: store the real part"):
        old.column("z", "")
    # a table of MATLAB 7.3 is stored as numbers that mean nothing without MATLAB
    with h5py.File(tmp_path / "b.mat", "w") as handle:
        table = handle.create_dataset("tt", data=np.arange(6, dtype="u4")[None, :])
        table.attrs["MATLAB_class"] = np.bytes_("timetable")
        table.attrs["MATLAB_object_decode"] = np.int32(3)
    with pytest.raises(UserError, match=r"b.mat: variable tt: is a timetable of MATLAB; save each signal in MATLAB"):
        open_data_file(tmp_path / "b.mat").column("tt", "")
