"""Changes of the stiffness of a structure between tests: softening, loosening, wear.

The linear frame is fitted to all training tests together. The residual of a single test in phase with the restoring
forces is a change of stiffness in that test. A structure that softens with amplitude shows smaller stiffness in larger
tests; a structure that loosens shows smaller stiffness in later tests. Both are fitted to the changes, and the order of
the tests counts only where it predicts tests that were left out much better than the amplitude does.

Usually one storey loosens. Tests with different spectra weight the storeys differently, so that the change of all
storeys together scatters between tests. Each storey is therefore examined alone as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.fit import base_rows
from mrpipe.tracing.structure.model import FrameModel
from mrpipe.tracing.structure.spectra import Spectra
from mrpipe.words import in_percent

Kind = Literal["constant", "amplitude", "drift", "step"]

LEAST_TESTS = 4
"""Numerical technique: with fewer tests a trend over their order cannot be distinguished from scatter."""


@dataclass(frozen=True)
class TestStiffness:
    """Stiffness of one test relative to that of all tests together.

    Attributes
    ----------
    test
        Name.
    change
        Relative change of the stiffness [1]; the change of the frequencies is half of it.
    error
        Standard error of the change [1].
    drift_m
        RMS drift of the storey with the largest drift [m].
    """

    test: str
    change: float
    error: float
    drift_m: float


@dataclass(frozen=True)
class StiffnessBetweenTests:
    """Changes of stiffness of all tests, and the kind of change that explains them.

    Attributes
    ----------
    tests
        Tests in the order of the campaign.
    kind
        `constant`, `amplitude`, `drift` (steady change over the order of the tests) or `step`.
    change
        Change of the stiffness from the first to the last test by order alone [1]; 0 for the first two kinds.
    step_before
        Test before which the stiffness steps; empty for other kinds.
    storey
        Storey (from 1) whose stiffness this is; 0: that of all storeys together.
    """

    tests: tuple[TestStiffness, ...]
    kind: Kind
    change: float
    step_before: str = ""
    storey: int = 0

    @property
    def drifts(self) -> bool:
        """Whether the stiffness changes with the order of the tests."""
        return self.kind in ("drift", "step")

    def as_json(self) -> dict[str, Any]:
        """Return the keys of docs/close-loop-json.md."""
        return {
            "kind": self.kind,
            "stiffness_change": self.change,
            "step_before": self.step_before or None,
            "storey": self.storey or None,
            "tests": [
                {"name": item.test, "stiffness_change": item.change, "error": item.error, "rms_drift_m": item.drift_m}
                for item in self.tests
            ],
        }

    def sentence(self) -> str:
        """Return a sentence with the size of the change; empty if the stiffness does not drift."""
        if not self.drifts:
            return ""
        first, last = self.tests[0].test, self.tests[-1].test
        how = f"steps before test {self.step_before}" if self.kind == "step" else f"drifts from test {first} to {last}"
        change = in_percent(self.change, 1, signed=True)
        if self.storey:
            return f"the stiffness of storey {self.storey} {how} by {change}"
        return f"the stiffness {how} by {change} (frequencies {in_percent(0.5 * self.change, 1, signed=True)})"

    def finding(self) -> str:
        """Return one line with a remedy for the user; empty if the stiffness does not drift."""
        said = self.sentence()
        advice = "joints loosen or parts wear; check the bolts, and use tests of one state only"
        return f"{said}: {advice}" if said else ""


def _of_test(model: FrameModel, record: Spectra, storeys: Sequence[int]) -> TestStiffness:
    """Return the change of stiffness of some storeys in a test: least squares of the residual on restoring forces."""
    error = ((record.target - model.predict(record)) * record.weight)[list(storeys)]
    moved = record.record.floors if model.base == "linear-frame" else 1
    restoring = np.stack([model.linear[k][:moved] @ base_rows(model.base, record, k)[:moved] for k in storeys])
    restoring = restoring * record.weight[list(storeys)]
    power = max(float(np.sum(np.abs(restoring) ** 2)), 1e-300)
    change = float(np.sum(np.real(np.conj(restoring) * error))) / power
    left = np.real(np.conj(restoring) * (error - change * restoring))
    squares = float(np.sum(left**2))
    drift = float(np.std(record.motion.drift[list(storeys)], axis=1).max())
    return TestStiffness(record.record.name, change, float(np.sqrt(squares)) / power, drift)


def stiffness_between_tests(
    model: FrameModel, records: Sequence[Spectra], rules: FrameRules | None = None
) -> StiffnessBetweenTests:
    """Return the stiffness of each test and whether it changes with their order.

    Parameters
    ----------
    model
        Linear frame (with declared effects) fitted to the training tests.
    records
        Spectra of all tests, in the order in which they were made.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or FrameRules()
    count = len(model.linear)

    def of(storeys: Sequence[int], number: int) -> StiffnessBetweenTests:
        tests = tuple(_of_test(model, record, storeys) for record in records)
        return StiffnessBetweenTests(tests, *_explained(tests, rules), number)

    together = of(range(count), 0)
    alone = [item for item in (of([k], k + 1) for k in range(count)) if item.drifts]
    if not alone or (together.drifts and len(alone) > 1):
        return together
    return max(alone, key=lambda item: abs(item.change))


