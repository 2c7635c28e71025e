"""The report: one file that opens offline, safe against what names and captions hold."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mrpipe.pipeline.parts import PartWriter, read_part
from mrpipe.reporting.page import ReportStage, RunFacts, _table_html, write_report
from mrpipe.reporting.style import figure_with_axes


@pytest.fixture
def stages(tmp_path: Path) -> list[ReportStage]:
    part = PartWriter("prepare", tmp_path)
    part.text("Filtered at `100 Hz`, **zero phase**, <script>alert(1)</script>.")
    part.table("tests", pd.DataFrame({"test": ["1a|x"], "rms_n": [12.3456789]}), "RMS a test")
    figure, axes = figure_with_axes()
    axes[0, 0].plot([0, 1], [0, 1])
    part.figure("loop", figure, "A loop & more")
    part.save()
    items = read_part(tmp_path, "prepare")
    return [
        ReportStage("prepare", "Filters.", items, {"validation_nrmse": 0.1}, ["clipped <b>"], "", 1.2),
        ReportStage("identify-frame", "Frame.", [], {}, [], "there is no frame campaign", 0.0),
    ]


@pytest.mark.property
def test_html_is_one_offline_file(tmp_path: Path, stages: list[ReportStage]) -> None:
    (path,) = write_report(RunFacts(tmp_path, "T & x", "", stages), ["html"])
    text = path.read_text(encoding="utf-8")
    assert "<svg" in text and "<metadata" not in text
    assert re.findall(r"(?:src|href)=['\"]https?:", text) == []
    assert "<script" not in text
    assert "<code>100 Hz</code>" in text
    assert "T &amp; x" in text
    assert "clipped &lt;b&gt;" in text
    assert "there is no frame campaign" in text
    assert "12.35" in text


@pytest.mark.property
def test_markdown_shows_tables_and_figures(tmp_path: Path, stages: list[ReportStage]) -> None:
    (path,) = write_report(RunFacts(tmp_path, "T", "d", stages), ["markdown"])
    text = path.read_text(encoding="utf-8")
    assert "![A loop & more](figures/prepare-loop.svg)" in text
    assert "| 1a\\|x | 12.35 |" in text
    assert "Skipped: there is no frame campaign" in text


@pytest.mark.property
def test_same_figure_is_the_same_file(tmp_path: Path) -> None:
    contents = []
    for name in ("a", "b"):
        figure, axes = figure_with_axes()
        axes[0, 0].plot([0, 1], [0, 1])
        PartWriter(name, tmp_path).figure("f", figure, "")
        contents.append((tmp_path / "figures" / f"{name}-f.svg").read_bytes())
    assert contents[0] == contents[1]


@pytest.mark.property
def test_missing_figure_is_said(tmp_path: Path, stages: list[ReportStage]) -> None:
    (tmp_path / "figures" / "prepare-loop.svg").unlink()
    (path,) = write_report(RunFacts(tmp_path, "T", "", stages), ["html"])
    assert "is missing: build the stage again" in path.read_text(encoding="utf-8")


@pytest.mark.property
def test_a_cell_that_holds_a_list_is_written_as_words(tmp_path: Path) -> None:
    part = PartWriter("identify-damper", tmp_path)
    part.table("forms", pd.DataFrame({"form": ["dahl", "lugre"], "at bound": [["k0", "c1"], []]}), "Forms")
    part.save()
    stage = ReportStage("identify-damper", "", read_part(tmp_path, "identify-damper"), {}, [], "", 0.0)
    (path,) = write_report(RunFacts(tmp_path, "T", "", [stage]), ["markdown"])
    text = path.read_text(encoding="utf-8")
    assert "| dahl | k0, c1 |" in text and "[" not in (tmp_path / "tables" / "identify-damper-forms.csv").read_text()


@pytest.mark.property
def test_a_number_is_not_parted_from_its_unit(tmp_path: Path, stages: list[ReportStage]) -> None:
    facts = RunFacts(
        tmp_path, "T", "", [replace(stages[0], items=[{"kind": "text", "text": "1.8 % of 34 N, 5 of 7 A."}])]
    )
    (path,) = write_report(facts, ["html"])
    text = path.read_text(encoding="utf-8")
    assert "1.8\N{NO-BREAK SPACE}% of 34\N{NO-BREAK SPACE}N, 5 of 7\N{NO-BREAK SPACE}A." in text


@pytest.mark.golden
def test_a_warning_appears_once_and_one_matrix_has_one_notation(tmp_path: Path, stages: list[ReportStage]) -> None:
    part = PartWriter("identify-frame", tmp_path)
    part.table("stiffness", pd.DataFrame({"floor 1": [9569.37, -5127.3], "floor 2": [-5127.3, 10191.3]}), "K [N/m].")
    part.save()
    frame = ReportStage(
        "identify-frame", "", read_part(tmp_path, "identify-frame"), {}, ["the laser is noisy"], "", 0.0
    )
    html, markdown = write_report(RunFacts(tmp_path, "T", "", [stages[0], frame]), ["html", "markdown"])
    for text in (html.read_text(encoding="utf-8"), markdown.read_text(encoding="utf-8")):
        assert text.count("the laser is noisy") == 1
        assert "9569" in text and "10190" in text and "e+04" not in text


@pytest.mark.property
def test_a_bar_in_the_name_of_a_campaign_keeps_the_row_of_its_stage_whole(
    tmp_path: Path, stages: list[ReportStage]
) -> None:
    failed = replace(stages[1], skipped="campaign a|b is not there")
    (path,) = write_report(RunFacts(tmp_path, "T", "", [stages[0], failed]), ["markdown"])
    (row,) = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("| identify-frame |")]
    assert len(re.findall(r"(?<!\\)\|", row)) == 4
    assert r"a\|b" in row


@pytest.mark.golden
def test_a_column_of_numbers_stands_right_with_its_heading_and_units_are_readable() -> None:
    frame = pd.DataFrame(
        {
            "parameter": ["gain", "c0_b"],
            "value": [0.5, np.nan],
            "unit": ["1", "N*s/m/A"],
            "at_bound": [False, True],
            "test": ["3", "3a"],
        }
    )
    text = _table_html(frame)
    assert "<th class='number'>value</th>" in text and "<td class='number'>0.5000</td>" in text
    assert "<td class='number'>-</td>" in text
    # a name that is a number in one row only stands where the other names stand, and a ratio has no unit
    assert "<td>3</td>" in text and "<td class='number'>1</td>" not in text and "<td>N s/m per A</td>" in text
    assert "<td>no</td>" in text and "<td>yes</td>" in text
