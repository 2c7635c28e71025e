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
_LEAST_INDEPENDENCE = 1e-8
"""Least part of a unit column that the columns before it do not explain; below it a column adds nothing."""
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


def _gain(fit: MultiModeFit, residuals: Sequence[ComplexArray], omega: float, zeta: float, line: float) -> float:
    """Return the improvement of the criterion by a pole, from the lines around it; `line` is their distance [rad/s]."""
    half = _half_width(omega, zeta, line)
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
    inputs, width = len(problem.inputs), own.shape[1]
    basis = [*known, smooth]
    known_width = sum(item.shape[1] for item in basis)
    if target.shape[0] < known_width + 3 * width:
        return -np.inf
    # a mode has a real shape where damping is proportional and the clocks agree: one parameter for each sensor; in a
    # long record the transients of a weak mode are below the noise, so that they need no parameters
    driven = own[:, : 2 * inputs]
    columns = np.hstack([*basis, driven[:, ::2], driven[:, 1::2], own[:, 2 * inputs :]])
    return _improvement(target, _unit(stack(columns)), known_width, (inputs, 2 * inputs, width))


def _improvement(target: FloatArray, columns: FloatArray, known: int, counts: Sequence[int]) -> float:
    """Return the largest improvement of the information criterion by columns after the first `known` ones.

    The first 1, 2, ... of the further columns are tried together, as `counts` says. One orthogonal basis serves all of
    them, because each set contains the one before.
    """
    q, r = np.linalg.qr(columns)
    independent = np.abs(np.diag(r)) > _LEAST_INDEPENDENCE
    independent[:known] = True
    if not independent.all():
        # the basis vector of a dependent column is arbitrary, and so would be those after it
        q = np.zeros_like(columns)
        q[:, independent] = np.linalg.qr(columns[:, independent])[0]
    before = target - q[:, :known] @ (q[:, :known].T @ target)
    explained = np.cumsum(np.square(q[:, known:].T @ before), axis=0)
    # each sensor has its own local noise, because noise of the excitation is larger at a resonance
    first = np.sum(before**2, axis=0)
    seen = first > 0.0
    rows, sensors = before.shape[0], int(seen.sum())
    gains = []
    for count in counts:
        second = np.maximum(first - explained[count - 1], 1e-12 * first)[seen]
        likelihood = float(np.sum(rows * np.log(first[seen] / second)))
        parameters = int(independent[known : known + count].sum()) * sensors + 2
        gains.append(likelihood - parameters * float(np.log(rows * sensors)))
    return max(gains)


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
    residuals, line = _residuals(fit), _line(fit)
    tried: list[HiddenPole] = []
    for zeta in _TRIAL_DAMPING:
        steps = int(np.log(band_rad_s[1] / band_rad_s[0]) / zeta)
        for omega in np.geomspace(*band_rad_s, max(steps, 2)):
            distance = np.abs(fit.angular_frequencies - omega)
            if np.all(distance > np.maximum(fit.damping_ratios * fit.angular_frequencies, 0.002 * omega)):
                tried.append(HiddenPole(float(omega), zeta, _gain(fit, residuals, float(omega), zeta, line)))
    return tried


def _half_width(omega: float, zeta: float, line: float) -> float:
    """Return half the width of the lines that judge a pole [rad/s]; `line` is the distance of two lines [rad/s]."""
    return max(_HALF_WIDTHS * zeta * omega, _LEAST_LINES * line)


def _line(fit: MultiModeFit) -> float:
    """Return the distance of two lines of the coarsest spectrum [rad/s]."""
    return max(float(np.median(np.diff(item.omega))) for item in fit.spectra)
