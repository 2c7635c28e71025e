"""What a benchmark run stores, and the damper and the motion that its settings name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance, load_parameter_set
from mrpipe.case_studies.base_isolated.study import run_cases
from mrpipe.case_studies.motion import motion_facts, motion_from_settings, spectrum_compatible_motion
from mrpipe.case_studies.options import MotionSettings
from mrpipe.case_studies.run import BinghamDevice, bingham_device
from mrpipe.case_studies.storage import write_cases, write_response
from tests.case_studies.test_base_isolated import study_of, surrogate_building

pytestmark = pytest.mark.property


def test_a_response_is_stored_with_its_units(tmp_path: Path) -> None:
    motion = spectrum_compatible_motion(np.random.default_rng(8), duration_s=2.0)
    response = study_of(surrogate_building()).run(motion)
    with ArtifactWriter.create(tmp_path / "run.h5", Provenance("benchmark-base-isolated")) as artifact:
        write_response(artifact, "responses/vd", response)
    stored = Artifact(tmp_path / "run.h5")
    np.testing.assert_array_equal(stored.array("responses/vd/force"), response.forces)
    units = {"time": "s", "stroke": "m", "rod_velocity": "m/s", "desired_force": "N", "voltage": "V", "energies": "J"}
    for name, unit in units.items():
        assert stored.unit(f"responses/vd/{name}") == unit


def test_the_runs_of_all_laws_are_stored_with_the_source_of_the_model(tmp_path: Path) -> None:
    study = study_of(surrogate_building())
    motion = spectrum_compatible_motion(np.random.default_rng(8), duration_s=2.0)
    _, cases = run_cases(study, motion, ("vd", "passive-on"))
    with ArtifactWriter.create(tmp_path / "run.h5", Provenance("benchmark-base-isolated")) as artifact:
        write_cases(artifact, study.building.model, cases)
    stored = Artifact(tmp_path / "run.h5")
    assert sorted(stored.members("responses")) == ["passive-on", "vd"]
    for case in cases:
        np.testing.assert_array_equal(stored.array(f"responses/{case.law}/force"), case.response.forces)
    notes = stored.attributes("/")
    assert (notes["model"], notes["source"]) == ("surrogate", study.building.model.source)


def test_the_damper_of_a_parameter_set() -> None:
    values = load_parameter_set("dampers", "bingham-1000kn")
    device = bingham_device("bingham-1000kn")
    assert isinstance(device, BinghamDevice)
    assert (device.force, device.highest_voltage) == (values.scalar("yield_force_a"), values.scalar("drive_limit"))


def test_the_motion_of_the_settings() -> None:
    settings = MotionSettings(file="synthetic", duration_s=6.0)
    motion = motion_from_settings(settings, np.random.default_rng(1), 1)
    facts = motion_facts(motion)
    assert motion.acceleration_m_s2.shape[1] == 1
    assert facts["name"] == "synthetic" and facts["duration_s"] == pytest.approx(6.0, abs=0.02)
