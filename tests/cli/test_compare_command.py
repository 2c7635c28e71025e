"""`compare` lists what differs between two runs that the real pipeline made, and nothing that does not."""

from __future__ import annotations

import copy
import json
import logging
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from mrpipe.cli import run
from mrpipe.config.loader import LoadedConfig
from mrpipe.config.model import config_model
from mrpipe.errors import StageSkipped
from mrpipe.pipeline.kept_run import read_run
from mrpipe.pipeline.runner import Pipeline
from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.reporting.compare import KeptRun, KeptStage, compare_runs, flat_results

SUMMARIES: dict[str, dict[str, Any]] = {
    "prepare": {"campaign": "my-rig", "tests": [{"name": "a", "force_peak_n": 20.0}, {"name": "b", "force_peak_n": 8}]},
    "identify-damper": {
        "form": "bouc-wen",
        "comparison": [
            {"form": "bouc-wen", "validation_nrmse": 0.08},
            {"form": "dahl", "validation_nrmse": 0.09},
        ],
    },
    "close-loop": {
        "before": {"nrmse": 0.08},
        "after": {"nrmse": 0.02},
        "effects": [{"name": "backlash", "confidence": 0.97}],
        "verdict": "backlash: explains what is missing",
        "verdict_class": "explained",
    },
    "simulate-vd": {"law": "vd", "rms_x_top_m": 0.024, "real_time_factor": 30.0, "seconds": 1.0},
}
CAMPAIGN = """campaign: my-rig
rig: damper-bench
channels: {time: {column: t, unit: s}, displacement: {column: x, unit: mm}, force: {column: F, unit: N}}
tests: [{name: a, file: a.csv, role: training}]
"""

MakeRun = Callable[..., Path]


@pytest.fixture
def make_run(tmp_path: Path) -> MakeRun:
    """Return a function that lets the pipeline make a run whose stages print given summaries."""
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / "campaign.yaml").write_text(CAMPAIGN, encoding="utf-8")
    (tmp_path / "rig" / "a.csv").write_text("t,x,F\n0,1,2\n", encoding="utf-8")

    def make(name: str, summaries: Mapping[str, Mapping[str, Any] | str] = SUMMARIES, **settings: Any) -> Path:
        campaigns = {"bench": str(tmp_path / "rig"), "frame": None, "closed_loop": None}
        content = {"campaigns": campaigns, "stages": list(SUMMARIES), **settings}
        loaded = LoadedConfig(config_model().model_validate(content), tmp_path / "config.yaml")
        stages = {
            stage: Stage(
                stage,
                "prints what it is given",
                _printing(summary),
                inputs=("campaign:bench",) if stage == "prepare" else ("prepare",),
                settings=("prepare",) if stage == "prepare" else ("simulate.sensors",),
                outputs=(f"{stage}.h5",),
            )
            for stage, summary in summaries.items()
        }
        pipeline = Pipeline(loaded, stages, tmp_path / name, logging.getLogger("test"), quiet=True)
        pipeline.write_config()
        for stage in stages:
            pipeline.build(stage)
        return tmp_path / name

    return make


def _printing(summary: Mapping[str, Any] | str) -> Callable[[StageContext], Mapping[str, Any]]:
    def stage(context: StageContext) -> Mapping[str, Any]:
        if isinstance(summary, str):
            raise StageSkipped(summary)
        with context.write(f"{context.stage}.h5") as artifact:
            artifact.put("one", 1.0, unit="1")
        return summary

    return stage


def changed(**by_stage: Any) -> dict[str, Any]:
    """Return the summaries with some entries replaced; `_` stands for `-` in the name of a stage."""
    summaries = copy.deepcopy(SUMMARIES)
    for stage, entries in by_stage.items():
        summaries[stage.replace("_", "-")].update(entries)
    return summaries


