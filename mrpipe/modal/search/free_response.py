"""Frequency, damping and shape from free decays, for modes that the forced tests hardly excite.

A shaking table hardly excites the highest modes of a tall frame, so that their peaks are below the noise of a sweep. A
decay test has driven its mode at resonance before the release, so that the mode dominates. After the stop the
accelerometers of the floors give the shape, and the excitation need not be known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.decays.decay import damped_sinusoids, decay_start, exponential_fit
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest

ENOUGH_COHERENCE = 0.9
"""Coherence from which on a mode of the forced tests needs no decay."""
_LEAST_PERIODS = 20.0
_FADED = 3.0


@dataclass(frozen=True)
class FreeMode:
    """A mode from a free decay.

    Attributes
    ----------
    angular_frequency, damping_ratio, damping_error
        [rad/s], [1], standard error [1].
    shape, errors
        Shape (n,): real, largest element +1, and standard errors.
    quality
        Share of each floor's signal that is a sum of decaying modes, shape (n,).
    """

    angular_frequency: float
    damping_ratio: float
    damping_error: float
    shape: FloatArray
    errors: FloatArray
    quality: FloatArray


def same_place(test: FrameTest, first: float, second: float) -> bool:
    """Return whether two angular frequencies [rad/s] are equal within the resolution of the test."""
    return abs(first - second) <= max(0.01 * second, 4.0 * np.pi / test.duration_s)


def strongest_frequency(test: FrameTest, band_hz: tuple[float, float]) -> float | None:
    """Return the frequency [rad/s] of the strongest line of a decay test inside a band; None if there is none."""
    accelerations = _accelerations(test)
    frequency = np.fft.rfftfreq(accelerations.shape[0], 1.0 / test.sampling_rate_hz)
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    if not inside.any():
        return None
    power = np.sum(np.abs(np.fft.rfft(accelerations, axis=0)) ** 2, axis=1)
    return float(2.0 * np.pi * frequency[inside][int(np.argmax(power[inside]))])


def _accelerations(test: FrameTest) -> FloatArray:
    """Return the responses; displacements are scaled to approximate accelerations, so that all can be added."""
    responses = test.responses - test.responses.mean(axis=0)
    flags = np.asarray(test.is_displacement)
    if flags.any() and not flags.all():
        responses[:, flags] *= np.std(responses[:, ~flags]) / max(float(np.std(responses[:, flags])), 1e-300)
    return np.asarray(responses)


def free_mode(
    test: FrameTest, mode: int, angular_frequencies: FloatArray, damping_ratios: FloatArray
) -> FreeMode | None:
    """Return mode number `mode` (from 0) from a decay test; None if its decay is too short.

    Parameters
    ----------
    test
        The decay.
    mode
        Index of the mode among the given poles.
    angular_frequencies, damping_ratios
        Poles, shape (r,): start for this mode, and for other modes that may ring.
    """
    rate, omega = test.sampling_rate_hz, float(angular_frequencies[mode])
    responses = _accelerations(test)
    loudest = int(np.argmax(np.abs(np.exp(-1j * omega * np.arange(len(responses)) / rate) @ responses)))
    start = decay_start(test, responses[:, loudest], omega) + round(0.5 * np.pi / omega * rate)
    zeta = min(float(damping_ratios[mode]), 0.02)
    # after the decay only noise remains; the estimate of damping may be poor, so a longer part is included
    length = min(len(responses) - start, round(max(_FADED / (zeta * omega), 40.0 * np.pi / omega) * rate))
    if length < _LEAST_PERIODS * 2.0 * np.pi / omega * rate:
        return None
    piece = responses[start : start + length]
    clock = np.arange(length) / rate
    fitted_omega, damping, _ = exponential_fit(clock, piece[:, loudest], mode, angular_frequencies, damping_ratios)
    omegas, zetas = angular_frequencies.copy(), damping_ratios.copy()
    omegas[mode], zetas[mode] = fitted_omega, damping.value
    basis = damped_sinusoids(clock, omegas, zetas)
    coefficients = np.linalg.lstsq(basis, piece, rcond=None)[0]
    residual = piece - basis @ coefficients
    amplitude = coefficients[1 + 2 * mode] - 1j * coefficients[2 + 2 * mode]
    flags = np.asarray(test.is_displacement)
    raw = test.responses[start : start + length]
    scale = np.where(flags, -(fitted_omega**2) * raw.std(axis=0) / np.maximum(piece.std(axis=0), 1e-300), 1.0)
    amplitude = amplitude * scale
    turned = amplitude * np.exp(-1j * np.angle(amplitude[int(np.argmax(np.abs(amplitude)))]))
    inverse = np.linalg.pinv(basis.T @ basis)
    unit = float(np.sqrt(inverse[1 + 2 * mode, 1 + 2 * mode]))
    largest = float(np.abs(turned).max())
    if not largest > 0.0:
        return None
    noise = residual.std(axis=0) * np.abs(scale)
    return FreeMode(
        angular_frequency=fitted_omega,
        damping_ratio=damping.value,
        damping_error=damping.half_width / 1.96,
        shape=turned.real / largest,
        errors=unit * noise / largest,
        quality=np.clip(1.0 - residual.var(axis=0) / np.maximum(piece.var(axis=0), 1e-300), 0.0, 1.0),
    )


def with_decays(fit: MultiModeFit, decays: Sequence[FrameTest]) -> MultiModeFit:
    """Return the fit; modes that it hardly shows are replaced by those of decay tests, if these are better."""
    weak = np.flatnonzero(fit.mode_coherence() < ENOUGH_COHERENCE)
    for test in decays:
        band = (0.9 * fit.angular_frequencies[0] / (2.0 * np.pi), 1.1 * fit.angular_frequencies[-1] / (2.0 * np.pi))
        strongest = strongest_frequency(test, band)
        if strongest is None or not weak.size:
            continue
        mode = int(np.argmin(np.abs(fit.angular_frequencies - strongest)))
        if mode not in weak or not same_place(test, float(fit.angular_frequencies[mode]), strongest):
            continue
        found = free_mode(test, mode, fit.angular_frequencies, fit.damping_ratios)
        if found is not None:
            fit = _replaced(fit, mode, found)
    return fit


def _replaced(fit: MultiModeFit, mode: int, found: FreeMode) -> MultiModeFit:
    own = fit.residues[:, mode]
    known = np.linalg.norm(fit.residue_errors[:, mode]) / np.linalg.norm(own)
    if np.linalg.norm(found.errors) / np.linalg.norm(found.shape) > known:
        return fit
    strength = float(np.real(found.shape @ own) / (found.shape @ found.shape)) or float(np.abs(own).max())
    residues, errors, coherence = fit.residues.copy(), fit.residue_errors.copy(), fit.coherence.copy()
    residues[:, mode] = strength * found.shape
    errors[:, mode] = abs(strength) * found.errors
    coherence[:, mode] = np.maximum(coherence[:, mode], found.quality)
    omega, zeta, covariance = fit.angular_frequencies.copy(), fit.damping_ratios.copy(), fit.covariance.copy()
    modes, freedom = omega.size, fit.freedom.copy()
    if found.damping_error / found.damping_ratio < np.sqrt(covariance[modes + mode, modes + mode]):
        omega[mode], zeta[mode] = found.angular_frequency, found.damping_ratio
        for place, error in ((mode, found.damping_error), (modes + mode, found.damping_error / found.damping_ratio)):
            covariance[place, :] = covariance[:, place] = 0.0
            covariance[place, place] = error**2
            freedom[place : place + 1] = np.inf
    return replace(
        fit,
        angular_frequencies=omega,
        damping_ratios=zeta,
        covariance=covariance,
        freedom=freedom,
        residues=residues,
        residue_errors=errors,
        coherence=coherence,
    )
