"""Poles fitted with separate residues of each test, if tests contradict common residues.

Cross-talk, cables and mounts differ between tests. A fit with common residues then leaves a part of every strong mode
in the residual. This part is not noise. It shifts a hidden mode next to a strong one by more than its interval. With
residues of each test the contradiction disappears from the poles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrpipe.modal.fit.covariance import clustered_covariance
from mrpipe.modal.fit.information import information, poles_of_fit, weighted
from mrpipe.modal.fit.multimode import collected, fitted_poles, rising
from mrpipe.modal.fit.result import MultiModeFit

_PASSES = 2
_EVALUATIONS = 10
_SAME = 0.005
"""Largest relative change of a frequency for the same mode in another fit."""


def with_own_residues(fit: MultiModeFit) -> MultiModeFit:
    """Return the fit with poles that give each test separate residues, and the errors of all poles by clusters.

    Separate residues are used if the Bayesian information criterion supports them. The shapes remain those of common
    residues at these poles. With one test, or without support, the poles are unchanged. Poles that are not modes are
    included, because their response would otherwise be attributed to the modes (:func:`poles_of_fit`).

    Parameters
    ----------
    fit
        A fit with shared residues.
    """
    modes = fit.angular_frequencies.size
    start = poles_of_fit(fit, fit.spectra)
    shared, own = (weighted(fit.spectra, start, separate) for separate in (False, True))
    chosen, theta = shared, start
    if len(fit.spectra) > 1 and information(own, start) < information(shared, start):
        moved = fitted_poles(own, start, _PASSES, _EVALUATIONS)
        if np.abs(moved[:modes] - start[:modes]).max() <= _SAME:
            chosen, theta = own, moved
    covariance, freedom = clustered_covariance(chosen, theta)
    places = rising(theta)
    both = np.concatenate([places, places + places.size])
    whole = replace(
        collected(shared, fit.spectra, theta), covariance=covariance[np.ix_(both, both)], freedom=freedom[both]
    )
    return whole.only(np.flatnonzero(places < modes).tolist())
