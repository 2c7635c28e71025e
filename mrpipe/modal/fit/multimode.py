"""Multi-mode fit of whole-record spectra with leakage modelled: poles by variable projection, the rest linear.

In a record of finite length the spectrum of a response is exactly Y = H U + T, where the transient T is due to the
state of the modes at the beginning and the end of the record, and has the poles of H. Frames with damping ratios of 0.1
% vibrate for longer than a test lasts, so that T is as large as H U at the peaks. Averaging with windows would broaden
both and give too large damping ratios.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.modal.fit.covariance import pole_covariance
from mrpipe.modal.fit.projected import ProjectedFit
from mrpipe.modal.fit.rank_one import rank_one
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import Sensor
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum, all_inputs, all_sensors

FREQUENCY_RANGE = 0.03
"""The logarithm of a frequency is searched within this distance from that of its first guess."""

MOST_DAMPING = 0.5
"""Largest damping ratio of the search."""

INSIDE = 0.99
"""A number that reaches this share of its bound is at the bound."""


def _coherence(
    spectra: Sequence[RecordSpectrum],
    sensors: Sequence[Sensor],
    steady: Sequence[ComplexArray],
    measured: Sequence[ComplexArray],
    poles: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Return the share of each sensor's response near each peak that the excitation explains, shape (n, r)."""
    error, power = np.zeros((2, len(sensors), poles[0].size))
    omega = np.concatenate([item.omega for item in spectra])
    step = 6.0 * float(np.median(np.diff(omega)))
    for item, explained, seen in zip(spectra, steady, measured, strict=True):
        rows = [sensors.index(sensor) for sensor in item.sensors]
        for index, (peak, ratio) in enumerate(zip(*poles, strict=True)):
            near = np.abs(item.omega - peak) <= max(4.0 * ratio * peak, step)
            error[rows, index] += np.sum(np.abs(seen[near] - explained[near]) ** 2, axis=0)
            power[rows, index] += np.sum(np.abs(seen[near]) ** 2, axis=0)
    return np.asarray(np.clip(1.0 - error / np.maximum(power, 1e-300), 0.0, 1.0))


def fit_modes(
    spectra: Sequence[RecordSpectrum],
    angular_frequencies: FloatArray,
    damping_ratios: FloatArray,
    *,
    passes: int = 3,
    evaluations: int = 30,
    near: bool = False,
) -> MultiModeFit:
    """Fit the modes of all outputs of all tests together, from a first guess of the poles.

    Parameters
    ----------
    spectra
        Whole-record spectra, each test with the same outputs and the same place of excitation.
    angular_frequencies, damping_ratios
        First guess, shape (r,).
    passes
        Number of fits; each has weights from the residuals of the fit before.
    evaluations
        Largest number of evaluations of a pass.
    near
        Whether the first pass has weights from the residuals of the guess, so that strong peaks do not dominate a mode
        without a peak.
    """
    order = np.argsort(angular_frequencies)
    guess = np.concatenate([np.log(angular_frequencies[order]), np.log(np.clip(damping_ratios[order], 1e-5, 0.3))])
    fit = ProjectedFit(spectra, angular_frequencies.size)
    if near:
        fit.renew_weights(guess)
    return collected(fit, spectra, fitted_poles(fit, guess, passes, evaluations))


def fit_again(
    spectra: Sequence[RecordSpectrum], before: MultiModeFit, *, passes: int, evaluations: int
) -> MultiModeFit:
    """Fit modes to changed spectra from their poles; only their residues if a pole leaves its mode.

    A pole whose frequency or damping ratio ends at the bound of the search no longer describes its mode: it follows
    what modes that are missing in the fit leave.

    Parameters
    ----------
    spectra
        Changed spectra.
    before
        Fit of the spectra before the change.
    passes, evaluations
        As for :func:`fit_modes`.
    """
    omega, zeta = before.angular_frequencies, before.damping_ratios
    found = fit_modes(spectra, omega, zeta, passes=passes, evaluations=evaluations)
    moved = np.abs(np.log(found.angular_frequencies / omega))
    if np.all(moved < INSIDE * FREQUENCY_RANGE) and np.all(found.damping_ratios < INSIDE * MOST_DAMPING):
        return found
    theta = np.concatenate([np.log(omega), np.log(zeta)])
    fit = ProjectedFit(spectra, omega.size)
    fit.renew_weights(theta)
    return collected(fit, spectra, theta)


