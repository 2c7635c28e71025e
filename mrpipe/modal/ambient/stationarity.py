"""Share of a record that counts where the strength of the excitation changes: earthquakes, gusts, traffic.

For a force g(t) w(t), with white noise w and a strength g that changes slowly, the expectation of the periodogram is
that of a stationary force. Its lines are not independent, however: only the effective duration

    T_e = (int g^2 dt)^2 / int g^4 dt

gives independent information. The energy of a motion in parts of the record shows it. Under a stationary force, the
energy in a part of length T_p scatters with the relative variance 1/(1 + B T_p), with the bandwidth B of the motion.
A larger scatter is due to the relative variance of g^2. If the scatter is not larger than expected by chance, the
effective duration is that of the whole record.

The correlation functions of a short block have the poles of the structure for any strength of the force, because the
motion at its beginning decays freely, and the later force is independent of it. Blocks can therefore be weighted. Over
their energy, weak blocks give as much information as strong ones, as far as their motion exceeds the noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray
from mrpipe.modal.spectra import ComplexArray

_PARTS = 16
_LEVEL = 0.01
"""Probability that a stationary record counts as one that is not."""


def effective_share(motions: Sequence[ComplexArray]) -> float:
    """Return the effective duration of the excitation over the length of the record, at most 1.

    Parameters
    ----------
    motions
        For each motion (a sensor or a mode), consecutive lines of its discrete Fourier transform in the band of the
        motion, shape (m,).
    """
    scatters, expected = [], []
    for lines in motions:
        power = np.abs(lines) ** 2
        if lines.size < 2 * _PARTS or not power.sum() > 0.0:
            continue
        energy = part_energies(lines, _PARTS)
        scatters.append(float(np.var(energy, ddof=1) / np.mean(energy) ** 2))
        # the mean square of exponentially distributed lines is twice the square of their mean
        bandwidth = 2.0 * float(power.sum() ** 2 / np.sum(power**2))
        expected.append(1.0 / (1.0 + bandwidth / _PARTS))
    if not scatters:
        return 1.0
    freedom = (_PARTS - 1) * len(scatters)
    scatter, chance = float(np.mean(scatters)), float(np.mean(expected))
    if scatter * freedom / chance < stats.chi2.isf(_LEVEL, freedom):
        return 1.0
    return min(1.0, (1.0 + chance) / (1.0 + scatter))


def part_energies(lines: ComplexArray, parts: int) -> FloatArray:
    """Return the energy of a motion in equal parts of the record, shape (parts,), from its lines in a band."""
    envelope = np.abs(np.fft.ifft(lines)) ** 2
    return np.array([float(part.mean()) for part in np.array_split(envelope, parts)])


def block_weights(blocks: Sequence[FloatArray]) -> FloatArray:
    """Return weights of the correlation functions of blocks, each of shape (s, m), with a mean of one.

    The weight is the reciprocal of the energy, times the correlation of neighbouring samples. The latter is small where
    noise of the sensors is as large as the motion.
    """
    weights = np.empty(len(blocks))
    scale = np.sqrt(np.mean([np.mean(block**2, axis=1) for block in blocks], axis=0))[:, None]
    for i, block in enumerate(blocks):
        values = block / np.maximum(scale, 1e-300)
        energy = max(float(np.mean(values**2)), 1e-300)
        weights[i] = abs(float(np.mean(values[:, 1:] * values[:, :-1]))) / energy**2
    return np.asarray(weights / max(float(weights.mean()), 1e-300))
