"""The four stages on a small bench, without the pipeline around them."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.config.sections.assemble import AssembleSettings
from mrpipe.config.sections.sweep import SweepSettings
from mrpipe.config.sections.train_forward import TrainForwardSettings
from mrpipe.config.sections.train_inverse import TrainInverseSettings
from mrpipe.errors import UserError
from mrpipe.networks import read_network
from mrpipe.networks.assembly import read_history, samples
from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.signals.prepared import PreparedTest, write_prepared
from mrpipe.stages import assemble, sweep, train_forward, train_inverse
from tests.networks.rig import bench_test, bench_tests

FILES = {
    "prepare": "prepared.h5",
    "assemble": "training.h5",
    "sweep": "sweep.h5",
    "train-forward": "forward.h5",
    "train-inverse": "inverse.h5",
}
QUICK_TRAINING = {
    "architecture": (6, 6),
    "starts": 4,
    "refined_starts": 1,
    "subsample_iterations": 80,
    "iterations": 30,
}
QUICK_SWEEP = {
    "states": (("velocity",), ("displacement",), ("velocity", "acceleration")),
    "past_values": (1, 3),
    "layers": (1, 2),
    "neurons": (6,),
    "starts": 2,
    "screen_rows": 400,
    "screen_iterations": 15,
    "refined": 2,
    "refine_rows": 800,
    "refine_iterations": 10,
    "held_out_rows": 400,
}


@dataclass
class Sink:
    texts: list[str] = field(default_factory=list)
    tables: dict[str, Any] = field(default_factory=dict)
    figures: dict[str, Any] = field(default_factory=dict)

    def text(self, paragraph: str) -> None:
        self.texts.append(paragraph)

    def table(self, name: str, frame: Any, caption: str) -> None:
        self.tables[name] = frame

    def figure(self, name: str, figure: Any, caption: str) -> None:
        figure.draw_without_rendering()
        self.figures[name] = figure


@dataclass
class Rig:
    """A run directory in which the stages are called one by one."""

    directory: Path
    settings: dict[str, Any] = field(default_factory=dict)
    sinks: dict[str, Sink] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def prepare(self, tests: list[PreparedTest]) -> None:
        with ArtifactWriter.create(self.directory / "prepared.h5", Provenance("prepare")) as artifact:
            write_prepared(artifact, tests)

    def run(self, stage: Stage) -> Mapping[str, Any]:
        there = {name: self.directory / file for name, file in FILES.items() if (self.directory / file).exists()}
        self.sinks[stage.name] = Sink()
        context = StageContext(
            stage=stage.name,
            settings=SimpleNamespace(**self.settings),
            inputs={name: there[name] for name in (*stage.inputs, *stage.optional_inputs) if name in there},
            run_directory=self.directory,
            rng=np.random.default_rng(3),
            seed=3,
            jobs=2,
            progress=lambda fraction, text="": None,
            report=self.sinks[stage.name],
            log=logging.getLogger("test"),
            provenance=Provenance(stage.name),
            warnings=self.warnings,
        )
        summary = stage.run(context)
        json.dumps(summary)  # plain Python throughout
        return summary


def rig_in(directory: Path, **settings: Any) -> Rig:
    chosen = {
        "assemble": AssembleSettings(cycles=3),
        "sweep": SweepSettings(**QUICK_SWEEP),
        "train_forward": TrainForwardSettings(**QUICK_TRAINING),
        "train_inverse": TrainInverseSettings(**{**QUICK_TRAINING, "architecture": (12, 6)}),
    }
    return Rig(directory, {**chosen, **settings})


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Rig, dict[str, Mapping[str, Any]]]:
    rig = rig_in(tmp_path_factory.mktemp("run"))
    rig.prepare([*bench_tests(), *bench_tests("validation", (1.27,))])
    stages = (assemble.STAGE, sweep.STAGE, train_forward.STAGE, train_inverse.STAGE)
    return rig, {stage.name: rig.run(stage) for stage in stages}


@pytest.mark.property
@pytest.mark.parametrize("name", ["train-forward", "train-inverse"])
def test_summaries_have_the_keys_that_callers_rely_on(
    built: tuple[Rig, dict[str, Mapping[str, Any]]], name: str
) -> None:
    summary = built[1][name]
    # one start goes on in these tests, so that there is nothing to average
    shape, count = {"train-forward": ("8-6-6-1", 90), "train-inverse": ("8-12-6-1", 193)}[name]
    assert summary["architecture"] == shape and summary["members"] == 1
    for key in ("training_nrmse", "validation_nrmse", "validation_fit_percent", "seconds"):
        assert isinstance(summary[key], float)
    assert summary["parameters"] == count
    assert isinstance(summary["iterations"], int)
    assert summary["validation_nrmse"] < 0.5 * summary["linear_baseline_nrmse"]


@pytest.mark.property
def test_training_set_holds_rows_and_normalisation_that_training_uses(
    built: tuple[Rig, dict[str, Mapping[str, Any]]],
) -> None:
    rig, _ = built
    artifact = Artifact(rig.directory / "training.h5")
    network = read_network(Artifact(rig.directory / "forward.h5"), "network")
    rows = samples(read_history(artifact, "training"), network.features)
    np.testing.assert_array_equal(artifact.array("forward/training/features"), rows.features)
    np.testing.assert_array_equal(artifact.array("forward/training/target"), rows.target)
    np.testing.assert_array_equal(artifact.array("forward/input_scale"), network.input_scale)
    assert artifact.scalar("forward/output_scale") == network.output_scale
    assert artifact.unit("training/force") == "N"
    assert artifact.unit("training/drive") == artifact.unit("inverse/training/target") == "A"


@pytest.mark.property
def test_inverse_says_how_it_tracks(built: tuple[Rig, dict[str, Mapping[str, Any]]]) -> None:
    rig, summaries = built
    summary = summaries["train-inverse"]
    assert summary["drive_range_a"] == pytest.approx(4.0, abs=0.02)
    assert set(summary["round_trip_regime_nrmse"]) == {"pre_yield", "reversal", "post_yield"}
    assert summary["round_trip_nrmse"] < 0.5
    assert summary["negative_drive_share"] < summary["negative_drive_share_signed"]
    assert {"drive", "viscous", "training"} <= set(rig.sinks["train-inverse"].figures)


@pytest.mark.property
def test_viscous_damping_beyond_the_campaign_is_warned_of(
    built: tuple[Rig, dict[str, Mapping[str, Any]]], tmp_path: Path
) -> None:
    built_rig, _ = built
    quick = {"starts": 1, "subsample_iterations": 5, "iterations": 0, "compare_signed": False}
    rig = rig_in(tmp_path, train_inverse=TrainInverseSettings(**quick, viscous={"amplitude_m": 0.05}))
    for name in ("training.h5", "sweep.h5", "forward.h5"):
        (tmp_path / name).write_bytes((built_rig.directory / name).read_bytes())
    summary = rig.run(train_inverse.STAGE)
    assert summary["viscous_outside_training_range_share"] > 0.3
    assert any("viscous damping to be emulated lies" in warning for warning in rig.warnings)
    assert not any("viscous damping to be emulated lies" in warning for warning in built_rig.warnings)


@pytest.mark.property
def test_sweep_gives_a_choice_and_verdicts(built: tuple[Rig, dict[str, Mapping[str, Any]]]) -> None:
    rig, summaries = built
    artifact = Artifact(rig.directory / "sweep.h5")
    choice = artifact.json("choice")
    assert set(choice) == {"channels", "past_values", "hidden", "biases"}
    assert artifact.array("screened_nrmse").shape == (summaries["sweep"]["candidates"], 2)
    refined = np.isfinite(artifact.array("refined_nrmse")).all(axis=1)
    assert refined.sum() == summaries["sweep"]["refined"]
    assert summaries["sweep"]["findings"]["velocity"]["verdict"] in {"holds", "differs"}
    assert summaries["sweep"]["predicted_seconds"] > 0.0
    assert len(rig.sinks["sweep"].tables["candidates"]) == summaries["sweep"]["candidates"]


@pytest.mark.property
def test_the_choice_of_the_sweep_can_be_trained(
    built: tuple[Rig, dict[str, Mapping[str, Any]]], tmp_path: Path
) -> None:
    built_rig, _ = built
    settings = {**QUICK_TRAINING, "architecture": "sweep", "subsample_iterations": 5, "iterations": 0}
    rig = rig_in(tmp_path, train_forward=TrainForwardSettings(**settings))
    for name in ("training.h5", "sweep.h5"):
        (tmp_path / name).write_bytes((built_rig.directory / name).read_bytes())
    choice = Artifact(tmp_path / "sweep.h5").json("choice")
    summary = rig.run(train_forward.STAGE)
    assert summary["inputs"] == choice["channels"]
    assert summary["architecture"].split("-")[1:-1] == [str(count) for count in choice["hidden"]]
    assert summary["biases"] is choice["biases"]


@pytest.mark.property
def test_forward_with_past_force_reports_one_step_and_free_run(tmp_path: Path) -> None:
    rig = rig_in(tmp_path, assemble=AssembleSettings(cycles=3, forward_past_force=True, past_values=2))
    rig.prepare([*bench_tests(), *bench_tests("validation", (1.27,))])
    rig.run(assemble.STAGE)
    with ArtifactWriter.create(tmp_path / "sweep.h5", Provenance("sweep")) as artifact:
        artifact.put_json("choice", {})
    summary = rig.run(train_forward.STAGE)
    assert summary["architecture"] == "8-6-6-1"
    assert summary["one_step_nrmse"] == summary["validation_nrmse"] < 0.05
    assert summary["free_run_nrmse"] > summary["one_step_nrmse"]


@pytest.mark.property
def test_an_inverse_of_a_drive_that_never_changes_is_refused(tmp_path: Path) -> None:
    rig = rig_in(tmp_path)
    tests = [bench_test(f"t{f}", f, 2.0) for f in (1.0, 1.8)]
    rig.prepare([*tests, bench_test("v", 1.27, 2.0, role="validation")])
    rig.run(assemble.STAGE)
    with ArtifactWriter.create(tmp_path / "sweep.h5", Provenance("sweep")) as artifact:
        artifact.put_json("choice", {})
    with pytest.raises(UserError, match=r"drive: never changes in the training tests \(2\)") as told:
        rig.run(train_inverse.STAGE)
    assert "\n" not in str(told.value)
    assert not (tmp_path / "inverse.h5").exists()


@pytest.mark.property
def test_a_campaign_without_validation_tests_is_refused(tmp_path: Path) -> None:
    rig = rig_in(tmp_path)
    rig.prepare(bench_tests())
    with pytest.raises(UserError, match="no validation test; give role: validation"):
        rig.run(assemble.STAGE)
    assert not (tmp_path / "training.h5").exists()


@pytest.mark.property
def test_leaving_the_training_range_is_warned_of(tmp_path: Path) -> None:
    rig = rig_in(tmp_path)
    rig.prepare([*bench_tests(), bench_test("fast", 4.0, 3.0, role="validation")])
    rig.run(assemble.STAGE)
    with ArtifactWriter.create(tmp_path / "sweep.h5", Provenance("sweep")) as artifact:
        artifact.put_json("choice", {})
    rig.run(train_forward.STAGE)
    assert any("outside the training range" in warning for warning in rig.warnings)
