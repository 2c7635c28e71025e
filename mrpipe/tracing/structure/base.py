"""Band, weights and spectra of the records of a structure, and the linear frames that are compared with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.bending import bounded, bounded_spectra, fitted_weighting, natural_frequencies
from mrpipe.tracing.structure.coordinates import Band, Weighting
from mrpipe.tracing.structure.fit import Base, Design, base_rows, design_of, stacked
from mrpipe.tracing.structure.modes import ModalFrame, in_modes, modal_frame
from mrpipe.tracing.structure.records import FrameRecord
from mrpipe.tracing.structure.sensor_noise import Noise, noise_of, possible_colours
from mrpipe.tracing.structure.spectra import Spectra, motion_of, spectra_of, storey_sums

OF_RATE = 0.4
"""Numerical technique: highest frequency in use, as a share of the sampling rate, because of anti-alias filters."""

POWER_SHARE = 0.002
"""Numerical technique: share of the power beyond each edge of the band of the first fit."""

ABOVE_NOISE = 3.0
"""Numerical technique: power counts in the first band only if it exceeds the flat noise of the sensors by this factor.
"""

LEAST_LEVEL = 0.7
"""Numerical technique: the noise of a record is lowered if the residual is below this share of it."""

BAND_PARTS = 6
"""Numerical technique: number of parts of the band in which the residual is compared with the noise of a colour."""

START_MARGINS = (0.5, 1.3, 4.0)
"""Numerical technique: factors on the lowest and the highest frequency with power, and least ratio of the two. The band
that is used follows from the fitted modes."""


@dataclass(frozen=True)
class FrameProblem:
    """Spectra of training and validation records, and the linear shear frame fitted to them.

    Attributes
    ----------
    training
        Spectra of the training records.
    validation
        Spectra of the validation records.
    masses_kg
        Floor masses, shape (n,) [kg].
    band
        Frequencies in use.
    storey_stiffness
        Storey stiffness of the shear frame that is fitted first, shape (n,) [N/m].
    frequencies_hz
        Natural frequencies of this shear frame, shape (n,) [Hz].
    rules
        Decision thresholds.
    weighting, colour
        Linear frame, and colour of the sensors' noise [1]; the weights of the lines follow from them.
    bends
        Whether the records need the stiffness of a general linear frame; band, weights and noise then follow from it.
    modal
        Linear frame in the modes that the records determine; None if they determine the motion of all floors.
    """

    training: tuple[Spectra, ...]
    validation: tuple[Spectra, ...]
    masses_kg: FloatArray
    band: Band
    storey_stiffness: FloatArray
    frequencies_hz: FloatArray
    rules: FrameRules
    weighting: Weighting
    colour: float
    bends: bool = False
    modal: ModalFrame | None = None

    @cached_property
    def judged(self) -> tuple[Spectra, ...]:
        """Spectra of the training records in the equations in which effects are judged: of storeys, or of modes."""
        return self.in_equations(self.training)

    @cached_property
    def judged_validation(self) -> tuple[Spectra, ...]:
        """Spectra of the validation records in the equations in which effects are judged."""
        return self.in_equations(self.validation)

    def in_modes(self, training: Sequence[Spectra]) -> FrameProblem:
        """Return the problem with the modes that spectra of the training records determine."""
        if not self.bends:
            return self
        noises = [self._noise(item) for item in self.training]
        return replace(self, modal=modal_frame(training, noises, self.masses_kg, self.rules))

    def in_equations(self, spectra: tuple[Spectra, ...]) -> tuple[Spectra, ...]:
        """Return spectra in the equations in which effects are judged."""
        if self.modal is None:
            return spectra
        return tuple(in_modes(item, self._noise(item), self.modal, self.rules) for item in spectra)

    def _noise(self, item: Spectra) -> Noise:
        return bounded(item, noise_of(item.record, self.band.high_hz, self.rules, self.colour), self.masses_kg)

    def spectra_of(self, record: FrameRecord) -> Spectra:
        """Return the spectra of a further record, with the same band and weights."""
        return self.spectra([record])[0]

    def spectra(self, records: Sequence[FrameRecord]) -> tuple[Spectra, ...]:
        """Return the spectra of further records, with the same band and weights."""
        masses, band, weighting = self.masses_kg, self.band, self.weighting
        if self.bends:
            return tuple(bounded_spectra(item, masses, band, weighting, self.rules, self.colour) for item in records)
        return _with_levels(records, masses, band, weighting, self.rules, self.colour)


def frame_problem(
    training: Sequence[FrameRecord],
    validation: Sequence[FrameRecord],
    masses: FloatArray,
    rules: FrameRules | None = None,
) -> FrameProblem:
    """Find band and weights by fitting a shear frame three times, and return the spectra of all records.

    Parameters
    ----------
    training, validation
        Records that contain the motion of every floor.
    masses
        Floor masses, shape (n,) [kg].
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or FrameRules()
    n, turns = len(masses), training[0].turns
    band = _band_of_power(training)
    storey = np.full(n, float(np.mean(masses)) * (2.0 * np.pi * np.sqrt(band.low_hz * band.high_hz)) ** 2)
    frequencies = np.zeros(n)
    # few records are sufficient for band and weights: the shortest forced ones
    few = _few(training)
    limit = min(OF_RATE * item.rate_hz for item in training)
    for _ in range(3):
        spectra = _spectra(few, masses, band, _shear(storey, turns), rules)
        storey, frequencies = shear_stiffness_of(design_of("shear-frame", spectra), masses)
        band = Band(rules.band_below * float(frequencies[0]), min(rules.band_above * float(frequencies[-1]), limit))
    colour = _colour_of(few, band, lambda item: _spectra(few, masses, band, _shear(storey, turns), rules, item))
    few_spectra = _spectra(few, masses, band, _shear(storey, turns), rules, colour)
    stiffness = coupled_stiffness(few_spectra, _matrix(storey), rules.coupling)
    weighting = Weighting.of_displacements(stiffness, turns)
    sheared = FrameProblem((), (), masses, band, storey, frequencies, rules, weighting, colour)
    sheared = replace(sheared, training=sheared.spectra(training))
    found = _bending(sheared, training) if _bends(sheared) else sheared
    return replace(found, validation=found.spectra(validation))


