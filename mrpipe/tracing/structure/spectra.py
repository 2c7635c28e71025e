"""The equation of motion of each storey as weighted spectra: shear force from inertia, and motion.

If the acceleration of every floor is measured, the shear force of storey s is known: the sum of mass times absolute
acceleration of the floors above it. Displacement and velocity come from the same accelerometers, integrated in the
frequency domain, so the equation holds sample by sample. It is tapered and Fourier-transformed. Each line of the
spectrum is weighted by the noise that the accelerometers cause in it; at low frequencies integrated noise dominates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import fft, signal

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import ComplexArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.coordinates import Band, Modes, Weighting
from mrpipe.tracing.structure.records import FrameRecord
from mrpipe.tracing.structure.sensor_noise import Noise, laser_share

INTEGRATION_SHARE = 0.6
"""Numerical technique: corner of the integration, in multiples of the lower edge of the band."""

STRONG_LINES = 0.1
"""Numerical technique: gains are compared on lines whose power exceeds this share of the strongest one."""

ABOVE_EDGE = 1.5
"""Numerical technique: gains are compared above this multiple of the lower edge of the band."""

QUIET_SECOND = 0.01
"""Numerical technique: a record contains a time at rest if its quietest second has less than this share of its mean
power; the mean of a laser signal is then taken there."""


@dataclass(frozen=True)
class Motion:
    """Motion of a record in time, relative to the ground; shape (m, n), SI.

    `acceleration` is absolute and high-pass filtered at the band. `state_displacement` and `state_velocity` include the
    slow part that lasers measure, because memories and gaps of effects depend on it. `drift` and `drift_rate` are their
    differences between floors, storey after storey, shape (n, m). `turn` and `turn_rate` are the rotation of the floors
    about the vertical and its rate, shape (m, turns).
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    ground: FloatArray
    state_displacement: FloatArray
    state_velocity: FloatArray
    drift: FloatArray
    drift_rate: FloatArray
    turn: FloatArray
    turn_rate: FloatArray


@dataclass(frozen=True)
class Spectra:
    """Spectral lines of a record in the band.

    The equations are those of the storeys. Where a structure is judged in its modes, the equations of all modes follow
    one another as a single equation with m times as many lines, because they share coefficients.

    Attributes
    ----------
    record, motion
        The record, and its motion in the time domain.
    frequencies_hz
        Frequencies of the lines, shape (b,).
    taper
        Window in the time domain.
    target
        Shear force of each storey from inertia, shape (n, b) [N/sqrt(Hz)].
    regressors
        Displacements, velocities (relative, n each), ground acceleration and its second derivative, then known loads,
        and rotations of the floors and their rates; shape (p, b).
    weight
        Inverse of the standard deviation of a line's real or imaginary part, shape (n, b).
    variance
        Mean square of the noise of a line, shape (n, b).
    laser_share
        Share of the displacement that comes from a displacement sensor, shape (n, b) [1].
    modes
        Modes in whose equations the structure is judged; None: in those of the storeys.
    """

    record: FrameRecord
    motion: Motion
    frequencies_hz: FloatArray
    taper: FloatArray
    target: ComplexArray
    regressors: ComplexArray
    weight: FloatArray
    variance: FloatArray
    laser_share: FloatArray
    modes: Modes | None = None

    def lines_of(self, history: FloatArray) -> ComplexArray:
        """Return the lines of a history of shape (m,) or (m, k): shape (b,) or (k, b)."""
        lines = len(self.frequencies_hz) // (len(self.modes.filters) if self.modes else 1)
        return spectrum_of(history, self.taper, self.record.dt, self.frequencies_hz[:lines])

    def in_equations(self, lines: ComplexArray) -> ComplexArray:
        """Return the lines of shear forces of the storeys, shape (..., n, b), in the equations of these spectra."""
        if self.modes is None:
            return lines
        found = self.modes.equations @ lines
        return np.asarray(found.reshape(*found.shape[:-2], 1, -1))

    def in_storeys(self, lines: ComplexArray) -> ComplexArray:
        """Return lines of the equations of these spectra as shear forces of the storeys, shape (n, b)."""
        return lines if self.modes is None else self.modes.forces @ lines.reshape(len(self.modes.filters), -1)


