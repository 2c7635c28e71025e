"""The equation of motion of each storey as weighted spectra: what the floors' inertia says, and what motion explains.

With every floor's acceleration measured, the shear force of storey s is known: the sum of mass times absolute
acceleration of the floors above it. Displacement and velocity come from the same accelerometers, integrated twice in
the frequency domain, so that the equation holds sample by sample; it is multiplied by a taper, transformed, and each
line of the spectrum weighted by what the accelerometers' noise makes of it (integrated noise rules at low frequencies).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft, signal

from mrpipe.artifacts import FloatArray
from mrpipe.discrepancy.frame_records import FrameRecord
from mrpipe.structures.dynamics import ComplexArray

MODEL_FLOOR = 0.001
"""No line is trusted better than this share of the storey's own force: errors of clocks and gains below it are of no
interest."""

INTEGRATION_SHARE = 0.6
"""Corner of the integration over the lower edge of the band."""


@dataclass(frozen=True)
class Band:
    """Frequencies that are compared [Hz]."""

    low_hz: float
    high_hz: float


@dataclass(frozen=True)
class Motion:
    """Motion of a record in time, relative to the ground; shape (m, n), SI.

    `acceleration` is absolute and without what lies below the band; `state_displacement` and `state_velocity` carry the
    slow part of lasers where there are any: what memories and gaps of effects are judged by; `drift` and
    `drift_rate` are theirs, storey after storey, shape (n, m).
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    ground: FloatArray
    state_displacement: FloatArray
    state_velocity: FloatArray
    drift: FloatArray
    drift_rate: FloatArray


@dataclass(frozen=True)
class Spectra:
    """A record's lines in the band.

    Attributes
    ----------
    target
        Shear force of each storey from inertia, shape (n, b) [N/sqrt(Hz)].
    regressors
        Displacements, velocities (relative, n each), ground acceleration and its second derivative, then known loads;
        shape (p, b).
    weight
        Inverse of the standard deviation of a line's real or imaginary part, shape (n, b).
    variance
        Mean square of the noise of a line, shape (n, b).
    """

    record: FrameRecord
    motion: Motion
    frequencies_hz: FloatArray
    taper: FloatArray
    target: ComplexArray
    regressors: ComplexArray
    weight: FloatArray
    variance: FloatArray

    def lines_of(self, history: FloatArray) -> ComplexArray:
        """Return the lines of a history of shape (m,) or (m, k): shape (b,) or (k, b)."""
        return spectrum_of(history, self.taper, self.record.dt, self.frequencies_hz)


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
    """Return a window that is flat but for a few periods of the lower edge at either end."""
    share = min(1.0, 2.0 * 2.0 / (low_hz * samples * dt))
    return np.asarray(signal.windows.tukey(samples, share))


def motion_of(record: FrameRecord, band: Band) -> Motion:
    """Integrate the relative accelerations of a record; what lies below the band is taken away smoothly."""
    dt, corner = record.dt, INTEGRATION_SHARE * band.low_hz
    size, n = record.acceleration.shape
    pad = _padding(size, int(6.0 / (corner * dt)))
    stack = np.column_stack([record.relative, record.acceleration, record.ground])
    lines, frequencies = _padded_lines(stack, pad, dt)
    keep = _high_pass(frequencies, corner)
    omega = 2.0 * np.pi * np.maximum(frequencies, 1e-9)
    total = len(stack) + 2 * pad

    def back(values: ComplexArray) -> FloatArray:
        return np.asarray(fft.irfft(values, total, axis=0)[pad : pad + size])

    relative = lines[:, :n]
    displacement = back(relative * (-keep / omega**2)[:, None])
    velocity = back(relative * (keep / (1j * omega))[:, None])
    filtered = back(lines[:, n:] * keep[:, None])
    slow, slow_rate = _slow_part(record, keep, omega, pad)
    state, rate = displacement + slow, velocity + slow_rate
    drift = np.ascontiguousarray(np.diff(state, axis=1, prepend=0.0).T)
    drift_rate = np.ascontiguousarray(np.diff(rate, axis=1, prepend=0.0).T)
    return Motion(displacement, velocity, filtered[:, :n], filtered[:, n], state, rate, drift, drift_rate)


def _padding(size: int, wanted: int) -> int:
    """Return by how much to lengthen a record at either end, so that its transform is quick."""
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