def _explained(tests: Sequence[TestStiffness], rules: FrameRules) -> tuple[Kind, float, str]:
    count = len(tests)
    if count < LEAST_TESTS:
        return "constant", 0.0, ""
    values = np.array([item.change for item in tests])
    # clocks and gains differ between tests by at least the floor of the model, whatever the noise
    weights = 1.0 / np.hypot([item.error for item in tests], rules.model_floor)
    order = np.linspace(-0.5, 0.5, count)
    drifts = np.array([item.drift_m for item in tests])
    ones = np.ones(count)
    plain: dict[Kind, list[FloatArray]] = {"constant": [ones], "amplitude": [ones, _centred(sizes_of(drifts)[0])]}
    without = {"constant": _left_out(plain["constant"], values, weights), "amplitude": np.inf}
    for sizes in sizes_of(drifts):
        columns = [ones, _centred(sizes)]
        if (error := _left_out(columns, values, weights)) < without["amplitude"]:
            plain["amplitude"], without["amplitude"] = columns, error
    kind: Kind = "amplitude" if without["amplitude"] < without["constant"] else "constant"
    steady = [*plain[kind], order]
    stepped = [*plain[kind], _best_step(plain[kind], values, weights)]
    errors = {"drift": _left_out(steady, values, weights), "step": _left_out(stepped, values, weights)}
    # the position of the step was chosen with all tests, so a step must be much better than a steady drift
    best: Kind = "step" if errors["step"] < rules.better_drift * errors["drift"] else "drift"
    columns = stepped if best == "step" else steady
    change, error = _last_coefficient(columns, values, weights)
    matters = abs(change) > rules.least_drift and abs(change) > rules.drift_errors * error
    if not matters or errors[best] > rules.better_drift * without[kind]:
        return kind, 0.0, ""
    return best, change, tests[int(np.argmax(columns[-1]))].test if best == "step" else ""


def sizes_of(drifts: FloatArray) -> tuple[FloatArray, ...]:
    """Return the functions of the RMS drift of the tests, shape (tests,), with which the stiffness may change.

    The logarithm stands for friction and slip, which act at small drifts; the square for a cubic stiffness.
    """
    relative = drifts / max(float(drifts.max()), 1e-300)
    return np.log(np.maximum(relative, 1e-12)), relative**2


def _centred(values: FloatArray) -> FloatArray:
    return np.asarray((values - values.mean()) / max(float(np.ptp(values)), 1e-12))


def _best_step(base: Sequence[FloatArray], values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the best step over the order of the tests, as regressor: 0 before the step and 1 after it."""
    count = values.size
    steps = [(np.arange(count) >= place).astype(np.float64) for place in range(1, count)]
    costs = []
    for step in steps:
        columns = np.column_stack([*base, step]) * weights[:, None]
        rest = values * weights - columns @ np.linalg.lstsq(columns, values * weights, rcond=None)[0]
        costs.append(float(rest @ rest))
    return steps[int(np.argmin(costs))]


def _left_out(columns: Sequence[FloatArray], values: FloatArray, weights: FloatArray) -> float:
    """Return the weighted sum of squared errors of each test by a fit to the other tests."""
    matrix, total = np.column_stack(columns), 0.0
    for index in range(values.size):
        kept = weights.copy()
        kept[index] = 0.0
        numbers = np.linalg.lstsq(matrix * kept[:, None], values * kept, rcond=None)[0]
        total += float(((values[index] - matrix[index] @ numbers) * weights[index]) ** 2)
    return total


def _last_coefficient(columns: Sequence[FloatArray], values: FloatArray, weights: FloatArray) -> tuple[float, float]:
    """Return the coefficient of the last column and its standard error from the scatter of the tests."""
    matrix = np.column_stack(columns) * weights[:, None]
    numbers = np.linalg.lstsq(matrix, values * weights, rcond=None)[0]
    rest = values * weights - matrix @ numbers
    variance = float(rest @ rest) / max(values.size - matrix.shape[1], 1)
    covariance = np.linalg.pinv(matrix.T @ matrix) * max(variance, 1.0)
    return float(numbers[-1]), float(np.sqrt(covariance[-1, -1]))
