"""Validation tests that differ from the training tests, because only their error is far above the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.structure.base import FrameProblem
from mrpipe.tracing.structure.fault_search import fault_in_record
from mrpipe.tracing.structure.model import FrameModel
from mrpipe.tracing.structure.scores import frame_score, noise_floor
from mrpipe.tracing.structure.sensor_faults import SensorFault, repaired
from mrpipe.tracing.structure.spectra import Spectra
from mrpipe.words import listed


@dataclass(frozen=True)
class DifferingTest:
    """A validation test that the frame predicts much worse than the training tests.

    Attributes
    ----------
    name
        The test.
    floors
        Error over the noise floor of the test [1].
    drift_ratio
        Largest RMS drift of a storey over the largest one in the training tests [1].
    fault
        Fault of a sensor that explains the difference; None if none does.
    """

    name: str
    floors: float
    drift_ratio: float
    fault: SensorFault | None

    def as_json(self) -> dict[str, Any]:
        """Return the keys of docs/close-loop-json.md."""
        return {
            "name": self.name,
            "error_over_noise_floor": self.floors,
            "drift_over_training": self.drift_ratio,
            "sensor_fault": self.fault.as_json() if self.fault else None,
        }

    def sentence(self) -> str:
        """Return how the test differs."""
        error = f"the error of validation test {self.name} is {self.floors:.3g} times the noise"
        if self.fault:
            return f"{error}, because {self.fault.sentence()}"
        if self.drift_ratio > 1.0:
            return f"{error}, and its drift is {self.drift_ratio:.3g} times that of the training tests"
        return f"{error}, and no fault of a single sensor explains it"


def differing_tests(
    model: FrameModel, problem: FrameProblem, scale: FloatArray, floors: float
) -> tuple[DifferingTest, ...]:
    """Return the validation tests whose error exceeds a multiple of the noise, and of the error of training tests.

    Parameters
    ----------
    model
        Frame with its effects, fitted to the training records.
    problem
        Spectra of the records.
    scale
        Mean square of the noise of each storey, shape (n,).
    floors
        Multiple of the noise floor, and of the error of the training tests, that the error exceeds.
    """
    own = {item.record.name for item in problem.training}
    least = floors * max(1.0, *(_error_over_noise(model, item, scale) for item in problem.training))
    largest = max(_drift(item) for item in problem.training)
    found = []
    for item in problem.validation:
        ratio = _error_over_noise(model, item, scale)
        if item.record.name in own or ratio <= least:
            continue
        fault = fault_in_record(model.base, model.linear, item, model.predict(item), problem.masses_kg)
        # noise and displacement of the record were estimated with the faulty sensor
        again = _error_over_noise(model, problem.spectra_of(repaired(item.record, fault)), scale)
        found.append(DifferingTest(item.record.name, ratio, _drift(item) / largest, fault if again <= least else None))
    return tuple(found)


def in_words(tests: Sequence[DifferingTest]) -> str:
    """Return one sentence on all differing tests."""
    return listed([item.sentence() for item in tests])


def _error_over_noise(model: FrameModel, record: Spectra, scale: FloatArray) -> float:
    return frame_score(model, [record]).nrmse / max(noise_floor([record], scale), 1e-300)


def _drift(record: Spectra) -> float:
    return float(np.std(record.motion.drift, axis=1).max())
