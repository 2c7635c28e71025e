"""Least-squares complex frequency estimator (LSCF) with transient terms, for several inputs and outputs together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.projection import stack
from mrpipe.modal.records import Place, Sensor
from mrpipe.modal.spectra import RecordSpectrum, all_inputs, all_sensors

_LARGEST_DAMPING = 0.2
"""Largest damping ratio of a physical pole."""
_SAME_POLE = 0.003
"""Relative difference of the frequencies of the same pole at two orders."""


@dataclass(frozen=True)
class PoleCandidate:
    """A pole that is stable over the model orders.

    Attributes
    ----------
    angular_frequency
        |s| [rad/s].
    damping_ratio
        [1].
    occurrences
        Number of model orders in which it was found.
    """

    angular_frequency: float
    damping_ratio: float
    occurrences: int


def _triangle(
    spectra: Sequence[RecordSpectrum], order: int, step: float, sensor: Sensor, inputs: Sequence[Place]
) -> FloatArray:
    """Return R of A(z) Y = sum B_k(z) U_k + T(z) for one output at the highest order: columns of B, of T, of A.

    T(z) represents the initial and final state of each record, so that no window is needed and no leakage remains.
    """
    powers = np.arange(order + 1)
    rows, left = [], []
    own = [item for item in spectra if sensor in item.sensors]
    width = (order + 1) * (len(inputs) + len(own))
    for index, item in enumerate(own):
        z = np.exp(-1j * np.outer(item.omega * step, powers))
        response = item.responses[:, item.sensors.index(sensor)]
        block = np.zeros((item.omega.size, width), dtype=np.complex128)
        for number, excitation in enumerate(item.input_columns(inputs).T):
            part = slice(number * (order + 1), (number + 1) * (order + 1))
            block[:, part] = z * (excitation / (np.linalg.norm(excitation) or 1.0))[:, None]
        start = (order + 1) * (len(inputs) + index)
        block[:, start : start + order + 1] = z / np.sqrt(item.omega.size)
        left.append(stack(block))
        rows.append(stack(z * (response / (np.linalg.norm(response) or 1.0))[:, None]))
    return np.asarray(np.linalg.qr(np.hstack([np.vstack(left), np.vstack(rows)]), mode="r"), dtype=np.float64)


def _reduced(triangle: FloatArray, highest: int, order: int) -> FloatArray:
    """Return the part that the denominator alone must explain for a lower order.

    A lower order uses a subset of the columns of the highest order. The R factor of a subset of columns follows from
    the R factor of all columns, so the data are factored once for all orders.
    """
    blocks = triangle.shape[1] // (highest + 1)
    columns = np.concatenate([block * (highest + 1) + np.arange(order + 1) for block in range(blocks)])
    lower = np.asarray(np.linalg.qr(triangle[:, columns], mode="r"), dtype=np.float64)
    width = (order + 1) * (blocks - 1)
    return lower[width:, width:]


def lscf_poles(
    spectra: Sequence[RecordSpectrum], orders: Sequence[int], high_rad_s: float
) -> list[NDArray[np.complex128]]:
    """Return, for each order, the poles [rad/s] with positive imaginary part of a common-denominator model.

    Parameters
    ----------
    spectra
        Whole-record spectra of forced tests.
    orders
        Orders of the denominator in z = exp(-i omega step).
    high_rad_s
        Upper end of the band [rad/s]; it corresponds to 0.95 pi on the unit circle.
    """
    step = 0.95 * np.pi / high_rad_s
    highest = max(orders)
    inputs, sensors = all_inputs(spectra), all_sensors(spectra)
    triangles = [_triangle(spectra, highest, step, sensor, inputs) for sensor in sensors]
    found = []
    for order in orders:
        stacked = np.vstack([_reduced(triangle, highest, order) for triangle in triangles])
        # fixing the constant coefficient at one separates physical (stable) from numerical (unstable) poles
        coefficients = np.linalg.lstsq(stacked[:, 1:], -stacked[:, 0], rcond=None)[0]
        roots = np.roots(np.concatenate([coefficients[::-1], [1.0]]))
        poles = -np.log(roots[np.abs(roots) > 0.0]) / step
        found.append(np.asarray(poles[(poles.imag > 0.0)], dtype=np.complex128))
    return found


def stable_poles(
    spectra: Sequence[RecordSpectrum], orders: Sequence[int], band_rad_s: tuple[float, float]
) -> list[PoleCandidate]:
    """Return the poles that appear at several orders (the stabilisation diagram, as a list), lowest first.

    Parameters
    ----------
    spectra, orders
        Data and the model orders to try.
    band_rad_s
        Poles outside are dropped.
    """
    found = zip(orders, lscf_poles(spectra, orders, band_rad_s[1]), strict=True)
    return [candidate_of(group) for group in groups_of_poles(found, band_rad_s)]


Occurrence = tuple[float, float, int]
"""Angular frequency [rad/s], damping ratio and model order of a pole."""


def groups_of_poles(
    found: Iterable[tuple[int, NDArray[np.complex128]]], band_rad_s: tuple[float, float]
) -> list[list[Occurrence]]:
    """Return the poles of all orders with nearly the same frequency as one group, lowest first.

    Parameters
    ----------
    found
        Model orders and their poles [rad/s].
    band_rad_s
        Poles outside are dropped, and so are those that are unstable or heavily damped.
    """
    every: list[Occurrence] = []
    for order, poles in found:
        for pole in poles:
            omega, zeta = float(abs(pole)), float(-pole.real / abs(pole))
            if 0.0 < zeta < _LARGEST_DAMPING and band_rad_s[0] <= omega <= band_rad_s[1]:
                every.append((omega, zeta, order))
    groups: list[list[Occurrence]] = []
    for item in sorted(every):
        if groups and item[0] - np.median([g[0] for g in groups[-1]]) <= _SAME_POLE * item[0]:
            groups[-1].append(item)
        else:
            groups.append([item])
    return groups


def candidate_of(group: Sequence[Occurrence]) -> PoleCandidate:
    """Return the pole of a group: medians over the model orders."""
    return PoleCandidate(
        float(np.median([item[0] for item in group])),
        float(np.median([item[1] for item in group])),
        len({item[2] for item in group}),
    )
