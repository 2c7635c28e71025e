"""Poles fitted with separate residues of each test, if tests contradict common residues.

Cross-talk, cables and mounts differ between tests. A fit with common residues then leaves a part of every strong mode
in the residual. This part is not noise. It shifts a hidden mode next to a strong one by more than its interval. With
separate residues for each test, the differences between the tests no longer affect the poles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.covariance import clustered_covariance, pole_covariance
from mrpipe.modal.fit.information import information, poles_of_fit, weighted
from mrpipe.modal.fit.multimode import collected, fitted_poles, rising
from mrpipe.modal.fit.projected import ProjectedFit
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.spectra import RecordSpectrum

Cleaning = Callable[[ProjectedFit, FloatArray, Sequence[RecordSpectrum]], Sequence[RecordSpectrum]]
"""Returns spectra without an error of the sensors, from a fit with separate residues of each test and its poles."""

_PASSES = 2
_EVALUATIONS = 10
_ROUNDS = 4
"""Largest number of alternations between the poles and the errors of the sensors."""
_SETTLED = 0.1
"""Change of the poles over their standard errors below which the alternation ends."""
_SAME = 0.005
"""Largest relative change of a frequency for the same mode in another fit."""


def with_own_residues(fit: MultiModeFit, cleaning: Cleaning | None = None) -> MultiModeFit:
    """Return the fit with poles that give each test separate residues, and the errors of all poles by clusters.

    Separate residues are used if the Bayesian information criterion supports them. The shapes remain those of common
    residues at these poles. With one test, or without support, the poles are unchanged. Poles that are not modes are
    included, because their response would otherwise be attributed to the modes (:func:`poles_of_fit`).

    Parameters
    ----------
    fit
        A fit with shared residues.
    cleaning
        Removes an error of the sensors that the residual of the fit shows, such as cross-talk. The poles are then those
        of the cleaned spectra.
    """
    modes = fit.angular_frequencies.size
    start = poles_of_fit(fit, fit.spectra)
    shared, own = (weighted(fit.spectra, start, separate) for separate in (False, True))
    chosen, theta, separate = shared, start, False
    if len(fit.spectra) > 1 and information(own, start) < information(shared, start):
        moved = fitted_poles(own, start, _PASSES, _EVALUATIONS)
        if np.abs(moved[:modes] - start[:modes]).max() <= _SAME:
            chosen, theta, separate = own, moved, True
    if cleaning is not None:
        chosen, theta = _cleaned(fit.spectra, cleaning, chosen, theta, separate)
    covariance, freedom = clustered_covariance(chosen, theta)
    places = rising(theta)
    both = np.concatenate([places, places + places.size])
    whole = replace(
        collected(shared, fit.spectra, theta), covariance=covariance[np.ix_(both, both)], freedom=freedom[both]
    )
    return whole.only(np.flatnonzero(places < modes).tolist())


def _cleaned(
    spectra: Sequence[RecordSpectrum], cleaning: Cleaning, fit: ProjectedFit, theta: FloatArray, separate: bool
) -> tuple[ProjectedFit, FloatArray]:
    """Return the fit of cleaned spectra and its poles; poles and the errors of the sensors are estimated in turn."""
    for _ in range(_ROUNDS):
        clean = cleaning(weighted(spectra, theta, separate=True), theta, spectra)
        if all(np.array_equal(new.responses, old.responses) for new, old in zip(clean, spectra, strict=True)):
            break
        other = weighted(clean, theta, separate)
        moved = fitted_poles(other, theta, _PASSES, _EVALUATIONS)
        modes = theta.size // 2
        if np.abs(moved[:modes] - theta[:modes]).max() > _SAME:
            break
        change = np.abs(moved - theta) / np.sqrt(np.diag(pole_covariance(other, moved)))
        fit, theta = other, moved
        if change.max() < _SETTLED:
            break
    return fit, theta
