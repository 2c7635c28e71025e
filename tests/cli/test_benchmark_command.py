"""`mrpipe benchmark`: options to settings, one-line errors, the contract's JSON."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact
from mrpipe.cli import run
from mrpipe.cli.benchmark_command import overrides_of, table_of
from mrpipe.errors import UserError
from mrpipe.thesis.entries import printed_columns


@pytest.mark.golden
def test_options_stand_for_settings(tmp_path: Path) -> None:
    record = tmp_path / "a.txt"
    record.write_text("0 0\n")
    texts = overrides_of("base-isolated", None, str(record), ["vd", "fdns"], True)
    assert f'benchmark.base_isolated.motion.file="{record}"' in texts
    assert 'benchmark.base_isolated.laws=["vd", "fdns"]' in texts
    assert "benchmark.base_isolated.all_motions=true" in texts
    assert overrides_of("wind", None, "synthetic", None, False) == ['benchmark.wind.load.file="synthetic"']


@pytest.mark.planted
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("wnd", None, None, None, False), "did you mean wind"),
        (("wind", "nowhere.mat", None, None, False), "nowhere.mat"),
        (("ten-storey", None, "no/record.at2", None, False), "no/record.at2"),
        (("wind", None, None, None, True), "no set of motions"),
    ],
)
def test_wrong_options(arguments: tuple[str, None, None, None, bool], words: str) -> None:
    with pytest.raises(UserError, match=words):
        overrides_of(*arguments)


def short(tmp_path: Path, name: str, *more: str) -> list[str]:
    return ["benchmark", name, "--run", str(tmp_path / "run"), "--json", "--quiet", *more]


@pytest.mark.planted
@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (["0.00 0.1", "0.01 nan", *[f"{0.01 * k:.2f} 0.1" for k in range(2, 30)]], "is not finite"),
        ([], "no samples"),
        (["NPTS= 99, DT= 0.01", *[f"{0.01 * k:.2f} 0.1" for k in range(30)]], "promises 99 points"),
        (["% in units of g", *[f"{0.01 * k:.2f} {300.0 * (-1) ** k}" for k in range(30)]], "is not a ground motion"),
    ],
)
def test_bad_records_end_with_status_2_and_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rows: list[str], words: str
) -> None:
    record = tmp_path / "bad.txt"
    record.write_text("\n".join(rows) + "\n")
    assert run(short(tmp_path, "ten-storey", "--motion", str(record))) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert str(record) in captured.err
    assert "Traceback" not in captured.err
    assert words in json.loads(captured.out)["error"]["message"]
    assert not (tmp_path / "run" / "benchmark-ten-storey.h5").exists()


@pytest.mark.planted
def test_unknown_law_ends_with_status_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(short(tmp_path, "base-isolated", "--law", "vdd")) == 2
    assert "is not a law of the base-isolated building" in capsys.readouterr().err


@pytest.mark.golden
def test_json_of_the_contract(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.arange(0.0, 6.0, 0.01)
    record = tmp_path / "pulse.csv"
    values = 0.2 * np.sin(2.0 * np.pi * time) * np.exp(-time)
    lines = [f"{t:.2f},{a:.6f}" for t, a in zip(time, values, strict=True)]
    record.write_text("time [s],acceleration [g]\n" + "\n".join(lines) + "\n")
    arguments = short(
        tmp_path, "ten-storey", "--motion", str(record), "--law", "vd", "--law", "kelvin-0.3",
        "--set", "benchmark.ten_storey.structures=[ten-storey-heavy]", "--set", "benchmark.ten_storey.dampers=[1.0]",
    )  # fmt: skip
    assert run(arguments) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["model"] == "published"
    assert document["motion"] == "pulse"
    assert document["periods_s"][0] == pytest.approx(1.0)
    assert document["total_mass_kg"] == pytest.approx(2e5)
    assert set(document["laws"]) == {"vd", "kelvin-0.3"}
    assert set(document["laws"]["vd"]) == {"J1", "J2", "J3", "J4"}
    assert document["thesis"]["vd"]["J1"] == 0.6995
    assert document["energy_balance_error"] < 5e-3
    assert document["motion_details"]["unit_in_file"] == "g"
    artifact = Artifact(tmp_path / "run" / "benchmark-ten-storey.h5")
    assert artifact.unit("responses/vd/force") == "N"
    assert artifact.attributes("/")["model"] == "published"


@pytest.mark.golden
def test_table_puts_the_thesis_beside_ours() -> None:
    summary = {
        "model": "surrogate", "total_mass_kg": 1e6, "periods_s": [3.0, 2.0], "source": "built",
        "energy_balance_error": 1e-7, "why_different": "reasons",
        "laws": {"vd": {"J1": 0.5}, "passive-on": {"J1": 0.7}}, "thesis": {"vd": {"J1": 0.63}},
        "motion": "wind synthetic", "position": "ground", "dampers": 1.0,
        "motions": {"kobe": {"vd": {"J1": 0.4, "energy_balance_error": 1e-9}}},
    }  # fmt: skip
    text = "\n".join(table_of("wind", summary))
    assert "surrogate model" in text
    assert "[number]: value that the thesis prints; docs/benchmarks.md explains the indices" in text
    row = next(line for line in text.splitlines() if line.startswith("J1"))
    assert row.split() == ["J1", "0.5", "[0.63]", "0.7"]
    assert "kobe (surrogate model)" in text
    assert "why the values differ from the thesis: reasons" in text


@pytest.mark.property
def test_the_documentation_explains_every_index() -> None:
    """The line below the table of indices names a page: each index of each structure has its words there."""
    page = (Path(__file__).parents[2] / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    cells = [[cell.strip() for cell in row.split("|")[1:-1]] for row in re.findall(r"(?m)^\| J\d+ .*$", page)]
    explained = {
        name: {row[0] for row in cells if row[column]}
        for column, name in enumerate(("ten-storey", "base-isolated", "wind"), start=1)
    }
    assert explained == {
        "ten-storey": set(printed_columns("P4 Table 2", "P4-T2")["vd"]),
        "base-isolated": set(printed_columns("Table 6.2", "T6.2")["vd"]),
        "wind": set(printed_columns("Table 6.3", "T6.3")["vd"]),
    }
