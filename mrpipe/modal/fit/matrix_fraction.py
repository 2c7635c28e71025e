"""Poles of a matrix-fraction model: the denominator is a matrix, so that close modes differ by their shapes.

A common denominator (:mod:`mrpipe.modal.fit.lscf`) takes two modes for one if their half-power bandwidths overlap. With
sensors in several directions such modes are frequent, because a nearly symmetric building has two bending modes and a
torsion mode close to each other. The model is A(z) Y = sum B_k(z) U_k + T(z), where Y has all sensors, A is a square
matrix polynomial in z = exp(-i omega step), and T represents the initial and final state of each record (Pintelon and
Schoukens 2012, System Identification: A Frequency Domain Approach, chapter 9).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.lscf import Occurrence, PoleCandidate, candidate_of, groups_of_poles
from mrpipe.modal.fit.projection import stack
from mrpipe.modal.records import Place, Sensor
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum, all_inputs, all_sensors

_ORDERS = 9
_EQUATIONS_PER_COEFFICIENT = 2.0
"""Least number of equations for each coefficient of an output."""


def common_sensors(spectra: Sequence[RecordSpectrum]) -> list[Sensor]:
    """Return the sensors that all records have."""
    return [sensor for sensor in all_sensors(spectra) if all(sensor in item.sensors for item in spectra)]


def matrix_orders(spectra: Sequence[RecordSpectrum], modes: int) -> range:
    """Return up to nine orders of the matrix polynomial; the lowest has at least one pair of poles for each mode.

    The range is empty, or shorter, where the records have fewer than two common sensors, or too few lines for so many
    coefficients.
    """
    outputs = len(common_sensors(spectra))
    if outputs < 2:
        return range(0)
    least = max(2, -(-2 * modes // outputs) + 1)
    free = len(all_inputs(spectra)) + len(spectra)
    equations = 2 * sum(item.omega.size for item in spectra)
    most = int((equations / _EQUATIONS_PER_COEFFICIENT - free) / (outputs + free))
    return range(least, min(least + _ORDERS, most + 1))


def stable_matrix_poles(
    spectra: Sequence[RecordSpectrum], orders: Sequence[int], band_rad_s: tuple[float, float]
) -> list[PoleCandidate]:
    """Return the poles that appear at several orders of the matrix polynomial, lowest first.

    Parameters
    ----------
    spectra
        Whole-record spectra of forced tests.
    orders
        Orders to try, see :func:`matrix_orders`.
    band_rad_s
        Poles outside are dropped; the upper end corresponds to 0.95 pi on the unit circle.
    """
    found = zip(orders, matrix_fraction_poles(spectra, orders, band_rad_s[1]), strict=True)
    return [candidate_of(part) for group in groups_of_poles(found, band_rad_s) for part in _divided(group)]


def _divided(group: Sequence[Occurrence]) -> list[list[Occurrence]]:
    """Return the poles of a group in order of frequency: several where most orders have as many."""
    by_order: dict[int, list[Occurrence]] = {}
    for item in sorted(group):
        by_order.setdefault(item[2], []).append(item)
    ((count, _),) = Counter(map(len, by_order.values())).most_common(1)
    if count == 1:
        return [list(group)]
    whole = [items for items in by_order.values() if len(items) == count]
    return [[items[rank] for items in whole] for rank in range(count)]


def matrix_fraction_poles(
    spectra: Sequence[RecordSpectrum], orders: Sequence[int], high_rad_s: float
) -> list[NDArray[np.complex128]]:
    """Return, for each order of the matrix polynomial, the poles [rad/s] with positive imaginary part.

    Parameters
    ----------
    spectra
        Whole-record spectra of forced tests; their common sensors are used.
    orders
        Orders of A in z. An order has as many poles as order times sensors.
    high_rad_s
        Upper end of the band [rad/s].
    """
    sensors, inputs = common_sensors(spectra), all_inputs(spectra)
    step, highest, outputs = 0.95 * np.pi / high_rad_s, max(orders), len(sensors)
    factor = _triangle(spectra, sensors, inputs, step, highest)
    width = factor.shape[1] - outputs
    free = len(inputs) + len(spectra)
    found = []
    for order in orders:
        # the columns are in order of their powers of z, so that a lower order has the first ones
        columns = free + order * (outputs + free)
        solution = np.linalg.lstsq(factor[:columns, :columns], -factor[:columns, width:], rcond=1e-12)[0]
        companion = np.eye(order * outputs, k=-outputs)
        for power in range(order):
            first = free + power * (outputs + free)
            companion[:outputs, power * outputs : (power + 1) * outputs] = -solution[first : first + outputs].T
        values = np.linalg.eigvals(companion).astype(np.complex128)
        poles = np.log(values[np.abs(values) > 0.0]) / step
        found.append(np.asarray(poles[poles.imag > 0.0], dtype=np.complex128))
    return found


def _triangle(
    spectra: Sequence[RecordSpectrum], sensors: Sequence[Sensor], inputs: Sequence[Place], step: float, highest: int
) -> FloatArray:
    """Return R of the regression: columns of B and T at z^0, of A, B and T at z^1, z^2, ..., and of the outputs."""
    responses = [item.responses[:, [item.sensors.index(sensor) for sensor in sensors]] for item in spectra]
    excitations = [item.input_columns(inputs) for item in spectra]
    response_size, excitation_size = _sizes(responses), _sizes(excitations)
    rows = []
    for index, (item, response, excitation) in enumerate(zip(spectra, responses, excitations, strict=True)):
        transient = np.zeros((item.omega.size, len(spectra)), dtype=np.complex128)
        transient[:, index] = 1.0 / np.sqrt(item.omega.size)
        right = np.hstack([excitation / excitation_size, transient])
        both = np.hstack([response / response_size, right])
        delays = [both * np.exp(-1j * power * step * item.omega)[:, None] for power in range(1, highest + 1)]
        rows.append(stack(np.hstack([right, *delays, response / response_size])))
    return np.asarray(np.linalg.qr(np.vstack(rows), mode="r"), dtype=np.float64)


def _sizes(columns: Sequence[ComplexArray]) -> FloatArray:
    """Return the norm of each column over all records, shape (columns,)."""
    size = np.sqrt(np.sum([np.sum(np.abs(item) ** 2, axis=0) for item in columns], axis=0))
    return np.where(size > 0.0, size, 1.0)
