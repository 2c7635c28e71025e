"""The information criterion of a fit, and the poles that are not modes but are supported by it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.projected import ProjectedFit
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.spectra import RecordSpectrum


def information(fit: ProjectedFit, theta: FloatArray) -> float:
    """Return the Bayesian information criterion of a fit with free noise of each sensor: smaller is better."""
    found = 0.0
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        rows = 2 * group.problem.total
        variance = np.mean(state.residual.reshape(rows, -1) ** 2, axis=0) * group.sigma**2
        # the weights scale the noise of each line
        found += rows * float(np.sum(np.log(np.maximum(variance, 1e-300))))
        found -= 4.0 * len(group.sensors) * float(np.sum(np.log(group.weight)))
        found += state.coefficients.size * float(np.log(rows))
    return found


def weighted(spectra: Sequence[RecordSpectrum], theta: FloatArray, separate: bool = False) -> ProjectedFit:
    """Return a fit with weights from its own residuals at theta = (ln omega, ln zeta); `separate`: residues by test."""
    fit = ProjectedFit(spectra, theta.size // 2, separate)
    fit.renew_weights(theta)
    fit.renew_weights(theta)
    return fit


def poles_of_fit(fit: MultiModeFit, spectra: Sequence[RecordSpectrum]) -> FloatArray:
    """Return theta = (ln omega, ln zeta) of the modes, then of those other poles that the spectra support.

    The response of a pole that is not a mode of the structure, such as that of its support, overlaps with the modes. A
    fit of the modes alone would attribute it to them. The other poles of `fit` are therefore included if they lie in
    the band and the Bayesian information criterion supports each of them.

    Parameters
    ----------
    fit
        A fit of which :meth:`MultiModeFit.only` kept the modes.
    spectra
        The spectra of the next fit.
    """
    omega, zeta = fit.other_poles
    band = min(item.omega[0] for item in spectra), max(item.omega[-1] for item in spectra)
    kept = [int(i) for i in np.flatnonzero((omega >= band[0]) & (omega <= band[1]))]

    def theta_of(others: list[int]) -> FloatArray:
        omegas = np.concatenate([fit.angular_frequencies, omega[others]])
        return np.asarray(np.log(np.concatenate([omegas, fit.damping_ratios, zeta[others]])))

    def criterion(others: list[int]) -> float:
        theta = theta_of(others)
        return information(weighted(spectra, theta), theta)

    best = criterion(kept) if kept else 0.0
    for pole in list(kept):
        fewer = [other for other in kept if other != pole]
        without = criterion(fewer)
        if without <= best:
            kept, best = fewer, without
    return theta_of(kept)
