"""Agreement of the tests of a fit: natural frequencies of each test alone, compared over the tests.

A structure that was changed between tests, or that was warmer or wetter, has other frequencies. A common fit then takes
means, and its damping ratios are too large because two peaks are fitted as one wide peak. The natural frequencies of
each test alone are compared by chi-square. A difference counts only if it is also large enough to disturb the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.covariance import clustered_covariance
from mrpipe.modal.fit.information import weighted
from mrpipe.modal.fit.multimode import collected, fitted_poles
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.words import in_percent, listed

_LEVEL = 1e-3
"""Probability that tests of one structure are found to differ, over all modes."""
_DISTURBING = 0.04
"""Difference of a frequency over its damping ratio that changes the fitted response by about 3 %: a fiftieth of the
half-power bandwidth."""
_PASSES = 2
_EVALUATIONS = 10
_NORMAL_95 = 1.959964
_LARGEST_ERROR = 0.01
"""Relative standard error of a frequency above which a test does not show a mode."""


@dataclass(frozen=True)
class PolesOfTests:
    """Poles of each of T tests alone.

    Attributes
    ----------
    values, errors
        (ln omega, ln zeta) of each test, and standard errors, shape (T, 2r). Where few clusters determine an error, it
        is increased.
    """

    values: FloatArray
    errors: FloatArray

    @property
    def modes(self) -> int:
        """Number of modes r."""
        return int(self.values.shape[1] // 2)

    def frequencies(self, kept: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Return ln omega of some tests and its errors, shape (len(kept), r) each; infinite errors for hidden modes."""
        errors = self.errors[list(kept), : self.modes]
        return self.values[list(kept), : self.modes], np.where(errors > _LARGEST_ERROR, np.inf, errors)

    def differ(self, kept: Sequence[int]) -> bool:
        """Return whether some of the tests contradict each other in a frequency."""
        return bool(self.deviations(kept).max(initial=0.0) > 0.0)

    def deviations(self, kept: Sequence[int]) -> FloatArray:
        """Return ln omega of some tests minus its mean, (len(kept), r); zero for modes on which they agree."""
        values, errors = self.frequencies(kept)
        weight = 1.0 / errors**2
        mean = np.sum(weight * values, axis=0) / np.maximum(weight.sum(axis=0), 1e-300)
        apart = np.where(weight > 0.0, values - mean, 0.0)
        freedom = np.maximum(np.count_nonzero(weight, axis=0) - 1, 0)
        significant = np.sum(weight * apart**2, axis=0) > stats.chi2.ppf(
            1.0 - _LEVEL / self.modes, np.maximum(freedom, 1)
        )
        zeta = np.exp(np.median(self.values[list(kept), self.modes :], axis=0))
        counts = (freedom > 0) & significant & (np.ptp(apart, axis=0) > _DISTURBING * zeta)
        return np.where(counts, np.abs(apart), 0.0)


