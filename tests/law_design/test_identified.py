"""Uncertainty of structure and damper from the artifacts of their identification and tracing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance, load_parameter_set
from mrpipe.dampers.model import Addition, DamperModel, damper_from_parameter_set, write_damper
from mrpipe.errors import UserError
from mrpipe.law_design import uncertainty as uncertain
from mrpipe.law_design.identified import damper_uncertainty, frame_uncertainty, traced_damper_uncertainty
from mrpipe.law_design.problem import scaled_force
from mrpipe.law_design.uncertainty import DamperUncertainty, FrameUncertainty, draw
from mrpipe.structures import frame_from_parameter_set

pytestmark = pytest.mark.property

NAMES = ("yield_displacement", "c0_a")
COVARIANCE = np.array([[1e-10, 0.0], [0.0, 0.25]])
SUMMARY = {
    "after": {"nrmse": 0.004},
    "effects": [
        {
            "name": "remanence",
            "parameters": {
                "share": {"value": 0.6, "interval": [0.6 - 1.96 * 0.05, 0.6 + 1.96 * 0.05]},
                "fade_time": {"value": 0.4, "interval": None},
            },
        }
    ],
}


@pytest.fixture
def damper() -> DamperModel:
    return damper_from_parameter_set(load_parameter_set("dampers", "set-c"))


def _identified(path: Path, damper: DamperModel) -> Artifact:
    with ArtifactWriter.create(path, Provenance("identify-damper")) as artifact:
        write_damper(artifact, damper)
        artifact.put_json("parameter_names", list(NAMES))
        artifact.put("covariance", COVARIANCE, unit="1", dims=("parameter", "parameter_of_column"))
        artifact.put_json("comparison", [{"form": damper.form, "validation_nrmse": 0.02}])
    return Artifact(path)


def _traced(path: Path, damper: DamperModel, summary: dict[str, Any]) -> Artifact:
    with ArtifactWriter.create(path, Provenance("close-loop")) as artifact:
        write_damper(artifact, damper)
        artifact.put_json("summary", summary)
    return Artifact(path)


def test_a_damper_has_its_covariance_and_the_error_on_validation_tests(tmp_path: Path, damper: DamperModel) -> None:
    found = damper_uncertainty(_identified(tmp_path / "damper.h5", damper))
    assert found.names == NAMES and found.force_relative == 0.02 and found.effects == {}
    np.testing.assert_array_equal(found.covariance, COVARIANCE)


def test_a_traced_damper_has_the_intervals_of_its_effects_and_the_error_after(
    tmp_path: Path, damper: DamperModel
) -> None:
    identified = _identified(tmp_path / "damper.h5", damper)
    found = traced_damper_uncertainty(identified, _traced(tmp_path / "a.h5", damper, SUMMARY))
    assert found.names == NAMES and found.force_relative == 0.004
    assert found.effects == {"remanence.share": pytest.approx(0.05)}
    # the covariance of another base form says nothing
    other = _traced(tmp_path / "b.h5", replace(damper, form="bouc-wen-n"), SUMMARY)
    assert traced_damper_uncertainty(identified, other).names == ()


def test_effects_are_drawn_and_their_forces_scaled(tmp_path: Path, damper: DamperModel) -> None:
    effect = Addition(
        "remanence", "relaxing", {"share": 0.6, "force": 8.0}, {"share": "1", "force": "N"}, False, lambda _: []
    )
    traced = replace(damper, effects=(effect,))
    identified = _identified(tmp_path / "damper.h5", damper)
    uncertainty = traced_damper_uncertainty(identified, _traced(tmp_path / "a.h5", damper, SUMMARY))
    rng = np.random.default_rng(2)
    frame = frame_from_parameter_set("thesis")
    certain = FrameUncertainty.none(5)
    draws = [draw(frame, traced, certain, uncertainty, rng) for _ in range(200)]
    shares = np.array([item.damper.effects[0].values["share"] for item in draws])
    assert np.std(shares) == pytest.approx(0.05, rel=0.15)
    assert {item.damper.effects[0].values["force"] for item in draws} == {8.0}
    assert np.std([item.damper.parameters["c0_a"] for item in draws]) == pytest.approx(0.5, rel=0.15)
    np.testing.assert_allclose([item.numbers["remanence.share"] for item in draws], (shares - 0.6) / 0.05, rtol=1e-9)
    scaled = scaled_force(traced, 1.5)
    assert scaled.effects[0].values == {"share": 0.6, "force": 12.0}
    assert "excite remanence" in uncertain.test_for("remanence.share")


def test_a_drawn_frame_keeps_its_ground_motion_and_names(damper: DamperModel) -> None:
    frame = replace(
        frame_from_parameter_set("thesis"),
        influence=np.array([1.0, 0.0, 1.0, 0.0, 1.0]),
        degrees_of_freedom=tuple("abcde"),
    )
    known = FrameUncertainty(np.full(5, 0.01), np.full(5, 0.001))
    drawn = draw(frame, damper, known, DamperUncertainty.without_covariance(), np.random.default_rng(1)).frame
    assert (drawn.moved_by_ground, drawn.names) == ((0, 2, 4), frame.names)
    assert not np.allclose(drawn.stiffness, frame.stiffness)


def test_a_frame_without_intervals_is_certain(tmp_path: Path) -> None:
    frame = frame_from_parameter_set("thesis")
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("identify-frame")) as artifact:
        artifact.put_json("structure", {})
    found = frame_uncertainty(Artifact(tmp_path / "frame.h5"), frame)
    assert not found.frequency_relative.any() and not found.damping_ratio.any()


def _frame_artifact(path: Path, bounds: np.ndarray, numbers: list[int]) -> Artifact:
    with ArtifactWriter.create(path, Provenance("identify-frame")) as artifact:
        artifact.put("modes/number", np.asarray(numbers, dtype=np.float64), unit="1", dims=("mode",))
        artifact.put("modes/damping_ratio_interval", bounds, unit="1", dims=("mode", "bound"))
    return Artifact(path)


def test_intervals_belong_to_the_modes_that_were_identified(tmp_path: Path) -> None:
    bounds = np.array([[0.01, 0.01 + 2.0 * 1.96 * 0.001], [0.02, 0.02 + 2.0 * 1.96 * 0.003]])
    artifact = _frame_artifact(tmp_path / "frame.h5", bounds, [1, 3])
    found = frame_uncertainty(artifact, frame_from_parameter_set("thesis"))
    np.testing.assert_allclose(found.damping_ratio, [0.001, 0.0, 0.003, 0.0, 0.0])


@pytest.mark.parametrize(
    ("shape", "numbers", "words"),
    [
        ((3, 2), [1, 2], r"frame\.h5: modes/damping_ratio_interval: has shape \(3, 2\).*2 identified modes"),
        ((2, 1), [1, 2], r"frame\.h5: modes/damping_ratio_interval: has shape \(2, 1\)"),
        ((2, 2), [1, 9], r"frame\.h5: modes/number: holds modes 1 to 9, and the frame has 5"),
    ],
)
def test_intervals_of_a_wrong_shape_are_refused(
    tmp_path: Path, shape: tuple[int, int], numbers: list[int], words: str
) -> None:
    artifact = _frame_artifact(tmp_path / "frame.h5", np.ones(shape), numbers)
    with pytest.raises(UserError, match=words):
        frame_uncertainty(artifact, frame_from_parameter_set("thesis"))
