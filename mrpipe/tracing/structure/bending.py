"""Band, weights and noise of a structure that is not a shear frame, from the linear frame that its records show.

In a structure that bends, such as a wall, a storey's shear force depends on the displacements of all floors, and its
higher modes are much faster than those of a shear frame with the same lowest mode. Band and weights therefore follow
from the general linear frame, which is fitted repeatedly, each time with the weights of the previous fit. Modes beyond
the band act through the ground acceleration (quasi-static response); its coefficients are part of the frame.

Above the band such a structure still moves, so the noise of a sensor cannot be measured there. It is bounded by the
residual: the noise of each sensor enters the equation of each storey with a known gain, and cannot exceed the residual
of any of them in any part of the band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.coordinates import Band, Weighting
from mrpipe.tracing.structure.fit import Design, design_of
from mrpipe.tracing.structure.records import FrameRecord
from mrpipe.tracing.structure.sensor_noise import Noise, noise_of, shape_of
from mrpipe.tracing.structure.spectra import (
    Spectra,
    gains_of_floors,
    gains_of_ground,
    motion_of,
    reweighted,
    spectra_of,
    storey_sums,
)

BAND_PARTS = 6
"""Numerical technique: number of parts of the band, of equal ratio, in which residual and noise are compared."""

LEAST_LEVEL = 0.7
"""Numerical technique: the noise of a sensor is lowered if the residual allows less than this share of it, because the
smallest of many parts scatters below their mean."""

FEWEST_LINES = 12
"""Numerical technique: a part of the band with fewer lines does not bound the noise."""

ROUNDS = 3
"""Numerical technique: number of fits of the general linear frame, each with the weights of the one before."""


def weighting_of(design: Design) -> Weighting:
    """Return the coefficients of a fitted general linear frame by which the noise of the sensors is propagated."""
    n, turns = len(design.residual), design.spectra[0].record.turns
    linear = np.stack([numbers[: 2 * n + 2 + turns] for numbers in design.linear])
    return Weighting(-linear[:, :n], linear[:, 2 * n : 2 * n + 2], -linear[:, 2 * n + 2 :])


def natural_frequencies(weighting: Weighting, masses: FloatArray) -> FloatArray:
    """Return the natural frequencies of a linear frame, the lowest first, shape (n,) [Hz]; 0 for an unstable one."""
    stiffness = np.linalg.solve(storey_sums(len(masses)), weighting.stiffness)
    squared = np.linalg.eigvals(stiffness / masses[:, None])
    return np.sort(np.sqrt(np.maximum(np.real(squared), 0.0))) / (2.0 * np.pi)


def bounded(record: Spectra, noise: Noise, masses: FloatArray) -> Noise:
    """Return the noise of the sensors of a record, lowered where it exceeds the residual.

    A linear frame is fitted to the record alone. The mean square of its residual, in each storey and part of the band,
    is at least that of the noise of each sensor alone, propagated by the fitted frame.

    Parameters
    ----------
    record
        Spectra of the record; their weights determine the fit.
    noise
        Noise of the sensors that is bounded.
    masses
        Floor masses, shape (n,) [kg].
    """
    design = design_of("linear-frame", [record])
    weighting, frequencies = weighting_of(design), record.frequencies_hz
    lines = frequencies.size
    power = (design.residual[:, :lines] ** 2 + design.residual[:, lines:] ** 2) / record.weight**2
    floors = gains_of_floors(weighting, masses, frequencies, record.laser_share)
    ground = gains_of_ground(weighting, frequencies, record.laser_share)
    turns = np.repeat(weighting.turning[:, :, None], lines, axis=2) / (2.0 * np.pi * frequencies) ** 2
    gains = np.concatenate([ground[:, None], floors, turns], axis=1) ** 2
    gains *= shape_of(noise.colour, frequencies / noise.rate_hz)
    edges = np.geomspace(frequencies[0], frequencies[-1] * (1.0 + 1e-9), BAND_PARTS + 1)
    part = np.searchsorted(edges, frequencies, side="right") - 1
    densities = np.concatenate([noise.acceleration, noise.turning])
    most = np.full(densities.size, np.inf)
    for number in range(BAND_PARTS):
        own = part == number
        if np.count_nonzero(own) >= FEWEST_LINES:
            least = np.maximum(np.mean(gains[:, :, own], axis=2), 1e-300)
            most = np.minimum(most, np.min(np.mean(power[:, own], axis=1)[:, None] / least, axis=0))
    lower = np.where(most < LEAST_LEVEL * densities, most, densities)
    sensors = noise.acceleration.size
    return replace(noise, acceleration=lower[:sensors], turning=lower[sensors:])


def bounded_spectra(
    record: FrameRecord, masses: FloatArray, band: Band, weighting: Weighting, rules: FrameRules, colour: float
) -> Spectra:
    """Return the spectra of a record with noise that its residual allows.

    Parameters
    ----------
    record
        The record.
    masses
        Floor masses, shape (n,) [kg].
    band
        Frequencies in use.
    weighting
        Linear frame by which the noise is propagated.
    rules
        Decision thresholds.
    colour
        Colour of the noise of the accelerometers [1].
    """
    noise = noise_of(record, band.high_hz, rules, colour)
    spectra = spectra_of(record, masses, band, noise, weighting, motion_of(record, band, noise, rules), rules)
    return _with_bounds(spectra, noise, masses, band, weighting, rules)


def _with_bounds(
    spectra: Spectra, noise: Noise, masses: FloatArray, band: Band, weighting: Weighting, rules: FrameRules
) -> Spectra:
    # the fit by which the noise is bounded depends on the noise
    for _ in range(2):
        spectra = _with_noise(spectra, noise, masses, band, weighting, rules)
        noise = bounded(spectra, noise, masses)
    return _with_noise(spectra, noise, masses, band, weighting, rules)


def _with_noise(
    spectra: Spectra, noise: Noise, masses: FloatArray, band: Band, weighting: Weighting, rules: FrameRules
) -> Spectra:
    record = spectra.record
    if not record.measured_displacement:
        return reweighted(spectra, masses, noise, weighting, rules)
    # the motion combines both kinds of sensors according to their noise
    return spectra_of(record, masses, band, noise, weighting, motion_of(record, band, noise, rules), rules)


def fitted_weighting(
    records: Sequence[FrameRecord],
    masses: FloatArray,
    band: Band,
    start: Weighting,
    rules: FrameRules,
    colour: float,
) -> Weighting:
    """Return the general linear frame of some records, fitted with weights that follow from itself.

    Parameters
    ----------
    records
        The records.
    masses
        Floor masses, shape (n,) [kg].
    band
        Frequencies in use.
    start
        Linear frame of the first weights.
    rules
        Decision thresholds.
    colour
        Colour of the noise of the accelerometers [1].
    """
    noises = [noise_of(item, band.high_hz, rules, colour) for item in records]
    spectra = [
        spectra_of(item, masses, band, noise, start, motion_of(item, band, noise, rules), rules)
        for item, noise in zip(records, noises, strict=True)
    ]
    weighting = start
    for _ in range(ROUNDS):
        pairs = zip(spectra, noises, strict=True)
        spectra = [_with_bounds(item, noise, masses, band, weighting, rules) for item, noise in pairs]
        weighting = weighting_of(design_of("linear-frame", spectra))
    return weighting