def spectrum_of(history: FloatArray, taper: FloatArray, dt: float, frequencies: FloatArray) -> ComplexArray:
    """Return the tapered Fourier lines, scaled so that their mean square is the one-sided power density."""
    columns = history if history.ndim == 2 else history[:, None]
    centred = columns - np.sum(columns * taper[:, None], axis=0) / np.sum(taper)
    size = fft.next_fast_len(len(taper), real=True)
    lines = fft.rfft((centred * taper[:, None]).T, size, axis=1)
    first = round(float(frequencies[0]) * size * dt)
    chosen = lines[:, first : first + len(frequencies)] * np.sqrt(2.0 * dt / np.sum(taper**2))
    return np.asarray(chosen if history.ndim == 2 else chosen[0])


def lines_in_band(samples: int, dt: float, band: Band) -> FloatArray:
    """Return the frequencies of the lines in the band [Hz]."""
    size = fft.next_fast_len(samples, real=True)
    frequencies = fft.rfftfreq(size, dt)
    return np.asarray(frequencies[(frequencies >= band.low_hz) & (frequencies <= band.high_hz)])


def taper_of(samples: int, dt: float, low_hz: float) -> FloatArray:
    """Return a window that is flat except for a few periods of the lower edge at either end.

    The window is zero in the first and last of these periods, where the transients of the integration decay.
    """
    margin = int(min(1.5 / (low_hz * dt), 0.06 * samples))
    inner = samples - 2 * margin
    share = min(1.0, 2.0 * 3.0 / (low_hz * inner * dt))
    return np.pad(signal.windows.tukey(inner, share), margin)