def poles_of_tests(fit: MultiModeFit) -> PolesOfTests | None:
    """Return the poles of each test alone, from those of the common fit; None for a single test."""
    if len(fit.spectra) < 2:
        return None
    modes = fit.angular_frequencies.size
    values, errors = [], []
    for spectrum in fit.spectra:
        omega, zeta = fit.other_poles
        kept = (omega >= spectrum.omega[0]) & (omega <= spectrum.omega[-1])
        start = np.log(np.concatenate([fit.angular_frequencies, omega[kept], fit.damping_ratios, zeta[kept]]))
        own = weighted([spectrum], start)
        theta = fitted_poles(own, start, _PASSES, _EVALUATIONS)
        covariance, freedom = clustered_covariance(own, theta)
        index = [*range(modes), *(theta.size // 2 + i for i in range(modes))]
        few = stats.t.ppf(1.0 - _LEVEL, freedom[index]) / stats.norm.ppf(1.0 - _LEVEL)
        values.append(theta[index])
        errors.append(np.sqrt(np.diag(covariance))[index] * few)
    return PolesOfTests(np.array(values), np.array(errors))


def poles_of_searches(fits: Sequence[MultiModeFit]) -> PolesOfTests:
    """Return the poles of tests whose modes were searched in each test alone.

    Parameters
    ----------
    fits
        A fit of each test, with the same modes in the same order.
    """
    values = [np.log(np.concatenate([fit.angular_frequencies, fit.damping_ratios])) for fit in fits]
    return PolesOfTests(np.array(values), np.array([np.sqrt(np.diag(fit.covariance)) for fit in fits]))


def odd_tests(poles: PolesOfTests) -> tuple[int, ...] | None:
    """Return the tests (from 0) that contradict a majority of agreeing tests; None where no majority agrees."""
    kept = list(range(poles.values.shape[0]))
    while poles.differ(kept):
        if len(kept) <= 2:
            return None
        # the test whose absence leaves the least contradiction
        rests = [[test for test in kept if test != left] for left in kept]
        kept = min(rests, key=lambda rest: float(poles.deviations(rest).max()))
    if 2 * len(kept) <= poles.values.shape[0]:
        return None
    return tuple(test for test in range(poles.values.shape[0]) if test not in kept)


def own_fits(fit: MultiModeFit, poles: PolesOfTests) -> list[MultiModeFit]:
    """Return a fit of each test with its own poles."""
    found = []
    for spectrum, theta in zip(fit.spectra, poles.values, strict=True):
        found.append(collected(weighted([spectrum], theta), [spectrum], theta))
    return found


def with_spread(fit: MultiModeFit, poles: PolesOfTests) -> MultiModeFit:
    """Return a fit whose poles are the means of the tests, with errors whose 95 % intervals contain all tests."""
    errors = np.where(np.isfinite(poles.errors), np.maximum(poles.errors, 1e-12), 1e3)
    weight = 1.0 / errors**2
    mean = np.sum(weight * poles.values, axis=0) / weight.sum(axis=0)
    apart = np.where(errors < 0.3, np.abs(poles.values - mean), 0.0).max(axis=0)
    spread = 1.0 / np.sqrt(weight.sum(axis=0)) + apart / _NORMAL_95
    old = np.sqrt(np.diag(fit.covariance))
    spread = np.maximum(spread, old)
    modes = poles.modes
    renewed = collected(weighted(fit.spectra, mean), fit.spectra, mean)
    scale = spread / old
    # the order of the modes is that of the common fit, because the differences are small
    return replace(
        fit,
        angular_frequencies=np.exp(mean[:modes]),
        damping_ratios=np.exp(mean[modes:]),
        covariance=fit.covariance * np.outer(scale, scale),
        freedom=np.full(2 * modes, np.inf),
        residues=renewed.residues,
        residue_errors=np.maximum(renewed.residue_errors, fit.residue_errors),
        participations=renewed.participations,
        input_residues=renewed.input_residues,
    )


def with_reach(fit: MultiModeFit, poles: PolesOfTests) -> MultiModeFit:
    """Return the fit of some tests with errors whose 95 % intervals also contain the poles of the other tests."""
    own = np.log(np.concatenate([fit.angular_frequencies, fit.damping_ratios]))
    old = np.sqrt(np.diag(fit.covariance))
    scale = 1.0 + np.abs(poles.values - own).max(axis=0) / _NORMAL_95 / old
    return replace(fit, covariance=fit.covariance * np.outer(scale, scale), freedom=np.full(own.size, np.inf))


def difference(names: Sequence[str], poles: PolesOfTests, odd: Sequence[int] | None) -> str:
    """Return which tests differ, in which mode most, and by how much.

    Parameters
    ----------
    names
        Names of the tests.
    poles
        Poles of the tests.
    odd
        Result of :func:`odd_tests`.
    """
    every = list(range(len(names)))
    most = poles.deviations(every)
    mode = int(np.argmax(most.max(axis=0)))
    values = poles.values[:, mode]
    zeta = np.exp(poles.values[:, poles.modes + mode])
    if odd:
        rest = [test for test in every if test not in odd]
        usual = float(np.exp(np.median(values[rest])))
        who = listed(
            [f"{names[test]} ({in_percent(np.exp(values[test]) / usual - 1.0, 2, signed=True)})" for test in odd]
        )
        return f"the natural frequencies of test {who} differ from those of the other tests (mode {mode + 1})"
    each = listed(
        [
            f"{np.exp(values[test]) / (2.0 * np.pi):.5g} Hz and {in_percent(zeta[test], digits=2)} in {names[test]}"
            for test in every
        ]
    )
    return f"the tests do not agree on the modes (frequency and damping ratio of mode {mode + 1}: {each})"