def fitted_poles(fit: ProjectedFit, guess: FloatArray, passes: int, evaluations: int) -> FloatArray:
    """Return theta = (ln omega, ln zeta) at the least cost, weights renewed from pass to pass."""
    theta, modes = guess, guess.size // 2
    lower = np.concatenate([guess[:modes] - FREQUENCY_RANGE, np.full(modes, np.log(1e-6))])
    upper = np.concatenate([guess[:modes] + FREQUENCY_RANGE, np.full(modes, np.log(MOST_DAMPING))])
    for index in range(passes):
        result = least_squares(
            lambda t: fit.compressed(t)[:, -1],
            theta,
            jac=lambda t: fit.compressed(t)[:, :-1],
            bounds=(lower, upper),
            max_nfev=evaluations,
            x_scale="jac",
            xtol=1e-7,
            ftol=1e-7,
        )
        theta = np.asarray(result.x)
        if index < passes - 1:
            fit.renew_weights(theta)
    return theta


def rising(theta: FloatArray) -> IntArray:
    """Return the indices of the poles in theta = (ln omega, ln zeta) in rising order of frequency, shape (r,)."""
    return np.argsort(theta[: theta.size // 2])


def collected(fit: ProjectedFit, spectra: Sequence[RecordSpectrum], theta: FloatArray) -> MultiModeFit:
    """Return the result of a fit with shared residues at theta, modes in rising order."""
    modes = theta.size // 2
    omega, zeta = np.exp(theta[:modes]), np.exp(theta[modes:])
    sensors, inputs = all_sensors(spectra), all_inputs(spectra)
    residues = np.full((len(sensors), len(inputs), modes), np.nan, dtype=np.complex128)
    steady, measured, transients = ([np.zeros_like(item.responses) for item in spectra] for _ in range(3))
    noise = np.empty(len(sensors))
    errors = np.full((len(sensors), len(inputs), modes), np.inf)
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        problem = group.problem
        own = [sensors.index(sensor) for sensor in group.sensors]
        raw = state.coefficients * group.sigma
        unit = fit.coefficient_errors(group, state)
        for number, place in enumerate(problem.inputs):
            column = inputs.index(place)
            for mode in range(modes):
                first = mode * problem.width + 2 * number
                # at the peak i omega/omega_r is i: the second coefficient turns the phase
                residues[own, column, mode] = raw[first] + 1j * raw[first + 1]
                errors[own, column, mode] = group.sigma * unit[first]
        noise[own] = 2.0 * group.sigma**2
        explained, rest = fit.steady(group, state), fit.complex_residual(group, state)
        start = 0
        for test in group.tests:
            part = slice(start, start + spectra[test].omega.size)
            columns = [spectra[test].sensors.index(sensor) for sensor in group.sensors]
            steady[test][:, columns] = explained[part]
            measured[test][:, columns] = explained[part] + rest[part]
            transients[test][:, columns] = group.target[part] - measured[test][:, columns]
            start = part.stop
    order = rising(theta)
    both = np.concatenate([order, modes + order])
    residues, errors = residues[:, :, order], errors[:, :, order]
    shapes, shape_errors, participations = rank_one(residues, errors)
    return MultiModeFit(
        angular_frequencies=omega[order],
        damping_ratios=zeta[order],
        covariance=pole_covariance(fit, theta)[np.ix_(both, both)],
        residues=shapes,
        residue_errors=shape_errors,
        coherence=_coherence(spectra, sensors, steady, measured, (omega[order], zeta[order])),
        steady=tuple(steady),
        measured=tuple(measured),
        omega=tuple(item.omega for item in spectra),
        excitation=tuple(item.excitation for item in spectra),
        noise_variance=noise,
        sensors=sensors,
        inputs=inputs,
        participations=participations,
        input_residues=residues,
        spectra=tuple(spectra),
        transients=tuple(transients),
    )
