"""A campaign directory is whole or not there; the truth never lies within it."""

from __future__ import annotations

import dataclasses
import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import Provenance, no_progress
from mrpipe.campaigns import load_campaign
from mrpipe.config.sections.laboratory import BenchSettings, CustomTest, LaboratorySettings, PlantedEffect
from mrpipe.laboratory.motion import BenchTest
from mrpipe.laboratory.options import BenchRig, FrameRig, LoopRig
from mrpipe.laboratory.sealing import campaign_directory, open_sealed, sealed_path
from mrpipe.pipeline.stage import StageContext
from mrpipe.stages.record import RECORD_BENCH


class _Silent:
    def text(self, paragraph: str) -> None:
        assert "remanence" not in paragraph

    def table(self, name: str, frame: Any, caption: str) -> None: ...

    def figure(self, name: str, figure: Any, caption: str) -> None: ...


def _context(run_directory: Path, settings: LaboratorySettings, seed: int = 5) -> StageContext:
    return StageContext(
        stage="record-bench",
        settings=SimpleNamespace(laboratory=settings),
        inputs={},
        run_directory=run_directory,
        rng=np.random.default_rng(seed),
        seed=seed,
        jobs=1,
        progress=no_progress,
        report=_Silent(),
        log=logging.getLogger("test"),
        provenance=Provenance("record-bench"),
    )


CUSTOM = LaboratorySettings(
    hidden_effects=(PlantedEffect(name="remanence", strength_share=0.05),),
    bench=BenchSettings(
        plan="custom",
        tests=(
            CustomTest(name="a", current="steps", current_a=4.0, duration_s=4.0),
            CustomTest(name="b", role="validation", current="half-sine", current_a=3.0, duration_s=4.0),
        ),
    ),
)


@pytest.mark.property
def test_a_failure_leaves_the_old_directory(tmp_path: Path) -> None:
    final = tmp_path / "bench"
    with campaign_directory(final) as folder:
        (folder / "one").write_text("old")
    with pytest.raises(KeyboardInterrupt), campaign_directory(final) as folder:
        (folder / "one").write_text("half")
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == ["bench"]
    assert (final / "one").read_text() == "old"
    with campaign_directory(final) as folder:
        (folder / "two").write_text("new")
    assert [path.name for path in final.iterdir()] == ["two"]
    assert [path.name for path in tmp_path.iterdir()] == ["bench"]


@pytest.mark.planted
def test_stage_tells_the_campaign_and_never_the_truth(tmp_path: Path) -> None:
    summary = RECORD_BENCH.run(_context(tmp_path, CUSTOM))
    assert summary["declared_effects"] == ["backlash"]
    assert "remanence" not in repr(summary)
    directory = tmp_path / str(summary["campaign"])
    assert load_campaign(directory).declared_effects == ("backlash",)
    assert all("remanence" not in path.read_text() for path in directory.glob("*.yaml"))
    assert not sealed_path(directory).is_relative_to(directory)
    effects = {item["name"]: item for item in open_sealed(directory)["effects"]}
    assert effects["remanence"]["share_of_force_rms"] == pytest.approx(0.05, rel=0.05)
    assert effects["remanence"]["declared"] is False


@pytest.mark.property
def test_the_same_seed_records_the_same_files(tmp_path: Path) -> None:
    import h5py

    seen = []
    for place, seed in (("one", 5), ("two", 5), ("three", 6)):
        RECORD_BENCH.run(_context(tmp_path / place, CUSTOM, seed))
        with h5py.File(tmp_path / place / "campaigns" / "bench" / "a.h5") as file:
            seen.append(file["F"][()])
    assert np.array_equal(seen[0], seen[1])
    assert not np.array_equal(seen[0], seen[2])


@pytest.mark.property
def test_settings_are_the_rigs_so_that_a_default_exists_once() -> None:
    settings = LaboratorySettings()
    for section, rig in ((settings.bench, BenchRig), (settings.frame, FrameRig), (settings.closed_loop, LoopRig)):
        assert isinstance(section, rig)
        assert {name: getattr(section, name) for name in rig.model_fields} == dict(rig())
    assert set(CustomTest.model_fields) == {field.name for field in dataclasses.fields(BenchTest)}
