"""The same test in every form of file that the contract names gives the same numbers."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from mrpipe.campaigns import TestFile, load_campaign, write_campaign
from mrpipe.campaigns.files import open_data_file
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError
from tests.campaigns.builders import motion, write_csv

COLUMNS = motion(0.5)
MATRIX = np.column_stack([COLUMNS["x"], COLUMNS["a"], COLUMNS["F"]])


def text_file(path: Path, text: str) -> Path:
    path.write_bytes(text.encode())
    return path


def rows(separator: str, decimal: str = ".", trailing: str = "") -> str:
    lines = [separator.join(f"{item:.9f}".replace(".", decimal) for item in row) + trailing for row in MATRIX]
    return "\n".join(lines) + "\n"


@pytest.mark.golden
@pytest.mark.parametrize(
    ("text", "column", "layout"),
    [
        ("x,a,F\n" + rows(","), "F", None),
        ('"x","a","F",\n' + rows(",", trailing=","), "F", None),
        ("x;a;F\n" + rows(";", ","), "F", None),
        ("x\ta\tF\n" + rows("\t"), "F", None),
        ("   x   a   F\n" + rows("   "), "F", None),
        (rows("  "), 2, None),
        (rows(","), "[:,2]", None),
        (rows(","), -1, None),
        ("Bench of 3 March\noperator: N. N., 22 degrees\n\nx,a,F\nmm,m/s^2,N\n" + rows(","), "F", None),
        ("x,a,F\nmm,m/s^2,N\n" + rows(","), "N", None),
        ("% a comment\n# x,a,F\n" + rows(","), "F", None),
        ("\ufeffx,a,F\r\n" + rows(",").replace("\n", "\r\n"), "F", None),
        ("1,2,3\n" + "x,a,F\n" + rows(","), "F", TextEntry(skip_lines=1)),
        ("x|a|F\n" + rows("|"), "F", TextEntry(delimiter="|")),
    ],
)
def test_delimited_text(tmp_path: Path, text: str, column: str | int, layout: TextEntry | None) -> None:
    file = open_data_file(text_file(tmp_path / "a.csv", text), layout)
    np.testing.assert_allclose(file.column(column, "test"), COLUMNS["F"], atol=2e-9)


LOGGER = """Header Size:  7\r
Version:  2\r
Sampling Interval:  0.005\r
Sampling Rate:  200\r
Sample Count:  6\r
Device Serial Number:  0\r
Sample Number, Date/Time, CHANNEL0, CHANNEL1, Events\r
         1,   04/29/2022 11:59:59.995 AM, 0.0320, -2.9931, DAQ Start\r
         2,   04/29/2022 12:00:00.000 PM, 0.0310, -2.9934\r
         3,   04/29/2022 12:00:00.005 PM, 0.0300, -2.9934, DAQ Pause\r
         4,   04/29/2022 12:00:30.000 PM, 0.0290, -2.9931, DAQ Resume\r
         5,   04/29/2022 12:00:30.005 PM, 0.0280, -2.9934\r
         6,   04/29/2022 12:00:30.010 PM, 0.0270, -2.9934, DAQ Pause\r
