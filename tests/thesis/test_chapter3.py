"""Chapter 3 of the thesis: what follows from the printed frame, and what a run adds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.structures import frame_from_parameter_set, modal_assurance, natural_modes, shear_frame, write_frame
from mrpipe.thesis.bench import Bench, bench_of_sets
from mrpipe.thesis.chapter3 import chapter_3, shape_formula
from mrpipe.thesis.claim import Missing, Value

FRAME = frame_from_parameter_set("thesis")


@pytest.fixture(scope="module")
def bench() -> Bench:
    return bench_of_sets(FRAME)


@pytest.mark.property
@pytest.mark.parametrize("floors", [3, 5, 8])
def test_the_corrected_formula_gives_the_modes_of_a_uniform_frame(floors: int) -> None:
    uniform = natural_modes(shear_frame(np.ones(floors), np.full(floors, 1000.0), 0.01)).mode_shapes
    assert np.diag(modal_assurance(shape_formula(floors, exchanged=False), uniform)) == pytest.approx(1.0)
    assert np.diag(modal_assurance(shape_formula(floors, exchanged=True), uniform)).min() < 0.99


@pytest.mark.property
def test_without_a_run_its_claims_say_what_they_need(bench: Bench) -> None:
    found = chapter_3(bench, FRAME)
    missing = {name: item.reason for name, item in found.items() if isinstance(item, Missing)}
    assert set(missing) == {
        "R3-omega", "R3-damping", "R3-k11", "F3-band", "F3-sinusoid", "F3-point-to-point", "F3-exponential",
    }  # fmt: skip
    assert set(missing.values()) == {"it needs a run (reproduce.source: run)"}


@pytest.mark.golden
def test_a_run_gives_its_own_values(bench: Bench, tmp_path) -> None:
    frame = shear_frame(np.full(5, 5.95), np.full(5, 7000.0), 0.01)
    modes = natural_modes(frame)
    time = np.linspace(0.0, 4.0, 21)
    decays = [{"mode": 1, "point_to_point": {"value": 0.012}, "logarithmic_decrement": {"value": 0.010}}]
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, frame)
        artifact.put("modes/shapes", modes.mode_shapes, unit="1", dims=("floor", "mode"))
        artifact.put("modes/angular_frequency", modes.angular_frequencies, unit="rad/s", dims=("mode",))
        artifact.put("modes/damping_ratio", np.full(5, 0.01), unit="1", dims=("mode",))
        artifact.put("decays/mode_1/peak_time", time, unit="s", dims=("peak",))
        artifact.put("decays/mode_1/peak", 1.0 - 0.2 * time, unit="m/s^2", dims=("peak",))
        artifact.put_json("summary", {"decays": decays})
    run = replace(bench, artifacts={"identify-frame": Artifact(tmp_path / "frame.h5")})
    found = {name: item.value for name, item in chapter_3(run, FRAME).items() if isinstance(item, Value)}
    assert found["R3-omega"] == pytest.approx(modes.angular_frequencies)
    assert found["R3-k11"] == pytest.approx(14000.0)
    # a shear frame has no entries off its bands, and a uniform one the shapes of the formula
    assert found["F3-band"] == pytest.approx(0.0, abs=1e-9)
    assert found["F3-sinusoid"] == pytest.approx(1.0)
    assert found["F3-point-to-point"] == pytest.approx(1.2)
    # peaks that fall in a straight line are no exponential
    assert found["F3-exponential"] > 10.0