def _bends(problem: FrameProblem) -> bool:
    """Return whether a general linear frame has a much smaller residual than a shear frame."""
    simple, free = (item.chi_square for item in ladder(problem.training).values())
    return bool(np.sqrt(simple) > (1.0 + problem.rules.of_floor) * np.sqrt(max(free, 1.0)))


def _bending(problem: FrameProblem, records: Sequence[FrameRecord]) -> FrameProblem:
    """Return the problem of a structure that is not a shear frame, with band and weights of a general linear frame.

    The modes are identified in the band that contains the power of the motion.
    """
    masses, rules = problem.masses_kg, problem.rules
    limit = min(OF_RATE * item.rate_hz for item in records)
    of_power = _band_of_power(records)
    whole = Band(problem.band.low_hz, min(max(of_power.high_hz, problem.band.high_hz), limit))
    weighting = fitted_weighting(records, masses, whole, problem.weighting, rules, 0.0)
    fastest = float(natural_frequencies(weighting, masses)[-1])
    band = Band(problem.band.low_hz, float(np.clip(rules.band_above * fastest, 2.0 * problem.band.low_hz, limit)))
    few = _few(records)
    colour = _colour_of(
        few, band, lambda item: [bounded_spectra(one, masses, band, weighting, rules, item) for one in few]
    )
    weighting = fitted_weighting(records, masses, band, weighting, rules, colour)
    found = replace(problem, band=band, weighting=weighting, colour=colour, bends=True)
    return replace(found, training=found.spectra(records))


def _spectra(
    records: Sequence[FrameRecord],
    masses: FloatArray,
    band: Band,
    weighting: Weighting,
    rules: FrameRules,
    colour: float = 0.0,
) -> list[Spectra]:
    noises = [noise_of(item, band.high_hz, rules, colour) for item in records]
    return [
        _spectra_of(item, masses, band, weighting, rules, noise) for item, noise in zip(records, noises, strict=True)
    ]


def _spectra_of(
    record: FrameRecord, masses: FloatArray, band: Band, weighting: Weighting, rules: FrameRules, noise: Noise
) -> Spectra:
    return spectra_of(record, masses, band, noise, weighting, motion_of(record, band, noise, rules), rules)


def _with_levels(
    records: Sequence[FrameRecord],
    masses: FloatArray,
    band: Band,
    weighting: Weighting,
    rules: FrameRules,
    colour: float,
) -> tuple[Spectra, ...]:
    """Return the spectra of records, with noise that does not exceed the residual of each record.

    Above the band there may be excitation as well as noise. In the band, noise cannot exceed the residual of a linear
    frame that is fitted to the record alone. The upper quartile over storeys and parts of the band is compared, so that
    the residual of an effect that acts at few storeys does not count as noise.
    """
    found = []
    for record in records:
        noise = noise_of(record, band.high_hz, rules, colour)
        spectra = _spectra_of(record, masses, band, weighting, rules, noise)
        level = float(np.quantile(_powers(design_of("linear-frame", [spectra])), 0.75))
        if level < LEAST_LEVEL:
            lower = replace(noise, acceleration=level * noise.acceleration)
            spectra = _spectra_of(record, masses, band, weighting, rules, lower)
        found.append(spectra)
    return tuple(found)


def _colour_of(records: Sequence[FrameRecord], band: Band, spectra_with: Callable[[float], Sequence[Spectra]]) -> float:
    """Return the colour of the sensors' noise with which the residual is noise at all frequencies alike.

    The residual of a linear frame is noise at most storeys and frequencies, because an effect acts on few of them. In
    each part of the band, the lower quartile over storeys and records is therefore compared with the noise. With the
    right colour it is the same multiple of the noise in all parts.
    """
    spread = []
    possible = possible_colours(records, band.high_hz)
    for colour in possible if len(possible) > 1 else ():
        powers = [_powers(design_of("linear-frame", [item])) for item in spectra_with(colour)]
        relative = np.concatenate([np.maximum(item, 1e-300) / np.median(item) for item in powers])
        spread.append(float(np.std(np.log(np.quantile(relative, 0.25, axis=0)))))
    return possible[int(np.argmin(spread))] if spread else possible[0]


