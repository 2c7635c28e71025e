"""A frame of three storeys with two dampers, calibrated: for tests of what is stored and of the loop."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.control.calibration import CalibrationOptions, balanced_weights
from mrpipe.control.lqg import Weights
from mrpipe.control.placed import PlacedCalibration, calibrate_placed, modes_together
from mrpipe.control.placed_storage import damper_as_json, placed_dampers, together_as_json, write_placed
from mrpipe.control.together import TogetherDamping
from mrpipe.structures import shear_frame, write_frame
from mrpipe.structures.options import StructureSettings

FRAME = shear_frame([25.0] * 3, [3.0e4] * 3, np.full(3, 0.01), name="three storeys", source="test")
AMPLITUDE_M, RESIDUAL_N = 0.01, 18.0


def structure(*dampers: dict[str, Any], **more: Any) -> StructureSettings:
    """Return the settings of the frame with these dampers."""
    return StructureSettings(dampers=dampers, **more)


TWO = structure(
    {"between": (1, "ground"), "law": "vd", "name": "low", "brace_stiffness_n_m": 4.0e5},
    {"between": (3, 2), "law": "fdns"},
)


def calibrated(settings: StructureSettings = TWO) -> list[PlacedCalibration]:
    """Return the calibrated dampers of these settings, computed once."""
    return _computed(settings.model_dump_json())[0]


@functools.cache
def _computed(settings: str) -> tuple[list[PlacedCalibration], list[Weights], TogetherDamping]:
    dampers = StructureSettings.model_validate_json(settings).dampers
    found = calibrate_placed(FRAME, placed_dampers(FRAME, dampers, 1), CalibrationOptions())
    weights = [balanced_weights(FRAME, item.damper.position, item.modes, RESIDUAL_N) for item in found]
    return found, weights, modes_together(FRAME, found, [1, 2])


def write_artifacts(folder: Path, settings: StructureSettings = TWO) -> dict[str, Artifact]:
    """Write frame.h5 and control.h5 as the stages do and return stage -> artifact."""
    found, weights, damping = _computed(settings.model_dump_json())
    rows = [damper_as_json(item, AMPLITUDE_M, RESIDUAL_N, 0.01) for item in found]
    together = together_as_json(FRAME, damping, [1, 2])
    with ArtifactWriter.create(folder / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, FRAME)
    with ArtifactWriter.create(folder / "control.h5", Provenance("calibrate")) as artifact:
        write_placed(artifact, found, weights, {"dampers": rows, "together": together})
    return {"identify-frame": Artifact(folder / "frame.h5"), "calibrate": Artifact(folder / "control.h5")}
