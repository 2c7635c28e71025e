"""The stage as a whole on a small traced campaign: closed loop of every law, files for prepare and record, words."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.config.loader import LoadedConfig, load_config
from mrpipe.config.model import config_model
from mrpipe.control.calibration import CalibrationOptions, calibrate
from mrpipe.control.laws import law_names
from mrpipe.control.lqg import Weights
from mrpipe.control.neural import ReferenceOptions, train_reference
from mrpipe.control.storage import write_calibration
from mrpipe.effects.damper import read_damper
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.damper import damper_model
from mrpipe.pipeline.fingerprint import FileHashes, plain_settings
from mrpipe.pipeline.runner import Pipeline
from mrpipe.pipeline.settings_view import SettingsView
from mrpipe.pipeline.stage import StageContext
from mrpipe.reporting import close_loop as section
from mrpipe.reporting.headlines import in_brief
from mrpipe.signals.prepared import PreparedTest
from mrpipe.stages import close_loop
from mrpipe.stages.close_loop import closed_loop
from mrpipe.stages.registry import all_stages
from mrpipe.structures import floor_position, frame_from_parameter_set
from mrpipe.structures.frame import write_frame
from mrpipe.thesis.gains import THESIS_GAINS
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.bench.verdict.identified import comparison_with_identified
from mrpipe.tracing.bench.verdict.summary import UNATTRIBUTED, Tracing
from mrpipe.tracing.loop import band
from mrpipe.tracing.options import TracingOptions, tracing_options
from tests.tracing.bench.rig import campaign

LAWS = ("vd", "vdns", "fdns", "nnc", "lqg", "bang-bang", "passive-on")
"""Every kind of law: linear, friction, network, observer, and laws that command the drive."""

SETTINGS: dict[str, Any] = {
    "close_loop": {"laws": LAWS},
    "simulate": {
        "plant_rate_hz": 1000.0,
        "controller": {"inverse": "model", "residual_force_n": 18.0},
        "excitation": {
            "frequency_rad_s": 8.0,
            "cycles": 10,
            "settling_cycles": 5,
            "decay_s": 1.0,
            "base_amplitude_m_s2": 0.788,
        },
    },
}


@dataclass
class Sink:
    """A report that only remembers."""

    texts: list[str] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    def text(self, paragraph: str) -> None:
        self.texts.append(paragraph)

    def table(self, name: str, frame: Any, caption: str) -> None:
        self.names.append(name)

    def figure(self, name: str, figure: Any, caption: str) -> None:
        self.names.append(name)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Write a frame and its calibration."""
    folder = tmp_path_factory.mktemp("inputs")
    frame = frame_from_parameter_set("thesis")
    position = floor_position(frame.floors, 1)
    calibration = calibrate(frame, position, CalibrationOptions(source="published", published=THESIS_GAINS))
    quick = ReferenceOptions(3000.0, (0.005, 0.01, 0.015), (1.0, 1.3), hidden=(4,), starts=1, iterations=15, rows=1500)
    reference = train_reference(quick, np.random.default_rng(0))
    provenance = Provenance("test", "", {}, 0)
    with ArtifactWriter.create(folder / "frame.h5", provenance) as artifact:
        write_frame(artifact, frame)
    with ArtifactWriter.create(folder / "control.h5", provenance) as artifact:
        write_calibration(artifact, calibration, position, Weights(), reference, 0.005, 0.0093, 22.0)
    return {"identify-frame": folder / "frame.h5", "calibrate": folder / "control.h5"}


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coarse response curves: what is tested is what is done with them."""
    monkeypatch.setattr(band, "OPTIONS", replace(band.OPTIONS, points=5, tolerance=0.05, frequency_tolerance=0.05))


@pytest.fixture(scope="module")
def tests() -> list[PreparedTest]:
    # a few of them do: what is tested is what becomes of a verdict; in volts, because amperes are the usual unit
    return [
        replace(test, drive_unit="V") for k, test in enumerate(campaign("accumulator")) if k in (0, 1, 3, 6, 8, 11, 12)
    ]


@pytest.fixture(scope="module")
def traced(tests: list[PreparedTest]) -> Tracing:
    library = {name: damper_effects()[name] for name in ("accumulator",)}
    few = ("bouc-wen", "dahl")
    options = TracingOptions(base_forms=few, refits=1, bootstrap_draws=50, most_effects=1, observation_filter=False)
    return trace_campaign(tests, library, [], options, rng=np.random.default_rng(1))


def context(tmp_path: Path, inputs: dict[str, Path], **changes: Any) -> StageContext:
    config = config_model().model_validate({**SETTINGS, **changes})
    return StageContext(
        "close-loop", SettingsView(config, close_loop.STAGE.settings, "close-loop"), inputs, tmp_path,
        np.random.default_rng(0), 0, 1, lambda fraction, text="": None, Sink(), logging.getLogger("test"),
        Provenance("close-loop", "", {}, 0),
    )  # fmt: skip


@pytest.mark.property
def test_the_traced_damper_in_a_loop_is_no_reason_to_trace_again(tmp_path: Path) -> None:
    def key(**simulate: Any) -> dict[str, Any]:
        config = config_model().model_validate({"simulate": simulate})
        return plain_settings(config, close_loop.STAGE.settings, FileHashes(tmp_path))

    assert key(damper="traced") == key(damper="identified")
    assert key(plant_rate_hz=4000.0) != key()


@pytest.mark.property
def test_the_damper_that_was_identified_is_an_input_and_what_changes_it_makes_the_tracing_stale(tmp_path: Path) -> None:
    def fake(context: StageContext) -> dict[str, Any]:
        with context.write(f"{context.stage}.h5") as artifact:
            artifact.put("starts", float(context.seed), unit="1")
        return {}

    stages = {}
    campaigns = {"bench": str(tmp_path / "campaign.yaml"), "frame": None, "closed_loop": None}
    (tmp_path / "campaign.yaml").write_text("campaign: c\nrig: damper-bench\nchannels: {}\ntests: []\n")
    for name in ("prepare", "identify-damper", "close-loop"):
        real = all_stages()[name]
        stages[name] = replace(real, run=fake, outputs=(f"{name}.h5",), optional_inputs=(), check=None)
    assert stages["close-loop"].preferred_inputs == ("identify-damper",)

    def pipeline(**changes: Any) -> Pipeline:
        config = config_model().model_validate({"campaigns": campaigns, **changes})
        loaded = LoadedConfig(config, tmp_path / "config.yaml")
        return Pipeline(loaded, stages, tmp_path / "run", logging.getLogger("test"), quiet=True)

    first = pipeline()
    assert first.build("close-loop").what == "built"
    assert first.outcomes["identify-damper"].what == "built"
    assert pipeline().status(["close-loop"])["close-loop"] == []
    changed = pipeline(identify_damper={"starts": 3}).status(["close-loop"])
    assert changed["identify-damper"] == ["setting identify_damper.starts was 2, is 3"]
    assert changed["close-loop"] == ["identify-damper, which it reads, is stale"]


@pytest.mark.property
def test_the_declared_form_is_the_identified_one_unless_the_settings_name_another() -> None:
    section = config_model().model_validate({}).close_loop
    assert tracing_options(section, identified="dahl").model == "dahl"
    named = config_model().model_validate({"close_loop": {"model": "lugre"}}).close_loop
    assert tracing_options(named, identified="dahl").model == "lugre"


@pytest.mark.planted
def test_the_report_compares_the_declared_model_with_the_identified_damper(traced: Tracing) -> None:
    same = damper_model(traced.selection.base, traced.drive_unit)
    found = comparison_with_identified(same, {"bouc-wen": same}, traced)
    # the same numbers have the same error, on the same samples
    assert found["nrmse"] == pytest.approx(traced.summary["before"]["nrmse"], rel=1e-3)
    assert found["parameters"]["yield_displacement"]["value"] == found["parameters"]["yield_displacement"]["before"]
    assert found["laws"][-1]["yield_force_n"] == found["laws"][-1]["yield_force_before_n"]
    other = comparison_with_identified(replace(same, form="dahl"), {}, traced)
    assert other["why"].startswith("close_loop.model names bouc-wen, identify-damper chose dahl.")
    assert "parameters" not in other


@pytest.mark.planted
def test_every_law_runs_before_after_and_recalibrated(
    tmp_path: Path, inputs: dict[str, Path], tests: list[PreparedTest], traced: Tracing
) -> None:
    own = context(tmp_path, inputs)
    found = closed_loop(own, traced, tests)
    assert found["status"] == "predicted alone under harmonic excitation: no closed-loop recordings"
    assert [row["law"] for row in found["laws"]] == [law for law in law_names() if law in LAWS]
    assert found["plant"] == {"effects": ["accumulator"], "left_out": {}}
    assert found["controller"]["inverse"] == "rebuilt from the damper with its effects"
    assert set(found["ranking"]) == {"before", "after", "recalibrated"}
    assert set(found["ranking"]["after"]) == set(LAWS)
    for row in found["over_band"]["laws"]:
        assert 0.001 < row["after"]["peak_rms_x_top_m"] < 0.5
        # what is renewed is taken where it helps over the band
        assert row["recalibrated"]["peak_rms_x_top_m"] <= row["after"]["peak_rms_x_top_m"]
    assert set(found["controller"]["renewed"]) == set(LAWS)
    assert found["controller"]["renewed"]["passive-on"] == "nothing"
    summary = {"campaign": "c", **traced.summary, "closed_loop": found}
    summary["corrections"] = close_loop._corrections(own, traced, tests)
    summary["next_tests"] = close_loop._next_tests(own, traced, {})
    section.describe(own.report, section.Traced(traced, summary, 0.9, 0.05))
    sink = own.report
    assert isinstance(sink, Sink)
    for name in ("where", "maps", "ranking", "candidates", "loops", "errors", "tests", "laws"):
        assert name in sink.names
    lines = in_brief("close-loop", summary)
    assert any("effect accumulator" in line for line in lines)
    assert any("ranking of the laws" in line for line in lines)


@pytest.mark.property
def test_without_a_frame_the_closed_loop_is_skipped(tmp_path: Path, tests: list[PreparedTest], traced: Tracing) -> None:
    found = closed_loop(context(tmp_path, {}), traced, tests)
    assert found == {"status": "skipped: there is no identified frame and no calibrated law"}


@pytest.mark.property
def test_a_flexible_model_is_said_not_to_be_in_the_plant(
    tmp_path: Path, inputs: dict[str, Path], tests: list[PreparedTest], traced: Tracing
) -> None:
    bare = replace(
        traced,
        summary={**traced.summary, "effects": [UNATTRIBUTED]},
        selection=replace(traced.selection, chosen=traced.selection.base),
        named=(),
    )
    found = closed_loop(context(tmp_path, inputs), bare, tests)
    assert found["plant"]["effects"] == []
    assert "cannot run in a loop" in found["plant"]["left_out"]["unattributed"]
    assert not found["ranking_changes"]
    assert "recalibrated" not in found["ranking"]


@pytest.mark.property
def test_files_are_settings_that_keep_what_was_there(
    tmp_path: Path, tests: list[PreparedTest], traced: Tracing
) -> None:
    base = tmp_path / "config.yaml"
    base.write_text("name: x\n", encoding="utf-8")
    there = {"bench": {"tests": [{"name": "own", "motion": "triangle"}]}}
    known = {"corrections": {"force_offset_n": {"00-sine": 2.0}}}
    own = context(tmp_path, {}, laboratory=there, prepare=known)
    tie = {**traced.summary["effects"][0], "tied_with": ["inertia"]}
    tied = replace(traced, summary={**traced.summary, "effects": [tie]})
    assert not close_loop._corrections(own, tied, tests)["found"]
    wanted = close_loop._next_tests(own, tied, {})
    assert wanted["decides"][0]["decides"] == "accumulator or inertia"
    config = load_config(base, [], [tmp_path / "corrections.yaml", tmp_path / "next-tests.yaml"]).config
    assert config.prepare.corrections.force_offset_n == {"00-sine": 2.0}
    assert [item.name for item in config.laboratory.bench.tests] == ["own", *(item["name"] for item in wanted["tests"])]


@pytest.mark.property
def test_the_drive_of_a_campaign_in_volts_is_stored_in_volts(tmp_path: Path, traced: Tracing) -> None:
    close_loop._write(context(tmp_path, {}), traced, traced.summary)
    assert Artifact(tmp_path / "close-loop.h5").unit("validation/drive") == "V"
    assert read_damper(Artifact(tmp_path / close_loop.TRACED)).drive_unit == "V"