"""


@pytest.mark.golden
def test_the_text_of_a_logger_with_its_pauses(tmp_path: Path) -> None:
    file = open_data_file(text_file(tmp_path / "log.txt", LOGGER))
    assert file.names == ("CHANNEL0", "CHANNEL1") and file.parts == ((0, 3), (3, 6))
    assert file.sampling_rate_hz == pytest.approx(200.0)
    assert file.time_s is not None
    np.testing.assert_allclose(file.time_s, [0.0, 0.005, 0.010, 30.005, 30.010, 30.015], atol=1e-9)
    np.testing.assert_allclose(file.column("CHANNEL1", "t")[:2], [-2.9931, -2.9934])
    np.testing.assert_allclose(file.column(0, "t")[-1], 0.0270)


def matlab_73(path: Path) -> None:
    """Write as MATLAB does: columns first, so that HDF5 sees the transpose, and a user block before the file."""
    with h5py.File(path, "w", userblock_size=512) as handle:
        handle["x_F"] = MATRIX.T
        handle["run/F"] = COLUMNS["F"][None, :]
        handle["#refs#/a"] = np.zeros(3)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


@pytest.mark.golden
@pytest.mark.parametrize("column", ["x_F[:,2]", "x_F[:, -1]", "run.F"])
@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matlab(tmp_path: Path, column: str, version: str) -> None:
    path = tmp_path / "a.mat"
    if version == "5":
        scipy.io.savemat(path, {"x_F": MATRIX, "run": {"F": COLUMNS["F"]}, "note": "by hand", "bad": np.nan})
    else:
        matlab_73(path)
    np.testing.assert_allclose(open_data_file(path).column(column, "test"), COLUMNS["F"])


@pytest.mark.golden
@pytest.mark.parametrize(
    "column", ["bench/one/F", "/bench/one/F", "bench/all[:,2]", "/bench/all[:,2]", "wide[2,:]", "table/F", "table.F"]
)
def test_hdf5(tmp_path: Path, column: str) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as handle:
        handle["bench/one/F"] = COLUMNS["F"]
        handle["bench/all"] = MATRIX
        handle["wide"] = MATRIX.T
        handle["table"] = np.rec.fromarrays([COLUMNS["t"], COLUMNS["F"]], names="t,F")
    np.testing.assert_allclose(open_data_file(tmp_path / "a.h5").column(column, "test"), COLUMNS["F"])


@pytest.mark.golden
@pytest.mark.parametrize("column", ["F", "run.F", "all[:,2]"])
def test_json(tmp_path: Path, column: str) -> None:
    force = COLUMNS["F"].tolist()
    content = {"F": force, "run": {"F": force, "by": "hand"}, "all": MATRIX.tolist(), "gaps": [None, 1.0]}
    (tmp_path / "a.json").write_text(json.dumps(content))
    np.testing.assert_allclose(open_data_file(tmp_path / "a.json").column(column, "test"), COLUMNS["F"])
    (tmp_path / "b.json").write_text(json.dumps([{"t": 0.1 * index, "F": item} for index, item in enumerate(force)]))
    np.testing.assert_allclose(open_data_file(tmp_path / "b.json").column("F", "test"), COLUMNS["F"])


@pytest.mark.oracle
def test_uff_as_pyuff_writes_it(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff", reason="the extra uff is not installed")
    file = pyuff.UFF(str(tmp_path / "a.uff"))
    for node, name in enumerate(("x", "a", "F")):
        file.write_sets(
            {
                "type": 58,
                "func_type": 1,
                "rsp_node": node + 1,
                "rsp_dir": 1,
                "ref_node": 1,
                "ref_dir": 1,
                "id1": name,
                "data": COLUMNS[name],
                "x": COLUMNS["t"],
                "abscissa_spacing": 1,
                "abscissa_inc": 0.001,
                "orddenom_spec_data_type": 0,
            },
            "add",
        )
    read = open_data_file(tmp_path / "a.uff")
    assert read.names == ("x", "a", "F") and read.sampling_rate_hz == pytest.approx(1000.0)
    np.testing.assert_allclose(read.column("F", "test"), COLUMNS["F"], rtol=1e-6, atol=1e-5)
    np.testing.assert_allclose(read.column(2, "test"), COLUMNS["F"], rtol=1e-6, atol=1e-5)


@pytest.mark.golden
def test_uff_without_its_package_is_told_in_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyuff", None)
    (tmp_path / "a.uff").write_text("    -1\n")
    with pytest.raises(UserError, match=r"need the package pyuff, which is not installed; pip install 'mrpipe\[uff\]'"):
        open_data_file(tmp_path / "a.uff")


@pytest.mark.golden
@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.xls", b"PK", "files that end in '.xls' are not read; save it as .xlsx"),
        ("a.xlsx", b"PK", "is damaged or not what its ending says"),
        ("a.mat", b"nothing of the kind", "is damaged or not what its ending says"),
        ("a.h5", b"nothing of the kind", "is damaged or not what its ending says"),
        ("a.json", b"{", "is damaged or not what its ending says"),
        ("a.json", b"3", "holds no named columns"),
        ("a.csv", b"", "is empty"),
        ("a.csv", b"only,words\nhere,too\n", "holds no row of numbers"),
        ("a.csv", b"t,x\n1,2\n2,3,4,5,6\n", "line 3: has 5 fields, the rows above have 2; correct the row"),
        ("a.txt", b"Header Size: x\n", "the logger's header is incomplete"),
    ],
)
def test_damaged_files_are_told_in_a_line(tmp_path: Path, name: str, content: bytes, expected: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError) as caught:
        open_data_file(tmp_path / name)
    assert expected in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.golden
@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("x_G[:,2]", "no column 'x_G[:,2]'; did you mean x_F?"),
        ("x_F", "is not a vector (500 x 3); pick one column, as in x_F[:,0]"),
        ("x_F[:,3]", "lies outside an array of 500 x 3; count from 0"),
        ("x_F[:,a]", "index [:,a] is not understood"),
        ("note", "column 'note' holds no numbers"),
        ("one", "holds one number; name a variable with one number a sample"),
    ],
)
def test_columns_that_do_not_fit(tmp_path: Path, column: str, expected: str) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"x_F": MATRIX, "note": "by hand", "one": 1.0})
    with pytest.raises(UserError) as caught:
        open_data_file(tmp_path / "a.mat").column(column, "test")
    assert expected in str(caught.value)


@pytest.mark.golden
@pytest.mark.parametrize("data_format", ["h5", "csv"])
def test_what_is_written_is_read_again(tmp_path: Path, data_format: str) -> None:
    tests = [
        TestFile(f"3{letter}-1.0 Hz", role, motion(0.5, seed=seed), {"about": {"seed": np.int64(seed)}})
        for seed, (letter, role) in enumerate([("a", "training"), ("b", "validation")])
    ]
    channels = {"displacement": ("x", "mm"), "drive": ("i", "A"), "force": ("F", "N"), "time": ("t", "s")}
    path = write_campaign(
        tmp_path / "c",
        campaign="virtual",
        rig="damper-bench",
        sampling_rate_hz=1000,
        channels=channels,
        tests=tests,
        extra={"declared_effects": ["offset"], "about": {"damper": "C"}},
        data_format=data_format,  # type: ignore[arg-type]
    )
    read = load_campaign(path.parent)
    assert read.declared_effects == ("offset",) and read.declared == {"about": {"damper": "C"}}
    for seed, test in enumerate(read.recordings):
        assert test.name == tests[seed].name and test.details == {"seed": seed}
        np.testing.assert_allclose(test.channels["displacement"], motion(0.5, seed=seed)["x"] * 1e-3, rtol=1e-9)


@pytest.mark.golden
def test_writing_refuses_what_could_not_be_read(tmp_path: Path) -> None:
    def write(tests: list[TestFile]) -> None:
        write_campaign(
            tmp_path,
            campaign="c",
            rig="damper-bench",
            sampling_rate_hz=1.0,
            channels={"force": ("F", "N")},
            tests=tests,
        )

    with pytest.raises(ValueError, match="two tests would be written to"):
        write([TestFile("a b", "training", {"F": np.ones(3)}), TestFile("a_b", "training", {"F": np.ones(3)})])
    with pytest.raises(ValueError, match="columns differ in length"):
        write([TestFile("a", "training", {"F": np.ones(3), "x": np.ones(4)})])
    assert not (tmp_path / "campaign.yaml").exists()


@pytest.mark.golden
def test_a_table_with_numbers_for_names(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", COLUMNS, header=False)
    np.testing.assert_allclose(open_data_file(tmp_path / "a.csv").column(4, "t"), COLUMNS["F"], rtol=1e-9)


@pytest.mark.golden
@pytest.mark.parametrize("asked", ["sine_1hz.csv", "Sine 1Hz.csv", "Sine_1Hz", "Sine_1Hz.txt"])
def test_a_missing_file_offers_the_one_of_almost_that_name(tmp_path: Path, asked: str) -> None:
    (tmp_path / "Sine_1Hz.csv").write_text("t,x\n0,1\n1,2\n")
    with pytest.raises(UserError, match=r"data file not found; did you mean Sine_1Hz\.csv\? correct `file:`"):
        open_data_file(tmp_path / asked)


@pytest.mark.golden
@pytest.mark.parametrize("asked", ["Sine_2Hz.csv", "nowhere/Sine_1Hz.csv", "Sine_1Hz_b.csv"])
def test_a_missing_file_of_another_test_offers_none(tmp_path: Path, asked: str) -> None:
    (tmp_path / "Sine_1Hz.csv").write_text("t,x\n0,1\n1,2\n")
    with pytest.raises(UserError, match="data file not found; correct `file:`"):
        open_data_file(tmp_path / asked)


@pytest.mark.oracle
def test_channels_in_an_array_of_structures_go_by_their_names(tmp_path: Path) -> None:
    from scipy.io import savemat

    values = np.arange(50.0)
    channels = [{"Name": "Force", "Data": 2.0 * values}, {"Name": "Pos", "Data": 3.0 * values}]
    savemat(
        tmp_path / "a.mat", {"rec": {"X": {"Data": values}, "Y": channels}, "plain": [{"a": values}, {"a": -values}]}
    )
    file = open_data_file(tmp_path / "a.mat")
    assert file.column("rec.Y.Force", "").tolist() == file.column("Force", "").tolist() == (2.0 * values).tolist()
    assert file.column("rec.X.Data", "").tolist() == values.tolist()
    assert file.column("plain.2.a", "").tolist() == (-values).tolist()


@pytest.mark.golden
def test_a_sampling_interval_in_place_of_a_clock_names_the_way_out(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"dt": 0.002, "x": np.arange(50.0)})
    with pytest.raises(UserError, match=r"column 'dt' holds one number; .* give sampling_rate_hz in its place"):
        open_data_file(tmp_path / "a.mat").column("dt", "")


@pytest.mark.golden
def test_a_path_of_windows_names_the_sign_between_folders(tmp_path: Path) -> None:
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "a.csv").write_text("t,x\n0,1\n1,2\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"data file not found; write / in place of"):
        open_data_file(tmp_path / r"raw\a.csv")
