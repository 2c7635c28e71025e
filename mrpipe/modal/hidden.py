"""Search for the modes that are still missing, with all lines of the spectra.

The first search uses a part of the lines, because that is enough for modes with a peak. A mode that the shaker hardly
excites shows only when all lines are used and the clocks of the sensors are correct.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.modal.multimode import MultiModeFit, fit_modes
from mrpipe.modal.pursuit import hidden_poles
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search import ModeSearch
from mrpipe.modal.selection import Layout, contradicts, largest_set
from mrpipe.modal.spectra import RecordSpectrum, record_spectrum, thinned

_LINES = 24000
_ROUNDS = 2
_SPARE = 2
_BAND = 1.25
_UNCERTAIN = 0.02
"""Relative standard error of a damping ratio from which all lines are used."""
_SAME = 0.005
"""Relative change of a frequency up to which a fit has found the same mode again."""


def with_missing_modes(search: ModeSearch, tests: Sequence[FrameTest], layout: Layout) -> ModeSearch:
    """Return the modes with those added that all lines of the spectra show; the same modes where there are none.

    Parameters
    ----------
    search
        Modes found so far, fewer than floors.
    tests
        The forced tests of the fit, clocks corrected.
    layout
        Floors and masses.
    """
    best = search
    for _ in range(_ROUNDS):
        missing = layout.floors - len(best.numbers)
        if missing <= 0:
            break
        found = _with_more(best, tests, layout, missing)
        if found is None or len(found.numbers) <= len(best.numbers):
            break
        best = found
    return best


def sharpened(search: ModeSearch, tests: Sequence[FrameTest]) -> ModeSearch:
    """Return the modes fitted to all lines of the spectra where a damping ratio is uncertain; else the same modes.

    A part of the lines is enough for modes with a peak. It wastes data on a mode that hardly rises above the noise.
    """
    modes = search.fit.angular_frequencies.size
    uncertain = float(np.sqrt(np.diag(search.fit.covariance)[modes:].max())) > _UNCERTAIN
    spectra = _spectra(search, tests)
    used = sum(item.omega.size for item in search.fit.spectra)
    if not uncertain or sum(item.omega.size for item in spectra) < 1.3 * used:
        return search
    fit = fit_modes(spectra, search.fit.angular_frequencies, search.fit.damping_ratios, passes=2, evaluations=8)
    near = np.abs(fit.angular_frequencies / search.fit.angular_frequencies - 1.0) < _SAME
    return replace(search, fit=fit) if near.all() else search


def _spectra(search: ModeSearch, tests: Sequence[FrameTest]) -> tuple[RecordSpectrum, ...]:
    top = _BAND * float(search.fit.angular_frequencies[-1]) / (2.0 * np.pi)
    band = (search.band_hz[0], min(search.band_hz[1], top))
    return thinned([record_spectrum(test, band) for test in tests], _LINES)


def _with_more(search: ModeSearch, tests: Sequence[FrameTest], layout: Layout, missing: int) -> ModeSearch | None:
    spectra = _spectra(search, tests)
    known = fit_modes(spectra, search.fit.angular_frequencies, search.fit.damping_ratios, passes=2, evaluations=4)
    band = (2.0 * np.pi * 1.05 * search.band_hz[0], 0.99 * float(max(item.omega[-1] for item in spectra)))
    extra = hidden_poles(known, band, missing + _SPARE)
    if not extra:
        return None
    omega = np.concatenate([known.angular_frequencies, [item.angular_frequency for item in extra]])
    zeta = np.concatenate([known.damping_ratios, [item.damping_ratio for item in extra]])
    fit = fit_modes(spectra, omega, zeta, passes=2, evaluations=10)
    numbered = largest_set(fit, layout)
    if len(numbered) <= len(search.numbers):
        return None
    return _refitted(search, spectra, fit, numbered, layout)


def _refitted(
    search: ModeSearch, spectra: Sequence[RecordSpectrum], fit: MultiModeFit, numbered: dict[int, int], layout: Layout
) -> ModeSearch | None:
    """Fit the modes without the poles that are not modes; None where that makes one of them doubtful."""
    keep = sorted(numbered)
    refined = fit_modes(spectra, fit.angular_frequencies[keep], fit.damping_ratios[keep], passes=2, evaluations=10)
    again = largest_set(refined, layout)
    if contradicts(refined, layout) or len(again) < len(keep):
        return None
    return replace(search, fit=refined.only(sorted(again)), numbers=tuple(again[pole] for pole in sorted(again)))
