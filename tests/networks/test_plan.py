"""What a training stage trains: settings, training set and sweep together."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.networks.assembly import History, join, write_history
from mrpipe.networks.network import FeatureSpec, spec_to_json
from mrpipe.networks.options import THESIS_HIDDEN, SweepOptions, TrainingOptions
from mrpipe.networks.plan import fit_doubt, sweep_grid, training_plan
from mrpipe.signals.prepared import PreparedTest
from tests.networks.rig import bench_test

pytestmark = pytest.mark.property

FORWARD = FeatureSpec(("velocity", "drive"), 3, False, 200.0, "force")
INVERSE = FeatureSpec(("velocity", "force"), 3, True, 200.0, "drive")
CHOICE = {"channels": ["displacement", "drive"], "past_values": 5, "hidden": [12, 6], "biases": True}


def history(*tests: PreparedTest) -> History:
    return join(tests, cycles=2, sampling_rate_hz=200.0)


@pytest.fixture(scope="module")
def training_set(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    path: Path = tmp_path_factory.mktemp("plan") / "training.h5"
    with ArtifactWriter.create(path, Provenance("assemble")) as artifact:
        write_history(artifact, "training", history(bench_test("a", 1.0, 1.0), bench_test("b", 2.0, 0.0)))
        write_history(artifact, "validation", history(bench_test("v", 1.5, 1.0, role="validation")))
        for name, spec in (("forward", FORWARD), ("inverse", INVERSE)):
            artifact.put_json(f"{name}/features", spec_to_json(spec))
        artifact.attributes("/", normalisation="range")
    return Artifact(path)


def _plan(training_set: Artifact, kind: Any, **options: Any) -> Any:
    return training_plan(TrainingOptions(**options), training_set, CHOICE, kind)


def test_an_architecture_of_the_settings_leaves_the_choice_of_the_sweep_aside(training_set: Artifact) -> None:
    plan = _plan(training_set, "forward", architecture=(8,), biases=False)
    assert plan.options.architecture == (8,) and not plan.options.biases
    assert plan.spec == FORWARD
    assert plan.training.names == ("a", "b") and plan.validation.names == ("v",)
    assert plan.normalisation == "range"


def test_the_forward_network_takes_the_whole_choice_of_the_sweep(training_set: Artifact) -> None:
    plan = _plan(training_set, "forward", architecture="sweep")
    assert plan.options.architecture == (12, 6) and plan.options.biases
    assert (plan.spec.channels, plan.spec.past_values) == (("displacement", "drive"), 5)


def test_the_inverse_network_keeps_its_own_inputs(training_set: Artifact) -> None:
    plan = _plan(training_set, "inverse", architecture="sweep")
    assert plan.options.architecture == (12, 6)
    assert (plan.spec.channels, plan.spec.past_values, plan.spec.target) == (("velocity", "force"), 5, "drive")


def test_the_axes_of_a_sweep_cross_at_the_reference_network() -> None:
    options = SweepOptions(states=(("velocity",), ("displacement",)), past_values=(0, 3), layers=(1, 2), neurons=(6,))
    grid = sweep_grid(options, 3)
    assert grid.centre.past_values == 3 and grid.centre.hidden == THESIS_HIDDEN
    assert grid.states == (("velocity",), ("displacement",)) and grid.past_values == (0, 3)
    star, full = grid.candidates("star"), grid.candidates("full")
    assert set(star) <= {*full, grid.centre}
    assert len(full) == len(set(full)) == 2 * 2 * 2 * len(options.biases)
    assert np.all([candidate in star for candidate in (grid.centre,)])


def test_a_constant_target_of_the_validation_tests_is_a_doubt_of_the_training() -> None:
    plan = SimpleNamespace(spec=INVERSE)

    def doubt(samples: int, nrmse: float, fit_percent: float) -> str | None:
        pooled = SimpleNamespace(samples=samples, nrmse=nrmse, fit_percent=fit_percent)
        return fit_doubt(SimpleNamespace(pooled=pooled), plan)  # type: ignore[arg-type]

    assert doubt(100, 0.02, 96.0) is None
    assert "the drive of the validation tests is constant" in str(doubt(100, 0.02, np.nan))
    assert doubt(0, np.nan, np.nan) == "the campaign has no validation test"
