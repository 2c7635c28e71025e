"""Search for modes that are hidden under the response of stronger ones.

A mode with the shaker near one of its nodes has no separate peak. It still leaves a coherent residual at all sensors
after the fit of the other modes. The search tries a pole at each frequency of a fine grid and takes the one that
reduces the residual of all tests and sensors most, judged by the Bayesian information criterion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.projection import Problem, stack
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum

_TRIAL_DAMPING = (0.003, 0.006, 0.012)
"""Damping ratios of the poles that are tried; one of them is within a factor of 1.4 of that of a mode of 0.2 to 1.7 %.
"""
_LEAST_LINES = 12
_NEIGHBOURS = 3
_HALF_WIDTHS = 6.0
"""A pole is judged by the lines within this number of half-power half-widths."""


@dataclass(frozen=True)
class HiddenPole:
    """A pole that explains part of the residual.

    Attributes
    ----------
    angular_frequency, damping_ratio
        [rad/s], [1]; the damping ratio is a trial value.
    gain
        Improvement of the information criterion; positive if the data support the pole.
    """

    angular_frequency: float
    damping_ratio: float
    gain: float


def _between(
    item: RecordSpectrum, residual: ComplexArray, low: float, high: float
) -> tuple[RecordSpectrum, ComplexArray]:
    first, last = np.searchsorted(item.omega, [low, high])
    part = slice(int(first), int(last))
    cut = RecordSpectrum(
        item.omega[part], item.excitations[part], item.inputs, item.responses[part], item.sensors, item.dt
    )
    return cut, residual[part]


def _residuals(fit: MultiModeFit) -> list[ComplexArray]:
    whole = fit.residual() / np.sqrt(fit.noise_variance)
    edges = np.cumsum([item.omega.size for item in fit.spectra])[:-1]
    return list(np.split(whole, edges))


def _gain(fit: MultiModeFit, residuals: Sequence[ComplexArray], omega: float, zeta: float) -> float:
    """Return the improvement of the criterion by a pole, from the lines around it."""
    half = _half_width(omega, zeta, _line(fit))
    pairs = [
        _between(item, residual, omega - half, omega + half)
        for item, residual in zip(fit.spectra, residuals, strict=True)
    ]
    pairs = [pair for pair in pairs if pair[0].omega.size >= _LEAST_LINES]
    if not pairs:
        return -np.inf
    problem = Problem([item for item, _ in pairs], 1, displacement=False)
    target = stack(np.vstack([residual for _, residual in pairs]))
    distance = np.abs(fit.angular_frequencies - omega)
    near = [int(i) for i in np.argsort(distance)[:_NEIGHBOURS] if distance[i] < 3.0 * half]
    known = [problem.mode_columns(float(fit.angular_frequencies[i]), float(fit.damping_ratios[i])) for i in near]
    smooth = np.concatenate([item.input_columns(problem.inputs) for item, _ in pairs])
    own = problem.mode_columns(omega, zeta)
    basis = _unit(stack(np.hstack([*known, smooth])))
    width = own.shape[1]
    if target.shape[0] < basis.shape[1] + 3 * width:
        return -np.inf
    q = np.linalg.qr(basis)[0]
    before = target - q @ (q.T @ target)
    # in a long record the transients of a weak mode are below the noise, so that they need no parameters
    driven = own[:, : 2 * len(problem.inputs)]
    # a mode has a real shape where damping is proportional and the clocks agree: one parameter for each sensor
    real = driven[:, ::2]
    return max(_improvement(before, _unit(stack(columns)), q) for columns in (real, driven, own))


def _improvement(before: FloatArray, added: FloatArray, q: FloatArray) -> float:
    """Return the improvement of the information criterion by columns that are added to a basis q."""
    added = added - q @ (q.T @ added)
    left, singular, _ = np.linalg.svd(added, full_matrices=False)
    left = left[:, singular > 1e-8]
    after = before - left @ (left.T @ before)
    # each sensor has its own local noise, because noise of the excitation is larger at a resonance
    first, second = np.sum(before**2, axis=0), np.sum(after**2, axis=0)
    seen = first > 0.0
    count = before.shape[0]
    likelihood = float(np.sum(count * np.log(first[seen] / np.maximum(second[seen], 1e-12 * first[seen]))))
    parameters = int(left.shape[1]) * int(seen.sum()) + 2
    return likelihood - parameters * float(np.log(count * int(seen.sum())))


def _unit(columns: FloatArray) -> FloatArray:
    norms = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(norms > 0.0, norms, 1.0))


def hidden_poles(fit: MultiModeFit, band_rad_s: tuple[float, float], number: int) -> list[HiddenPole]:
    """Return up to `number` poles that the residual of a fit supports, the best first, one between two known modes."""
    return next(iter(sets_of_poles(fit, band_rad_s, number)), [])


def sets_of_poles(fit: MultiModeFit, band_rad_s: tuple[float, float], number: int) -> list[list[HiddenPole]]:
    """Return sets of up to `number` poles that the residual of a fit supports.

    A set has at most one pole between two known modes, because residuals of a strong mode near its peak must not take
    all poles. The first set has the best pole of each gap. This pole may represent such a residual, so that the second
    set has the best pole that these lines do not explain, and so on.

    Parameters
    ----------
    fit
        Fit of the known modes.
    band_rad_s
        Band in which poles are tried [rad/s].
    number
        Largest number of poles of a set.
    """
    line = _line(fit)
    gaps: dict[int, list[HiddenPole]] = {}
    sets: list[list[HiddenPole]] = []
    for pole in sorted(_tried(fit, band_rad_s), key=lambda item: -item.gain):
        omega = pole.angular_frequency
        taken = gaps.setdefault(int(np.searchsorted(fit.angular_frequencies, omega)), [])
        explained = any(
            abs(omega - other.angular_frequency) < _half_width(other.angular_frequency, other.damping_ratio, line)
            for other in taken
        )
        if pole.gain <= 0.0 or explained:
            continue
        taken.append(pole)
        if len(taken) > len(sets):
            sets.append([])
        if len(sets[len(taken) - 1]) < number:
            sets[len(taken) - 1].append(pole)
    return sets


def _tried(fit: MultiModeFit, band_rad_s: tuple[float, float]) -> list[HiddenPole]:
    """Return a pole at each frequency of a fine grid that is not at a known mode."""
    residuals = _residuals(fit)
    tried: list[HiddenPole] = []
    for zeta in _TRIAL_DAMPING:
        steps = int(np.log(band_rad_s[1] / band_rad_s[0]) / zeta)
        for omega in np.geomspace(*band_rad_s, max(steps, 2)):
            distance = np.abs(fit.angular_frequencies - omega)
            if np.all(distance > np.maximum(fit.damping_ratios * fit.angular_frequencies, 0.002 * omega)):
                tried.append(HiddenPole(float(omega), zeta, _gain(fit, residuals, float(omega), zeta)))
    return tried


def _half_width(omega: float, zeta: float, line: float) -> float:
    """Return half the width of the lines that judge a pole [rad/s]; `line` is the distance of two lines [rad/s]."""
    return max(_HALF_WIDTHS * zeta * omega, _LEAST_LINES * line)


def _line(fit: MultiModeFit) -> float:
    """Return the distance of two lines of the coarsest spectrum [rad/s]."""
    return max(float(np.median(np.diff(item.omega))) for item in fit.spectra)
