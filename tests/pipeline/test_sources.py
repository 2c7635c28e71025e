"""Where the inputs of stages come from, for each kind of campaign."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.pipeline.runner import Pipeline
from mrpipe.pipeline.sources import ABSENT, Sources
from mrpipe.pipeline.stage import Stage

from .conftest import STAGES, MakePipeline

pytestmark = pytest.mark.property

CAMPAIGN = """\
campaign: rig
rig: damper-bench
sampling_rate_hz: 100
channels: {displacement: {column: 1, unit: m}, force: {column: 2, unit: N}}
tests: [{file: a.csv, role: training}]
"""

RECORDER = Stage("record-frame", "records", STAGES["first"].run, outputs=("campaigns/frame",))


def _sources(make_pipeline: MakePipeline, frame: str | None) -> Sources:
    pipeline: Pipeline = make_pipeline({**STAGES, "record-frame": RECORDER}, campaigns={"bench": None, "frame": frame})
    return pipeline.sources


def test_a_campaign_of_the_laboratory_comes_from_its_recorder(make_pipeline: MakePipeline) -> None:
    sources = _sources(make_pipeline, "laboratory")
    assert sources.provider("campaign:frame") == "record-frame"
    assert sources.path("campaign:frame") == sources.run_directory / "campaigns" / "frame"
    assert sources.configured("after") and sources.needs_laboratory("after")
    assert not sources.needs_laboratory("second")


def test_a_campaign_of_the_user_comes_from_outside(make_pipeline: MakePipeline) -> None:
    sources = _sources(make_pipeline, "my/frame")
    assert sources.provider("campaign:frame") is None
    assert sources.path("campaign:frame") == Path("my/frame")
    assert sources.configured("after") and not sources.needs_laboratory("after")


def test_a_virtual_campaign_is_reported_where_the_user_gives_the_rest(make_pipeline: MakePipeline) -> None:
    recorders = {**STAGES, "record-frame": RECORDER}
    alone = make_pipeline(recorders, campaigns={"bench": None, "frame": "laboratory"}).sources
    assert alone.mixed_with_laboratory("record-frame") == ""
    mixed = make_pipeline(recorders, campaigns={"bench": "my/bench", "frame": "laboratory"}).sources
    said = mixed.mixed_with_laboratory("record-frame")
    assert "campaigns.frame is `laboratory`, but campaigns.bench describes your own rig" in said
    assert mixed.mixed_with_laboratory("second") == ""


def test_without_a_campaign_what_reads_it_is_not_configured(make_pipeline: MakePipeline) -> None:
    sources = _sources(make_pipeline, None)
    assert sources.path("campaign:frame") is None
    assert not sources.configured("after") and sources.configured("second")


def test_the_digest_of_a_campaign_is_that_of_its_files(make_pipeline: MakePipeline, tmp_path: Path) -> None:
    sources = _sources(make_pipeline, str(tmp_path / "rig"))
    assert sources.digest("campaign:frame", tmp_path / "rig") == ABSENT
    folder = tmp_path / "rig"
    folder.mkdir()
    (folder / "campaign.yaml").write_text(CAMPAIGN, encoding="utf-8")
    (folder / "a.csv").write_text("1,2\n", encoding="utf-8")
    first = sources.digest("campaign:frame", folder)
    (folder / "a.csv").write_text("1,3\n", encoding="utf-8")
    assert sources.digest("campaign:frame", folder) != first
    (folder / "a.csv").write_text("1,2\n", encoding="utf-8")
    assert sources.digest("campaign:frame", folder) == first


def test_public_data_count_by_content(
    make_pipeline: MakePipeline, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sources = _sources(make_pipeline, None)
    monkeypatch.setenv("MRPIPE_DATA", str(tmp_path / "data"))
    assert sources.digest_of_public_data(["dampers"]) == ABSENT
    (tmp_path / "data" / "dampers").mkdir(parents=True)
    (tmp_path / "data" / "dampers" / "a.csv").write_text("1\n", encoding="utf-8")
    first = sources.digest_of_public_data(["dampers"])
    (tmp_path / "data" / "other").mkdir()
    assert sources.digest_of_public_data(["dampers"]) == first != ABSENT
    (tmp_path / "data" / "dampers" / "a.csv").write_text("2\n", encoding="utf-8")
    assert sources.digest_of_public_data(["dampers"]) != first
