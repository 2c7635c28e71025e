"""Least-squares complex frequency estimator with transient terms: poles without a first guess."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrpipe.artifacts import FloatArray
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum


@dataclass(frozen=True)
class PoleCandidate:
    """A pole that keeps its place as the model order grows.

    Attributes
    ----------
    angular_frequency
        |s| [rad/s].
    damping_ratio
        [1].
    occurrences
        In how many model orders it was found.
    """

    angular_frequency: float
    damping_ratio: float
    occurrences: int


def _stack(matrix: ComplexArray) -> FloatArray:
    return np.concatenate([matrix.real, matrix.imag], axis=0)


def _triangle(spectra: Sequence[RecordSpectrum], order: int, step: float, output: int) -> FloatArray:
    """Return R of A(z) Y = B(z) U + T(z) for one output at the highest order: columns of B, of T a test, of A.

    T(z) takes up what the record holds of its beginning and end (no window, no leakage error); each test has its own.
    """
    powers = np.arange(order + 1)
    rows, left = [], []
    width = (order + 1) * (1 + len(spectra))
    for index, item in enumerate(spectra):
        z = np.exp(-1j * np.outer(item.omega * step, powers))
        scale = np.linalg.norm(item.responses[:, output]) or 1.0
        block = np.zeros((item.omega.size, width), dtype=np.complex128)
        block[:, : order + 1] = z * (item.excitation / (np.linalg.norm(item.excitation) or 1.0))[:, None]
        start = (order + 1) * (1 + index)
        block[:, start : start + order + 1] = z / np.sqrt(item.omega.size)
        left.append(_stack(block))
        rows.append(_stack(z * (item.responses[:, output] / scale)[:, None]))
    return np.asarray(np.linalg.qr(np.hstack([np.vstack(left), np.vstack(rows)]), mode="r"), dtype=np.float64)


def _reduced(triangle: FloatArray, highest: int, order: int) -> FloatArray:
    """Return the part that the denominator of a lower order alone must explain.

    Lower orders take some columns of the highest one, and R of some columns of a matrix is R of those columns of its R:
    the data are factored once for all orders.
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
        Upper end of the band; it is put at 0.95 pi of the unit circle.
    """
    step = 0.95 * np.pi / high_rad_s
    highest = max(orders)
    triangles = [_triangle(spectra, highest, step, output) for output in range(spectra[0].responses.shape[1])]
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
    spectra: Sequence[RecordSpectrum],
    orders: Sequence[int],
    band_rad_s: tuple[float, float],
    *,
    largest_damping_ratio: float = 0.2,
    frequency_tolerance: float = 0.003,
) -> list[PoleCandidate]:
    """Return the poles that appear at several orders (the stabilisation diagram, as a list), lowest first.

    Parameters
    ----------
    spectra, orders
        Data and the model orders to try.
    band_rad_s
        Poles outside are dropped.
    largest_damping_ratio, frequency_tolerance
        What counts as physical, and as the same pole.
    """
    found: list[tuple[float, float, int]] = []
    for order, poles in zip(orders, lscf_poles(spectra, orders, band_rad_s[1]), strict=True):
        for pole in poles:
            omega, zeta = float(abs(pole)), float(-pole.real / abs(pole))
            if 0.0 < zeta < largest_damping_ratio and band_rad_s[0] <= omega <= band_rad_s[1]:
                found.append((omega, zeta, order))
    found.sort()
    groups: list[list[tuple[float, float, int]]] = []
    for item in found:
        if groups and item[0] - np.median([g[0] for g in groups[-1]]) <= frequency_tolerance * item[0]:
            groups[-1].append(item)
        else:
            groups.append([item])
    return [
        PoleCandidate(
            float(np.median([g[0] for g in group])),
            float(np.median([g[1] for g in group])),
            len({g[2] for g in group}),
        )
        for group in groups
    ]