def _slow_part(record: FrameRecord, keep: FloatArray, omega: FloatArray, pad: int) -> tuple[FloatArray, FloatArray]:
    """Return what lasers see below the band, between them interpolated over the floors, and its rate; shape (m, n)."""
    size, n = record.acceleration.shape
    if not record.measured_displacement:
        return np.zeros((size, n)), np.zeros((size, n))
    floors = sorted(record.measured_displacement)
    rest = _at_rest(record)
    seen = np.column_stack([record.measured_displacement[floor] for floor in floors])
    seen = seen - np.mean(seen[rest], axis=0)
    lines, _ = _padded_lines(seen, pad, record.dt)
    below = lines * (1.0 - keep)[:, None]
    total = size + 2 * pad
    slow = fft.irfft(below, total, axis=0)[pad : pad + size]
    rate = fft.irfft(below * (1j * omega)[:, None], total, axis=0)[pad : pad + size]
    # slow motion has about the shape of the first mode of a uniform frame: between lasers its factor is interpolated
    shape = np.sin(np.pi * np.arange(1, n + 1) / (2 * n + 1))
    own = shape[np.array(floors) - 1]
    share = np.stack([shape * np.interp(np.arange(1, n + 1), floors, unit / own) for unit in np.eye(len(floors))])
    return np.asarray(slow @ share), np.asarray(rate @ share)


def _at_rest(record: FrameRecord) -> slice:
    """Return the quietest second of a record where it is quiet; all of it otherwise."""
    size = max(8, round(record.rate_hz))
    strength = np.sum(record.relative - np.mean(record.relative, axis=0), axis=1) ** 2
    blocks = strength[: len(strength) // size * size].reshape(-1, size).mean(axis=1)
    if len(blocks) < 2 or blocks.min() > 1e-3 * blocks.mean():
        return slice(None)
    quiet = int(np.argmin(blocks))
    return slice(quiet * size, (quiet + 1) * size)


def noise_density(values: FloatArray, rate_hz: float, above_hz: float) -> float:
    """Return the power density of the noise on an accelerometer, told by what lies above the band [(m/s2)^2/Hz]."""
    frequencies, density = signal.welch(values - np.mean(values), rate_hz, nperseg=min(len(values), 2048))
    high = (frequencies > min(above_hz, 0.3 * rate_hz)) & (frequencies < 0.45 * rate_hz)
    # the lower quartile passes by resonances of what the model does not hold
    return float(np.quantile(density[high], 0.25)) / 0.85


def noise_of(records: Sequence[FrameRecord], band: Band) -> FloatArray:
    """Return the noise density of ground and floors, shape (1 + n,), the smallest of all records of a channel."""
    rows = [
        [noise_density(channel, item.rate_hz, 1.25 * band.high_hz) for channel in (item.ground, *item.acceleration.T)]
        for item in records
    ]
    return np.asarray(np.median(rows, axis=0))


def storey_sums(floors: int) -> FloatArray:
    """Return the matrix that sums floors from the top down to a storey, shape (n, n)."""
    return np.triu(np.ones((floors, floors)))


def spectra_of(
    record: FrameRecord, masses: FloatArray, band: Band, noise: FloatArray, stiffness: FloatArray, motion: Motion
) -> Spectra:
    """Return the lines of a record.

    Parameters
    ----------
    masses
        Shape (n,) [kg].
    noise
        Of ground and floors, shape (1 + n,) [(m/s2)^2/Hz].
    stiffness
        Row a storey, column a floor's displacement, shape (n, n) [N/m]: for the weights alone.
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
    loads = dict(record.loads)
    if "force" in record.damper:
        loads[1] = record.damper["force"]
    for floor in range(1, n + 1):
        if floor in loads:
            parts.append(spectrum_of(loads[floor], taper, dt, frequencies)[None])
    target = spectrum_of(shear, taper, dt, frequencies)
    inverse = 1.0 / omega**2
    by_floor = sums[:, :, None] * masses[None, :, None] - stiffness[:, :, None] * inverse
    variance = (
        np.einsum("slb,l->sb", by_floor**2, noise[1:]) + noise[0] * (stiffness.sum(axis=1)[:, None] * inverse) ** 2
    )
    own = np.mean(np.abs(target) ** 2, axis=1, keepdims=True)
    variance = variance + MODEL_FLOOR**2 * own
    return Spectra(record, motion, frequencies, taper, target, np.concatenate(parts), np.sqrt(2.0 / variance), variance)
