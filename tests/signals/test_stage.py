"""The stage `prepare` as a whole, and the figures it draws."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from mrpipe.artifacts import Artifact, Provenance, no_progress
from mrpipe.config.sections.prepare import PrepareSettings
from mrpipe.errors import UserError
from mrpipe.pipeline.parts import PartWriter, read_part
from mrpipe.pipeline.stage import StageContext
from mrpipe.reporting.signals import campaign_overview, loops, prepared_history, spectra_before_and_after
from mrpipe.signals.prepared import read_prepared
from mrpipe.signals.summary import summarised
from mrpipe.stages.prepare import STAGE
from tests.campaigns.builders import CHANNELS, campaign


def run(directory: Path, source: Path, **settings: Any) -> tuple[StageContext, dict[str, Any]]:
    context = StageContext(
        stage="prepare",
        settings=SimpleNamespace(prepare=PrepareSettings(**settings)),
        inputs={"campaign:bench": source},
        run_directory=directory,
        rng=np.random.default_rng(0),
        seed=0,
        jobs=1,
        progress=no_progress,
        report=PartWriter("prepare", directory),
        log=logging.getLogger("test"),
        provenance=Provenance("prepare"),
    )
    return context, dict(STAGE.run(context))


@pytest.mark.golden
def test_what_the_stage_leaves(tmp_path: Path) -> None:
    channels = {**CHANNELS, "force": {"column": "F", "unit": "N", "scale": -1.0}}
    context, summary = run(tmp_path / "run", campaign(tmp_path / "c", channels=channels))
    assert json.loads(json.dumps(summary)) == summary
    assert summary["test_count"] == 2 and summary["sampling_rate_hz"] == 1000.0 and summary["drive_unit"] == "A"
    assert any("positive in compression" in line for line in summary["findings"])
    assert context.warnings == summary["findings"]
    artifact = Artifact(tmp_path / "run" / "prepared.h5")
    assert [test.name for test in read_prepared(artifact)] == ["one", "two"]
    assert artifact.json("campaign")["findings"] == summary["findings"]
    context.report.save()  # type: ignore[attr-defined]
    kinds = [item["kind"] for item in read_part(tmp_path / "run", "prepare")]
    assert kinds.count("figure") == 3 and kinds.count("table") == 1
    assert all(
        (tmp_path / "run" / item).is_file() for item in ("figures/prepare-loops.svg", "tables/prepare-tests.csv")
    )


@pytest.mark.golden
def test_a_faulty_campaign_leaves_nothing(tmp_path: Path) -> None:
    source = campaign(tmp_path / "c")
    (source / "two.csv").unlink()
    with pytest.raises(UserError, match=r"two\.csv: data file not found"):
        run(tmp_path / "run", source)
    assert not (tmp_path / "run" / "prepared.h5").exists()


@pytest.mark.golden
def test_findings_that_tests_share_are_told_once() -> None:
    lines = summarised([("a", "one"), ("b", "two"), ("c", "one")])
    assert lines == ["2 tests (a, ...): one", "test b: two"]


@pytest.mark.golden
def test_figures_are_drawn_of_what_they_are_given() -> None:
    t = np.arange(3000) / 1000.0
    x = np.sin(2 * np.pi * t)
    spectrum = (np.linspace(0, 500, 100), np.logspace(0, -6, 100))
    figures = [
        spectra_before_and_after({"force": (spectrum, spectrum)}, {"force": "N"}, {"force": 100.0}),
        prepared_history(t, {"force": x}, {"force": x, "velocity": x}, {"force": "N"}, np.array([0, 1000, 2000])),
        prepared_history(t, {}, {"force": x}, {}, np.zeros(0, dtype=np.int64)),
        loops([("a", x, x, x), ("b", x, x, x)]),
        campaign_overview([("a", t, {"force": x}), ("b", t, {"force": x, "drive": x})], {"force": "N", "drive": "A"}),
    ]
    assert all(isinstance(figure, Figure) for figure in figures)
    assert [len(figure.axes) for figure in figures] == [2, 2, 1, 2, 4]
    assert figures[0].axes[0].get_ylabel() == "density [(N)²/Hz]"
    assert [line.get_label() for line in figures[3].axes[0].get_lines()] == ["a", "b"]