def compared(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    """Return what `mrpipe compare --json` prints."""
    assert run(["compare", *map(str, arguments), "--json"]) == 0
    content: dict[str, Any] = json.loads(capsys.readouterr().out)
    return content


@pytest.mark.property
def test_equal_runs_do_not_differ_and_wall_clock_does_not_count(
    make_run: MakeRun, capsys: pytest.CaptureFixture[str]
) -> None:
    slower = changed(simulate_vd={"real_time_factor": 3.0, "seconds": 10.0})
    content = compared(capsys, make_run("one"), make_run("two", slower))
    assert content["settings"] == content["data"] == content["results"] == []
    assert content["stages"]["both"] == list(SUMMARIES)
    assert content["stages"]["only_first"] == content["stages"]["code_differs"] == []


@pytest.mark.planted
def test_a_setting_is_listed_with_the_stages_that_read_it(
    make_run: MakeRun, capsys: pytest.CaptureFixture[str]
) -> None:
    content = compared(capsys, make_run("one"), make_run("two", prepare={"cutoff_hz": 80.0}, close_loop={"folds": 4}))
    assert content["settings"] == [
        {"setting": "prepare.cutoff_hz", "first": 100.0, "second": 80.0, "stages": ["prepare"]},
        {"setting": "close_loop.folds", "first": 3, "second": 4, "stages": []},
    ]


@pytest.mark.planted
def test_a_stage_built_before_the_configuration_changed_shows_its_own_setting(
    make_run: MakeRun, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = make_run("one"), make_run("two", prepare={"cutoff_hz": 80.0})
    shutil.copy(first / "config.yaml", second / "config.yaml")
    (row,) = compared(capsys, first, second)["settings"]
    assert row == {"setting": "prepare.cutoff_hz", "first": 100.0, "second": 80.0, "stages": ["prepare"]}


@pytest.mark.planted
def test_changed_measurements_are_data_that_differ(
    make_run: MakeRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = make_run("one")
    (tmp_path / "rig" / "a.csv").write_text("t,x,F\n0,1,3\n", encoding="utf-8")
    (row,) = compared(capsys, first, make_run("two"))["data"]
    assert row["input"] == "campaign:bench"
    assert row["first"]["campaign"] == row["second"]["campaign"] == "my-rig"
    assert row["first"]["path"] == str(tmp_path / "rig")
    assert row["first"]["sha256"] != row["second"]["sha256"]


@pytest.mark.planted
def test_stages_of_one_run_and_skipped_stages_are_named(make_run: MakeRun, capsys: pytest.CaptureFixture[str]) -> None:
    fewer: dict[str, Any] = {**SUMMARIES, "close-loop": "no validation test"}
    del fewer["simulate-vd"]
    stages = compared(capsys, make_run("one"), make_run("two", fewer))["stages"]
    assert stages["only_first"] == ["close-loop", "simulate-vd"]
    assert [(row["stage"], row["reason"]) for row in stages["not_built"]] == [("close-loop", "no validation test")]


@pytest.mark.planted
def test_results_are_side_by_side_in_the_order_of_the_stages(
    make_run: MakeRun, capsys: pytest.CaptureFixture[str]
) -> None:
    other = changed(
        simulate_vd={"rms_x_top_m": 0.018},
        close_loop={"after": {"nrmse": 0.03}, "verdict": "backlash: explains part", "effects": []},
        identify_damper={"comparison": [{"form": "dahl", "validation_nrmse": 0.09}]},
    )
    content = compared(capsys, make_run("one"), make_run("two", other))
    rows = {f"{row['stage']}: {row['key']}": row for row in content["results"]}
    assert list(rows) == [
        "identify-damper: comparison.bouc-wen.form",
        "identify-damper: comparison.bouc-wen.validation_nrmse",
        "close-loop: verdict",
        "close-loop: after.nrmse",
        "close-loop: effects.backlash.name",
        "close-loop: effects.backlash.confidence",
        "simulate-vd: rms_x_top_m",
    ]
    top = rows["simulate-vd: rms_x_top_m"]
    assert (top["first"], top["second"], top["present"]) == (0.024, 0.018, "both")
    assert top["relative_difference"] == pytest.approx(-0.25)
    assert rows["close-loop: verdict"]["relative_difference"] is None
    assert rows["close-loop: effects.backlash.name"]["present"] == "first"
    assert [item["effects"] for item in content["verdicts"]] == [["backlash"], []]
    assert [item["after_nrmse"] for item in content["verdicts"]] == [0.02, 0.03]


@pytest.mark.property
@pytest.mark.parametrize(("tolerance", "count"), [("1e-6", 1), ("0.01", 0)])
def test_tolerance_is_relative(
    tolerance: str, count: int, make_run: MakeRun, capsys: pytest.CaptureFixture[str]
) -> None:
    other = changed(simulate_vd={"rms_x_top_m": 0.0241})
    content = compared(capsys, make_run("one"), make_run("two", other), "--tolerance", tolerance)
    assert len(content["results"]) == count


@pytest.mark.property
def test_numbers_texts_and_missing_values_are_different_results() -> None:
    first = KeptRun(Path("a"), {}, {"s": KeptStage(summary={"zero": 0.0, "none": None, "flag": True, "same": 1})})
    second = KeptRun(Path("b"), {}, {"s": KeptStage(summary={"zero": 2.0, "none": 1.0, "flag": False, "same": 1.0})})
    rows = {row["key"]: row for row in compare_runs(first, second, 1e-6)["results"]}
    assert set(rows) == {"zero", "none", "flag"}
    assert all(row["relative_difference"] is None and row["present"] == "both" for row in rows.values())


@pytest.mark.property
def test_rows_of_a_table_are_named_only_where_the_name_is_unique() -> None:
    unique = flat_results({"laws": [{"law": "vd", "x": 1.0}, {"law": "fdns", "x": 2.0}]})
    assert unique[("laws", "fdns", "x")] == 2.0
    twice = flat_results({"laws": [{"law": "vd", "x": 1.0}, {"law": "vd", "x": 2.0}]})
    assert twice[("laws", "1", "x")] == 2.0


@pytest.mark.golden
def test_a_person_reads_tables(make_run: MakeRun, capsys: pytest.CaptureFixture[str]) -> None:
    first = make_run("one")
    second = make_run("two", changed(simulate_vd={"rms_x_top_m": 0.018}), prepare={"cutoff_hz": 80.0})
    assert run(["compare", str(first), str(second)]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["prepare.cutoff_hz", "100", "80", "prepare"] in lines
    assert ["rms_x_top_m", "0.024", "0.018", "-25.0", "%"] in lines
    assert ["data:", "no", "differences"] in lines


@pytest.mark.property
def test_artifacts_are_not_opened_and_nothing_is_written_into_the_runs(
    make_run: MakeRun, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = make_run("one"), make_run("two")
    for directory in runs:
        for path in directory.glob("*.h5"):
            path.write_bytes(b"no HDF5")
    before = {path: path.read_bytes() for directory in runs for path in directory.rglob("*") if path.is_file()}
    assert compared(capsys, *runs)["results"] == []
    assert {path: path.read_bytes() for directory in runs for path in directory.rglob("*") if path.is_file()} == before


@pytest.mark.golden
def test_plot_writes_a_page_or_a_folder_with_overlaid_figures(
    make_run: MakeRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = make_run("one"), make_run("<two>", changed(simulate_vd={"rms_x_top_m": 0.018}))
    content = compared(capsys, *runs, "--plot", tmp_path / "figures")
    names = ["laws.svg", "tracing.svg", "damper-forms.svg", "settings.csv", "data.csv", "results.csv"]
    assert [Path(path).name for path in content["plot"]] == names
    laws = (tmp_path / "figures" / "laws.svg").read_text(encoding="utf-8")
    assert all(text in laws for text in (">one<", "&lt;two&gt;", ">24.0<", ">18.0<"))
    assert pd.read_csv(tmp_path / "figures" / "results.csv")["key"].tolist() == ["rms_x_top_m"]
    assert pd.read_csv(tmp_path / "figures" / "data.csv").empty
    compared(capsys, *runs, "--plot", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == 3 and "rms_x_top_m" in page and "<two>" not in page


@pytest.mark.property
def test_mistakes_are_one_line(make_run: MakeRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, two = str(make_run("one")), str(make_run("two"))
    (tmp_path / "link").symlink_to(one)
    (tmp_path / "empty").mkdir()
    (tmp_path / "taken").write_text("", encoding="utf-8")
    mistakes = {
        "no such run directory": [one, "nowhere"],
        "no manifests": [str(tmp_path / "empty"), one],
        "is the same directory": [one, str(tmp_path / "link")],
        "neither a page nor a folder": [one, two, "--plot", str(tmp_path / "x.png")],
        "end it in .html": [one, two, "--plot", str(tmp_path / "taken")],
        "is a directory": [one, two, "--plot", str(_folder(tmp_path / "page.html"))],
        "--tolerance": [one, two, "--tolerance", "-1"],
    }
    for expected, arguments in mistakes.items():
        assert run(["compare", *arguments]) == 2
        captured = capsys.readouterr()
        assert captured.out == "" and expected in captured.err and len(captured.err.strip().splitlines()) == 1


def _folder(path: Path) -> Path:
    path.mkdir()
    return path


@pytest.mark.property
def test_a_damaged_manifest_counts_as_a_stage_that_was_not_built(make_run: MakeRun) -> None:
    directory = make_run("one")
    (directory / "manifests" / "close-loop.json").write_text("{", encoding="utf-8")
    found = read_run(directory)
    assert "close-loop" not in found.built
    assert "damaged" in found.stages["close-loop"].not_built