def _powers(design: Design) -> FloatArray:
    """Return the mean square of the weighted residual in parts of the band of equal ratio, shape (records n, parts)."""
    widths = [2 * item.frequencies_hz.size for item in design.spectra]
    rows = []
    for item, residual in zip(design.spectra, np.split(design.residual, np.cumsum(widths)[:-1], axis=1), strict=True):
        frequencies = np.tile(item.frequencies_hz, 2)
        edges = np.geomspace(frequencies.min(), frequencies.max() * (1.0 + 1e-9), BAND_PARTS + 1)
        place = np.searchsorted(edges, frequencies, side="right") - 1
        count = np.maximum(np.bincount(place, minlength=BAND_PARTS), 1)
        rows += [np.bincount(place, weights=own**2, minlength=BAND_PARTS) / count for own in residual]
    return np.array(rows)


def _few(records: Sequence[FrameRecord], most: int = 3) -> list[FrameRecord]:
    forced = [item for item in records if item.kind in ("sweep", "random")]
    return sorted(forced or records, key=lambda item: len(item.ground))[:most]


def _shear(storey: FloatArray, turns: int) -> Weighting:
    """Return the weighting of a shear frame."""
    return Weighting.of_displacements(_matrix(storey), turns)


def _matrix(storey: FloatArray) -> FloatArray:
    """Return the shear of each storey per floor displacement, shape (n, n)."""
    n = len(storey)
    return np.asarray(storey[:, None] * (np.eye(n) - np.eye(n, k=-1)))


def coupled_stiffness(
    spectra: Sequence[Spectra], sheared: FloatArray, coupling: float = FrameRules().coupling
) -> FloatArray:
    """Return the shear of each storey per floor displacement of a general linear frame, shape (n, n) [N/m].

    At low frequencies the displacement of a floor without a laser has far more noise than that of a floor with one.
    Even with a small coefficient in the equation of a storey, this noise dominates there. Couplings that the records
    hardly determine are therefore kept near those of a shear frame.

    Parameters
    ----------
    spectra
        Spectra of the records.
    sheared
        Shear of each storey per floor displacement of the shear frame, shape (n, n) [N/m].
    coupling
        Expected size of the couplings, as a share of the storey stiffness.
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
        prior[:n, :n] = np.eye(n) / (coupling * sheared[storey, storey])
        scale = np.linalg.norm(regressors, axis=1)
        prior[np.arange(n, width), np.arange(n, width)] = 1e-6 * scale[n:]
        equations = np.concatenate([regressors, prior], axis=1).T
        numbers = np.linalg.lstsq(equations, np.concatenate([left, np.zeros(width)]), rcond=None)[0]
        found[storey] -= numbers[:n]
    return found


def _band_of_power(records: Sequence[FrameRecord]) -> Band:
    """Return the band that contains the power of the motion of the floors."""
    lowest, highest = [], []
    for item in records:
        frequencies, density = signal.welch(
            item.acceleration - np.mean(item.acceleration, axis=0),
            item.rate_hz,
            nperseg=min(len(item.ground), 4096),
            axis=0,
        )
        power = density.sum(axis=1)
        # the noise of sensors is flat: subtract it
        power = np.maximum(power - ABOVE_NOISE * np.median(power[len(power) // 2 :]), 0.0)
        share = np.cumsum(power) / max(float(power.sum()), 1e-300)
        lowest.append(float(frequencies[max(1, int(np.searchsorted(share, POWER_SHARE)))]))
        highest.append(float(frequencies[min(len(share) - 1, int(np.searchsorted(share, 1.0 - POWER_SHARE)))]))
    below, above, ratio = START_MARGINS
    # no record resolves less than one period
    resolved = min(item.rate_hz / len(item.ground) for item in records)
    low, high = max(below * min(lowest), resolved), max(highest)
    return Band(low, min(max(above * high, ratio * low), OF_RATE * min(item.rate_hz for item in records)))


def shear_stiffness_of(design: Design, masses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return storey stiffnesses [N/m] of a fitted shear frame and its natural frequencies [Hz], shape (n,) each."""
    linear = design.linear
    storey = np.array([-numbers[0] for numbers in linear])
    positive = storey[storey > 0.0]
    storey = np.where(storey > 0.0, storey, float(np.median(positive)) if positive.size else 1.0)
    K = storey_sums(len(masses))
    stiffness = np.linalg.inv(K) @ _matrix(storey)
    squared = np.linalg.eigvals(stiffness / masses[:, None])
    return storey, np.sort(np.sqrt(np.abs(np.real(squared)))) / (2.0 * np.pi)


def ladder(spectra: Sequence[Spectra]) -> dict[Base, Design]:
    """Return the linear frames that are compared, the simplest one first; there is only one in equations of modes."""
    free = design_of("linear-frame", spectra)
    modal = spectra[0].modes is not None
    return {"shear-frame": free if modal else design_of("shear-frame", spectra), "linear-frame": free}
