"""Equations of motion of the modes that the records of a structure determine.

In a structure that bends, such as a wall, the higher modes lie above the frequencies that are excited. Such a mode
follows a force without delay: its displacement is a copy of the force. If a linear frame may use the displacement of
every floor with any coefficients, these copies explain the force of a nonlinear effect, and nothing seems to be
missing. Its equations also multiply the noise of the sensors by the large stiffness of these modes.

The motion is therefore described by the few directions that hold more than noise. Stiffness and damping of a structure
are symmetric (Betti's and Maxwell's theorem of reciprocity), also in these directions. Their equations are fitted
together with this constraint. A copy of a force in one equation would need the same coefficient in the equation of the
copy, where it does not fit. The noise of the sensors enters the equation of a mode least at the frequency of the mode,
where the motion is largest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import ComplexArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.coordinates import Modes
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.sensor_noise import Noise
from mrpipe.tracing.structure.spectra import Spectra, storey_sums

LEAST_SIGNAL = 1000.0
"""Numerical technique: least power of the acceleration in a direction over that of the noise. The displacement that is
integrated from it has a larger share of noise, which lowers the fitted stiffness."""

ROUNDS = 6
"""Numerical technique: number of fits, each with the modes and weights of the one before."""


@dataclass(frozen=True)
class ModalFrame:
    """A linear frame in the coordinates of its modes.

    Attributes
    ----------
    modes
        The modes.
    stiffness
        Squares of the angular frequencies of the modes, shape (m,) [1/s2].
    ground
        Coefficients of the ground acceleration and of its second derivative, shape (m, 2).
    turning
        Coefficients of the rotations of the floors about the vertical, shape (m, turns).
    """

    modes: Modes
    stiffness: FloatArray
    ground: FloatArray
    turning: FloatArray

    @property
    def frequencies_hz(self) -> FloatArray:
        """Natural frequencies of the modes, shape (m,) [Hz]; 0 for one that the records do not determine."""
        return np.asarray(np.sqrt(np.maximum(self.stiffness, 0.0)) / (2.0 * np.pi))


def modal_frame(
    spectra: Sequence[Spectra], noises: Sequence[Noise], masses: FloatArray, rules: FrameRules
) -> ModalFrame | None:
    """Return the linear frame in the modes that records determine; None if they determine the motion of all floors.

    None is also returned if a force on a floor is measured, such as that of a damper or a shaker. The modes that are
    left out follow this force without delay, and the equations of the others would have to contain this motion. Under
    motion of the ground it is proportional to the acceleration of the ground, which each equation contains.

    Parameters
    ----------
    spectra
        Spectra of the records, in the equations of the storeys.
    noises
        Noise of the sensors of each record.
    masses
        Floor masses, shape (n,) [kg].
    rules
        Decision thresholds.
    """
    shapes = moving_directions(spectra, noises, masses)
    count, turns = shapes.shape[1], spectra[0].record.turns
    if count in (0, len(masses)) or any(item.record.carries_device for item in spectra):
        return None
    frame = ModalFrame(_modes_of(shapes, masses), np.zeros(count), np.zeros((count, 2)), np.zeros((count, turns)))
    for _ in range(ROUNDS):
        own = [in_modes(item, noise, frame, rules) for item, noise in zip(spectra, noises, strict=True)]
        frame, shapes = _fitted(design_of("linear-frame", own).linear[0], shapes, masses, turns)
    return frame


def moving_directions(spectra: Sequence[Spectra], noises: Sequence[Noise], masses: FloatArray) -> FloatArray:
    """Return the directions of motion that hold more than noise, orthonormal with the masses, shape (n, m).

    Parameters
    ----------
    spectra
        Spectra of the records.
    noises
        Noise of the sensors of each record.
    masses
        Floor masses, shape (n,) [kg].
    """
    n, root = len(masses), np.sqrt(masses)
    power = np.zeros((n, n))
    for item, noise in zip(spectra, noises, strict=True):
        omega = 2.0 * np.pi * item.frequencies_hz
        density = np.mean(noise.of_accelerometers(item.frequencies_hz), axis=0)
        moved = root[:, None] * item.regressors[:n] * omega**2 / np.sqrt(density)
        power += (moved @ moved.conj().T).real / len(omega) / len(spectra)
    # the acceleration relative to the ground contains the noise of the ground's sensor on all floors
    noisy = root[:, None] * (np.eye(n) + 1.0) * root
    ratio, vectors = linalg.eigh(power, noisy)
    count = int(np.count_nonzero(ratio > LEAST_SIGNAL))
    strongest = (noisy @ vectors)[:, ::-1][:, :count]
    return np.asarray(np.linalg.qr(strongest)[0] / root[:, None])


def in_modes(spectra: Spectra, noise: Noise, frame: ModalFrame, rules: FrameRules) -> Spectra:
    """Return spectra in the equations of modes, weighted by the noise of the sensors.

    Parameters
    ----------
    spectra
        Spectra of a record, in the equations of the storeys.
    noise
        Noise of the sensors of the record.
    frame
        Linear frame by which the noise is propagated.
    rules
        Decision thresholds.
    """
    modes, n, turns = frame.modes, spectra.record.floors, spectra.record.turns
    values, count = spectra.regressors, len(modes.filters)
    target = modes.equations @ spectra.target
    last = len(values) - 2 * turns
    columns = [_symmetric(modes.filters @ values[:n]), _symmetric(modes.filters @ values[n : 2 * n])]
    columns += [_separate(item, count) for item in (*values[2 * n : 2 * n + 2], *values[last:])]
    variance = _variance(spectra, noise, frame)
    variance += rules.model_floor**2 * np.mean(np.abs(target) ** 2, axis=1, keepdims=True)
    return replace(
        spectra,
        frequencies_hz=np.tile(spectra.frequencies_hz, count),
        target=target.reshape(1, -1),
        regressors=np.concatenate(columns).reshape(-1, target.size),
        weight=np.sqrt(2.0 / variance).reshape(1, -1),
        variance=variance.reshape(1, -1),
        modes=modes,
    )


def _variance(spectra: Spectra, noise: Noise, frame: ModalFrame) -> FloatArray:
    """Return the mean square of the noise of each line in the equation of each mode, shape (m, b)."""
    filters, stiffness = frame.modes.filters, frame.stiffness[:, None]
    frequencies, lasers = spectra.frequencies_hz, spectra.laser_share
    omega2 = (2.0 * np.pi * frequencies) ** 2
    sensors = noise.of_accelerometers(frequencies)
    integrated = (1.0 - lasers) / omega2
    floors = filters[:, :, None] * (1.0 - stiffness[:, :, None] * integrated)
    relative = stiffness * (filters @ integrated)
    ground = relative - (frame.ground[:, :1] - frame.ground[:, 1:] * omega2 / omega2[-1])
    variance = np.einsum("mlb,lb->mb", floors**2, sensors[1:]) + ground**2 * sensors[0]
    variance += frame.turning**2 @ (noise.of_turning(frequencies) / omega2**2)
    of_lasers = np.array([noise.displacement.get(k + 1, 0.0) for k in range(filters.shape[1])])[:, None] * lasers**2
    variance += (stiffness * filters) ** 2 @ of_lasers
    return np.asarray(variance)


def _symmetric(values: ComplexArray) -> ComplexArray:
    """Return the regressors of a symmetric matrix that multiplies modal coordinates, shape (m (m + 1) / 2, m, b)."""
    rows, columns = np.triu_indices(len(values))
    found = np.zeros((len(rows), *values.shape), dtype=np.complex128)
    place = np.arange(len(rows))
    found[place, rows] = values[columns]
    found[place, columns] = values[rows]
    return found


def _separate(values: ComplexArray, count: int) -> ComplexArray:
    """Return the regressors of a history with a separate coefficient in each equation, shape (m, m, b)."""
    return np.asarray(np.eye(count)[:, :, None] * values)


def _modes_of(shapes: FloatArray, masses: FloatArray) -> Modes:
    sums = storey_sums(len(masses))
    moving = masses[:, None] * shapes
    return Modes(moving.T, np.asarray(np.linalg.solve(sums.T, shapes).T, dtype=np.float64), sums @ moving)


def _fitted(numbers: FloatArray, shapes: FloatArray, masses: FloatArray, turns: int) -> tuple[ModalFrame, FloatArray]:
    """Return the frame, in coordinates in which its stiffness is diagonal, and the shapes of its modes."""
    count = shapes.shape[1]
    rows, columns = np.triu_indices(count)
    pairs = len(rows)
    stiffness = np.zeros((count, count))
    stiffness[rows, columns] = stiffness[columns, rows] = -numbers[:pairs]
    squared, turn = np.linalg.eigh(stiffness)
    others = numbers[2 * pairs :].reshape(-1)[: (2 + turns) * count].reshape(2 + turns, count).T
    coefficients = turn.T @ others
    shapes = shapes @ turn
    return ModalFrame(_modes_of(shapes, masses), squared, coefficients[:, :2], -coefficients[:, 2:]), shapes
