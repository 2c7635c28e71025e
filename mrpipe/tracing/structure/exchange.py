"""Two floors whose accelerometers have been exchanged in all tests.

A linear frame of any stiffness fits such records as well as the correct ones: the accelerations are linear in the
displacements, whatever the order of the floors. The order is judged by two properties of a structure in which each
floor stands on the one below it, whether it shears or bends:

- In the lowest mode, the displacement grows from floor to floor.
- The motions of neighbouring floors are more similar than those of other floors, in all modes together.

The exchange of two floors is reported if both hold in every test after it, and the first one in no test before it.
"""

from __future__ import annotations

import itertools

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.tracing.structure.base import FrameProblem
from mrpipe.tracing.structure.sensor_faults import SensorFault, sensors_of
from mrpipe.tracing.structure.spectra import Spectra

ABOUT_PEAK = 0.1
"""Numerical technique: half width of the lines about a resonance that show the shape of its mode, as a share of its
frequency."""


def exchanged_floors(problem: FrameProblem) -> SensorFault | None:
    """Return the two floors that have been exchanged in all tests; None if the order of the floors is plausible.

    Parameters
    ----------
    problem
        Spectra of the records.
    """
    if not problem.bends:
        return None
    least, records = problem.rules.same_gain, (*problem.training, *problem.validation)
    shapes = [shape_of_lowest_mode(item) for item in records]
    if any(grows(item, least) for item in shapes):
        return None
    floors = [floor for floor in sensors_of(records) if floor]
    orders = {pair: _order(problem.masses_kg.size, *pair) for pair in itertools.combinations(floors, 2)}
    orders = {pair: order for pair, order in orders.items() if all(grows(item[order], least) for item in shapes)}
    before = np.array([_roughness(item, np.arange(problem.masses_kg.size)) for item in records])
    after = {pair: np.array([_roughness(item, order) for item in records]) for pair, order in orders.items()}
    smoother = {pair: values for pair, values in after.items() if np.all(values < before)}
    if not smoother:
        return None
    best = min(smoother, key=lambda pair: float(np.sum(smoother[pair] / before)))
    return SensorFault(best[0], exchanged_with=best[1], explained=float(1.0 - np.mean(smoother[best] / before)))


def shape_of_lowest_mode(record: Spectra) -> FloatArray:
    """Return the displacements of the floors at the strongest resonance of a record over the largest one, shape (n,).

    The displacement of a structure is largest in its lowest mode.
    """
    moved = record.regressors[: record.record.floors]
    power = np.sum(np.abs(moved) ** 2, axis=0)
    peak = float(record.frequencies_hz[int(np.argmax(power))])
    own = moved[:, np.abs(record.frequencies_hz - peak) <= ABOUT_PEAK * peak]
    shape = np.linalg.svd(np.concatenate([own.real, own.imag], axis=1), full_matrices=False)[0][:, 0]
    return np.asarray(shape / shape[int(np.argmax(np.abs(shape)))])


def grows(shape: FloatArray, tolerance: float) -> bool:
    """Return whether the displacement of a mode shape grows from floor to floor.

    Parameters
    ----------
    shape
        Displacements of the floors, from the bottom up, shape (n,), with the largest one 1.
    tolerance
        Decrease from one floor to the next one that errors of the gains explain.
    """
    return bool(np.all(np.diff(shape, prepend=0.0) > -tolerance))


def _order(floors: int, first: int, second: int) -> IntArray:
    """Return the order of the floors, from 0, after the exchange of two of them, which count from 1."""
    order = np.arange(floors)
    order[[first - 1, second - 1]] = order[[second - 1, first - 1]]
    return order


def _roughness(record: Spectra, order: IntArray) -> float:
    """Return the mean square of the differences of the accelerations of neighbouring floors, over their mean square."""
    moved = record.regressors[: record.record.floors] * record.frequencies_hz**2
    differences = np.diff(moved[order], axis=0, prepend=0.0)
    return float(np.sum(np.abs(differences) ** 2) / np.sum(np.abs(moved) ** 2))