def motion_of(record: FrameRecord, band: Band, noise: Noise, rules: FrameRules | None = None) -> Motion:
    """Return the motion of a record: integrated accelerations and laser signals, weighted by the noise of both.

    The signals of the equation of motion are high-pass filtered below the band.

    Parameters
    ----------
    record
        The record.
    band
        Frequencies in use.
    noise
        Noise of the sensors.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or FrameRules()
    dt, corner = record.dt, INTEGRATION_SHARE * band.low_hz
    size, n = record.acceleration.shape
    pad = _padding(size, int(6.0 / (corner * dt)))
    turning = record.turning if record.turns else np.zeros((size, 0))
    stack = np.column_stack([record.relative, record.acceleration, record.ground, turning])
    lines, frequencies = _padded_lines(stack, pad, dt)
    keep = _high_pass(frequencies, corner)[:, None]
    omega = 2.0 * np.pi * np.maximum(frequencies, 1e-9)[:, None]
    total = size + 2 * pad

    def back(values: ComplexArray) -> FloatArray:
        return np.asarray(fft.irfft(values, total, axis=0)[pad : pad + size])

    integrated = -lines[:, :n] / omega**2
    moved = integrated * keep
    slow = np.zeros_like(moved)
    if record.measured_displacement:
        floors = sorted(record.measured_displacement)
        seen = _laser_lines(record, floors, pad)
        for k, floor in enumerate(floors):
            share = laser_share(omega[:, 0], noise, floor)[:, None]
            own = seen[:, k : k + 1] * _gain_of(seen[:, k], integrated[:, floor - 1], frequencies, band, rules)
            moved[:, floor - 1 : floor] = keep * (share * own + (1.0 - share) * integrated[:, floor - 1 : floor])
        slow = (seen * (1.0 - keep)) @ _over_floors(n, floors)
    displacement, velocity = back(moved), back(moved * 1j * omega)
    filtered = back(lines[:, n : 2 * n + 1] * keep)
    turned = -lines[:, 2 * n + 1 :] / omega**2 * keep
    state, rate = displacement + back(slow), velocity + back(slow * 1j * omega)
    drift = np.ascontiguousarray(np.diff(state, axis=1, prepend=0.0).T)
    drift_rate = np.ascontiguousarray(np.diff(rate, axis=1, prepend=0.0).T)
    return Motion(
        displacement, velocity, filtered[:, :n], filtered[:, n], state, rate, drift, drift_rate, back(turned),
        back(turned * 1j * omega),
    )  # fmt: skip


def _laser_lines(record: FrameRecord, floors: Sequence[int], pad: int) -> ComplexArray:
    seen = np.column_stack([record.measured_displacement[floor] for floor in floors])
    return _padded_lines(seen - np.mean(seen[_at_rest(record)], axis=0), pad, record.dt)[0]


def _gain_of(
    laser: ComplexArray, integrated: ComplexArray, frequencies: FloatArray, band: Band, rules: FrameRules
) -> float:
    """Return the factor that brings a laser to the gain of the accelerometer; 1 if they do not measure the same."""
    inside = (frequencies > ABOVE_EDGE * band.low_hz) & (frequencies < band.high_hz)
    power = np.where(inside, np.abs(laser) ** 2, 0.0)
    # use only the strongest lines, because noise of either sensor would bias the gain
    strong = power > STRONG_LINES * float(power.max())
    gain = float(np.sum((np.conj(laser[strong]) * integrated[strong]).real)) / max(float(power[strong].sum()), 1e-300)
    known = 1.0 / rules.gain_range < gain < rules.gain_range
    return gain if known and abs(gain - 1.0) > rules.same_gain else 1.0


def _over_floors(n: int, floors: Sequence[int]) -> FloatArray:
    """Return the matrix that extends the slow motion of floors with lasers to all floors, shape (lasers, n).

    The slow motion has approximately the shape of the first mode of a uniform frame; its factor is interpolated between
    the lasers.
    """
    shape = np.sin(np.pi * np.arange(1, n + 1) / (2 * n + 1))
    own = shape[np.array(floors) - 1]
    return np.stack([shape * np.interp(np.arange(1, n + 1), floors, unit / own) for unit in np.eye(len(floors))])


def _padding(size: int, wanted: int) -> int:
    """Return the number of samples to add at either end of a record, so that its Fourier transform is fast."""
    for pad in range(min(size - 1, wanted), size - 1):
        if fft.next_fast_len(size + 2 * pad, real=True) == size + 2 * pad:
            return pad
    return size - 1


def _padded_lines(stack: FloatArray, pad: int, dt: float) -> tuple[ComplexArray, FloatArray]:
    longer = np.concatenate([2.0 * stack[0] - stack[pad:0:-1], stack, 2.0 * stack[-1] - stack[-2 : -pad - 2 : -1]])
    return np.asarray(fft.rfft(longer, axis=0)), np.asarray(fft.rfftfreq(len(longer), dt))


def _high_pass(frequencies: FloatArray, corner: float) -> FloatArray:
    ratio = np.maximum(frequencies, 1e-9) / corner
    return np.asarray(ratio**8 / (1.0 + ratio**8))


def _at_rest(record: FrameRecord) -> slice:
    """Return the quietest second of a record if the frame is at rest in it, else the whole record."""
    size = max(8, round(record.rate_hz))
    strength = np.sum(record.relative - np.mean(record.relative, axis=0), axis=1) ** 2
    blocks = strength[: len(strength) // size * size].reshape(-1, size).mean(axis=1)
    if len(blocks) < 2 or blocks.min() > QUIET_SECOND * blocks.mean():
        return slice(None)
    quiet = int(np.argmin(blocks))
    return slice(quiet * size, (quiet + 1) * size)


def storey_sums(floors: int) -> FloatArray:
    """Return the matrix that sums floors from the top down to a storey, shape (n, n)."""
    return np.triu(np.ones((floors, floors)))


def gains_of_floors(
    weighting: Weighting, masses: FloatArray, frequencies_hz: FloatArray, lasers: FloatArray
) -> FloatArray:
    """Return the error of each storey's equation per error of each floor's accelerometer, shape (n, n, b) [kg].

    The accelerometer of a floor enters the inertia of the storeys below it and, integrated twice, the displacement.

    Parameters
    ----------
    weighting
        Linear frame by which errors are propagated.
    masses
        Floor masses, shape (n,) [kg].
    frequencies_hz
        Frequencies of the lines, shape (b,).
    lasers
        Share of each displacement that comes from a displacement sensor, shape (n, b).
    """
    inverse = (1.0 - lasers) / (2.0 * np.pi * frequencies_hz) ** 2
    inertia = storey_sums(len(masses))[:, :, None] * masses[None, :, None]
    return np.asarray(inertia - weighting.stiffness[:, :, None] * inverse)


def gains_of_ground(weighting: Weighting, frequencies_hz: FloatArray, lasers: FloatArray) -> FloatArray:
    """Return the error of each storey's equation per error of the ground's accelerometer, shape (n, b) [kg].

    The displacements are relative to the ground, so that its error enters all of them.
    """
    omega = 2.0 * np.pi * frequencies_hz
    relative = np.einsum("sl,lb->sb", weighting.stiffness, (1.0 - lasers) / omega**2)
    direct = weighting.ground[:, :1] - weighting.ground[:, 1:] * omega**2 / omega[-1] ** 2
    return np.asarray(relative - direct)


def spectra_of(
    record: FrameRecord,
    masses: FloatArray,
    band: Band,
    noise: Noise,
    weighting: Weighting,
    motion: Motion,
    rules: FrameRules | None = None,
) -> Spectra:
    """Return the lines of a record.

    Parameters
    ----------
    record
        The record.
    masses
        Shape (n,) [kg].
    band
        Frequencies in use.
    noise
        Noise of the sensors.
    weighting
        Linear frame by which the noise is propagated; used for the weights only.
    motion
        Motion of the record in the time domain.
    rules
        Decision thresholds; their defaults if None.
    """
    n, dt = record.floors, record.dt
    frequencies = lines_in_band(len(record.ground), dt, band)
    taper = taper_of(len(record.ground), dt, band.low_hz)
    sums = storey_sums(n)
    omega = 2.0 * np.pi * frequencies
    shear = motion.acceleration @ (sums * masses).T
    ground = spectrum_of(motion.ground, taper, dt, frequencies)
    parts = [
        spectrum_of(motion.displacement, taper, dt, frequencies),
        spectrum_of(motion.velocity, taper, dt, frequencies),
        ground[None],
        (-ground * omega**2 / omega[-1] ** 2)[None],
    ]
    loads = record.known_loads
    for floor in range(1, n + 1):
        if floor in loads:
            parts.append(spectrum_of(loads[floor], taper, dt, frequencies)[None])
    if record.turns:
        parts += [spectrum_of(item, taper, dt, frequencies) for item in (motion.turn, motion.turn_rate)]
    target = spectrum_of(shear, taper, dt, frequencies)
    lasers = np.stack([laser_share(omega, noise, floor) for floor in range(1, n + 1)])
    unweighted = Spectra(
        record, motion, frequencies, taper, target, np.concatenate(parts), np.ones(target.shape),
        np.ones(target.shape), lasers,
    )  # fmt: skip
    return reweighted(unweighted, masses, noise, weighting, rules)


def reweighted(
    spectra: Spectra, masses: FloatArray, noise: Noise, weighting: Weighting, rules: FrameRules | None = None
) -> Spectra:
    """Return spectra with the weights that follow from the noise of the sensors.

    Parameters
    ----------
    spectra
        Spectra of a record. If it has displacement sensors, their share in the motion is not changed.
    masses
        Shape (n,) [kg].
    noise
        Noise of the sensors.
    weighting
        Linear frame by which the noise is propagated.
    rules
        Decision thresholds; their defaults if None.
    """
    frequencies, lasers, n = spectra.frequencies_hz, spectra.laser_share, len(masses)
    sensors = noise.of_accelerometers(frequencies)
    variance = np.einsum("slb,lb->sb", gains_of_floors(weighting, masses, frequencies, lasers) ** 2, sensors[1:])
    variance += sensors[0] * gains_of_ground(weighting, frequencies, lasers) ** 2
    turning = noise.of_turning(frequencies) / (2.0 * np.pi * frequencies) ** 4
    variance += np.einsum("sc,cb->sb", weighting.turning**2, turning)
    of_lasers = np.array([noise.displacement.get(floor, 0.0) for floor in range(1, n + 1)])[:, None] * lasers**2
    variance += np.einsum("sl,lb->sb", weighting.stiffness**2, of_lasers)
    # the noise of a load cell enters the equation of every storey below the load
    for floor, density in noise.loads.items():
        variance[:floor] += density
    own = np.mean(np.abs(spectra.target) ** 2, axis=1, keepdims=True)
    variance = variance + (rules or FrameRules()).model_floor ** 2 * own
    return replace(spectra, weight=np.sqrt(2.0 / variance), variance=variance)
