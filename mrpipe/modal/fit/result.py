"""Result of a multi-mode fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.records import Place, Sensor
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum


@dataclass(frozen=True)
class MultiModeFit:
    """Result of :func:`fit_modes`; modes in rising order.

    Attributes
    ----------
    angular_frequencies, damping_ratios
        Shape (r,) [rad/s], [1].
    covariance
        Shape (2r, 2r) of (ln omega, ln zeta), robust to residuals that are not white.
    residues
        Shape (n, r) complex: amplitude of mode r at sensor i in acceleration over the first input, its phase referred
        to that of a proportionally damped frame (0 or pi). With several inputs: the mode's shape times its
        participation in the first input that excites it most.
    residue_errors
        Shape (n, r): standard error of the residues due to noise of the responses. Noise of the excitation scales all
        residues of a mode alike and does not change its shape.
    coherence
        Shape (n, r): share of the response near the peak that the excitation and the ends of the record explain.
    steady, measured
        One entry per test, shape (m, s): H U of the fit, and the measured response without its transient part. Columns
        are the sensors of the test.
    omega
        One entry per test, shape (m,) [rad/s].
    excitation
        One entry per test, shape (m,): the first input of the test.
    noise_variance
        Shape (n,): variance of a spectral line far from the peaks.
    sensors
        Place and kind of each row of `residues`.
    inputs
        Places of the inputs.
    participations
        Shape (k, r) complex: participation of a mode in an input, relative to the input of `residues`.
    input_residues
        Shape (n, k, r) complex: the residues of each input; nan if no test has this sensor and this input.
    spectra
        The spectra that were fitted.
    transients
        One entry per test, shape (m, s): contribution of the ends of the record.
    freedom
        Shape (2r,): degrees of freedom of the standard errors in `covariance`; empty if all of them come from many
        lines.
    other_poles
        Shape (2, q): angular frequencies [rad/s] and damping ratios of fitted poles that are not modes.
    """

    angular_frequencies: FloatArray
    damping_ratios: FloatArray
    covariance: FloatArray
    residues: ComplexArray
    residue_errors: FloatArray
    coherence: FloatArray
    steady: tuple[ComplexArray, ...]
    measured: tuple[ComplexArray, ...]
    omega: tuple[FloatArray, ...]
    excitation: tuple[ComplexArray, ...]
    noise_variance: FloatArray
    sensors: tuple[Sensor, ...] = ()
    inputs: tuple[Place, ...] = ()
    participations: ComplexArray = field(default_factory=lambda: np.ones((1, 1), dtype=np.complex128))
    input_residues: ComplexArray = field(default_factory=lambda: np.ones((1, 1, 1), dtype=np.complex128))
    spectra: tuple[RecordSpectrum, ...] = ()
    transients: tuple[ComplexArray, ...] = ()
    freedom: FloatArray = field(default_factory=lambda: np.empty(0))
    other_poles: FloatArray = field(default_factory=lambda: np.empty((2, 0)))

    def mode_coherence(self) -> FloatArray:
        """Return the coherence at each peak, shape (r,): mean over floors, weighted by the squared shape."""
        weight = np.abs(self.residues) ** 2
        return np.asarray(np.sum(weight * self.coherence, axis=0) / np.maximum(np.sum(weight, axis=0), 1e-300))

    def only(self, modes: Sequence[int]) -> MultiModeFit:
        """Return the fit with the poles of `modes` as modes (the steady response keeps all, `other_poles` the rest)."""
        index = np.asarray(modes, dtype=np.int64)
        count = self.angular_frequencies.size
        both = np.concatenate([index, index + count])
        rest = np.setdiff1d(np.arange(count), index)
        left = np.array([self.angular_frequencies[rest], self.damping_ratios[rest]])
        return replace(
            self,
            angular_frequencies=self.angular_frequencies[index],
            damping_ratios=self.damping_ratios[index],
            covariance=self.covariance[np.ix_(both, both)],
            freedom=self.freedom[both] if self.freedom.size else self.freedom,
            residues=self.residues[:, index],
            residue_errors=self.residue_errors[:, index],
            coherence=self.coherence[:, index],
            participations=self.participations[:, index],
            input_residues=self.input_residues[:, :, index],
            other_poles=np.hstack([self.other_poles, left]),
        )

    def residual(self) -> ComplexArray:
        """Return the part that neither excitation nor transients explain, all tests in one column, shape (sum m, n).

        Zero where a test does not have a sensor.
        """
        parts = []
        for item, measured, steady in zip(self.spectra, self.measured, self.steady, strict=True):
            part = np.zeros((item.omega.size, len(self.sensors)), dtype=np.complex128)
            part[:, [self.sensors.index(sensor) for sensor in item.sensors]] = measured - steady
            parts.append(part)
        return np.vstack(parts)
