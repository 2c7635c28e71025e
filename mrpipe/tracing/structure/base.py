"""From recordings to spectra with the right band and weights, and the ladder of linear frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.structure.fit import Base, Design, base_rows, coefficients, design_of, stacked
from mrpipe.tracing.structure.records import FrameRecord
from mrpipe.tracing.structure.spectra import Band, Spectra, motion_of, noise_of, spectra_of, storey_sums

HIGH_SHARE, LOW_SHARE = 1.3, 0.45
"""Band over the highest and the lowest mode."""

COUPLING_SHARE = 0.05
"""Couplings of a storey to floors that are not its own are sought within about this share of its stiffness."""


@dataclass(frozen=True)
class FrameProblem:
    """Spectra of training and validation records, and what is known of the structure.

    Attributes
    ----------
    storey_stiffness
        Of the shear frame fitted first, shape (n,) [N/m].
    frequencies_hz
        Its modes.
    training
        Spectra of the training records.
    validation
        Spectra of the validation records.
    masses_kg
        Floor masses, shape (n,).
    band
        Frequencies in use.
    """

    training: tuple[Spectra, ...]
    validation: tuple[Spectra, ...]
    masses_kg: FloatArray
    band: Band
    storey_stiffness: FloatArray
    frequencies_hz: FloatArray


def frame_problem(
    training: Sequence[FrameRecord], validation: Sequence[FrameRecord], masses: FloatArray
) -> FrameProblem:
    """Find band and weights by fitting a shear frame twice, and return the spectra of all records."""
    n = len(masses)
    band = _band_of_power(training)
    storey = np.full(n, float(np.mean(masses)) * (2.0 * np.pi * np.sqrt(band.low_hz * band.high_hz)) ** 2)
    frequencies = np.zeros(n)
    # band and weights need few records only: the shortest that are forced
    few = _few(training)
    for _ in range(3):
        spectra = _spectra(few, masses, band, _matrix(storey))
        storey, frequencies = shear_stiffness_of(design_of("shear-frame", spectra), masses)
        limits = [0.4 * item.rate_hz for item in training]
        band = Band(LOW_SHARE * float(frequencies[0]), min(HIGH_SHARE * float(frequencies[-1]), *limits))
    stiffness = coupled_stiffness(_spectra(few, masses, band, _matrix(storey)), _matrix(storey))
    found, held = (tuple(_spectra(items, masses, band, stiffness)) for items in (training, validation))
    return FrameProblem(found, held, masses, band, storey, frequencies)


def _spectra(records: Sequence[FrameRecord], masses: FloatArray, band: Band, stiffness: FloatArray) -> list[Spectra]:
    found = []
    for item in records:
        noise = noise_of(item, band)
        found.append(spectra_of(item, masses, band, noise, stiffness, motion_of(item, band, noise)))
    return found


def _few(records: Sequence[FrameRecord], most: int = 3) -> list[FrameRecord]:
    forced = [item for item in records if item.kind in ("sweep", "random")]
    return sorted(forced or records, key=lambda item: len(item.ground))[:most]


def _matrix(storey: FloatArray) -> FloatArray:
    """Return the shear of each storey per floor displacement, shape (n, n)."""
    n = len(storey)
    return np.asarray(storey[:, None] * (np.eye(n) - np.eye(n, k=-1)))


def coupled_stiffness(spectra: Sequence[Spectra], sheared: FloatArray) -> FloatArray:
    """Return the shear of each storey per floor displacement of any linear frame, shape (n, n) [N/m].

    Floors without a laser are known far worse at low frequencies than those with one: where a storey feels them, be it
    little, their noise rules its equation. Couplings that the records hardly tell are held near those of a shear frame.

    Parameters
    ----------
    sheared
        Of the shear frame, shape (n, n) [N/m].
    spectra
        Spectra of the records.
    """
    n = len(sheared)
    found = sheared.copy()
    for storey in range(n):
        rows = [stacked(base_rows("linear-frame", item, storey) * item.weight[storey]) for item in spectra]
        width = max(len(item) for item in rows)
        regressors = np.concatenate([np.pad(item, ((0, width - len(item)), (0, 0))) for item in rows], axis=1)
        target = np.concatenate([stacked(item.target[storey] * item.weight[storey]) for item in spectra])
        left = target + sheared[storey] @ regressors[:n]
        prior = np.zeros((width, width))
        prior[:n, :n] = np.eye(n) / (COUPLING_SHARE * sheared[storey, storey])
        scale = np.linalg.norm(regressors, axis=1)
        prior[np.arange(n, width), np.arange(n, width)] = 1e-6 * scale[n:]
        equations = np.concatenate([regressors, prior], axis=1).T
        numbers = np.linalg.lstsq(equations, np.concatenate([left, np.zeros(width)]), rcond=None)[0]
        found[storey] -= numbers[:n]
    return found


def _band_of_power(records: Sequence[FrameRecord]) -> Band:
    """Return where the floors' motion lies."""
    lowest, highest = [], []
    for item in records:
        frequencies, density = signal.welch(
            item.acceleration - np.mean(item.acceleration, axis=0),
            item.rate_hz,
            nperseg=min(len(item.ground), 4096),
            axis=0,
        )
        power = density.sum(axis=1)
        # noise of sensors is flat: only what stands out of it counts
        power = np.maximum(power - 3.0 * np.median(power[len(power) // 2 :]), 0.0)
        share = np.cumsum(power) / max(float(power.sum()), 1e-300)
        lowest.append(float(frequencies[max(1, int(np.searchsorted(share, 0.002)))]))
        highest.append(float(frequencies[min(len(share) - 1, int(np.searchsorted(share, 0.998)))]))
    low, high = max(0.5 * min(lowest), 0.02), max(highest)
    return Band(low, min(max(1.3 * high, 4.0 * low), 0.4 * min(item.rate_hz for item in records)))


def shear_stiffness_of(design: Design, masses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return storey stiffnesses [N/m] of a fitted shear frame and its natural frequencies [Hz], shape (n,) each."""
    linear = coefficients(design, None, np.zeros(0))
    storey = np.array([-numbers[0] for numbers in linear])
    positive = storey[storey > 0.0]
    storey = np.where(storey > 0.0, storey, float(np.median(positive)) if positive.size else 1.0)
    K = storey_sums(len(masses))
    stiffness = np.linalg.inv(K) @ _matrix(storey)
    squared = np.linalg.eigvals(stiffness / masses[:, None])
    return storey, np.sort(np.sqrt(np.abs(np.real(squared)))) / (2.0 * np.pi)


def ladder(spectra: Sequence[Spectra]) -> dict[Base, Design]:
    """Return the linear models from simple to free."""
    return {"shear-frame": design_of("shear-frame", spectra), "linear-frame": design_of("linear-frame", spectra)}
