"""Gains of a design in place of the calibrated ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.control.calibration import CalibrationOptions, calibrate
from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named
from mrpipe.control.lqg import Weights
from mrpipe.control.storage import read_calibrated_with, write_calibration
from mrpipe.errors import UserError
from mrpipe.structures import frame_from_parameter_set

LAWS = tuple(law_named(name) for name in ("vd", "vdns"))
PROVENANCE = Provenance("test", "", {}, 0)


@pytest.fixture
def artifacts(tmp_path: Path) -> dict[str, Path]:
    frame, position = frame_from_parameter_set("thesis"), np.eye(5)[0]
    calibration = calibrate(frame, position, CalibrationOptions(), LAWS)
    with ArtifactWriter.create(tmp_path / "control.h5", PROVENANCE) as artifact:
        write_calibration(artifact, calibration, position, Weights(), None, 0.005, 0.0093, 22.0)
    with ArtifactWriter.create(tmp_path / "design.h5", PROVENANCE) as artifact:
        artifact.put_json("laws/vd/gains", {"c_n_s_m": 624.0, "k_n_m": 0.0, "alpha_n_m": 0.0})
        artifact.put_json("laws/passive-on/gains", dict(Gains()))
    return {"calibrate": tmp_path / "control.h5", "design": tmp_path / "design.h5"}


@pytest.mark.property
def test_the_gains_of_a_design_replace_the_calibrated_ones(artifacts: dict[str, Path]) -> None:
    found = read_calibrated_with(lambda stage: Artifact(artifacts[stage]), "design")
    assert found.gains_of("vd").c_n_s_m == 624.0
    # the calibrated gains stay, because the reference network of nnc was trained with them
    assert found.gains["vd"].c_n_s_m != 624.0
    assert found.gains_of("passive-off") == Gains()
    with pytest.raises(UserError, match=r"no gains of law vdns"):
        found.gains_of("vdns")


@pytest.mark.property
def test_calibrated_gains_need_no_design(artifacts: dict[str, Path]) -> None:
    artifacts.pop("design")
    found = read_calibrated_with(lambda stage: Artifact(artifacts[stage]), "calibrated")
    assert found.gains_of("vd") == found.gains["vd"]
