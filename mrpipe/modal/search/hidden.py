"""Search for the modes that are still missing, with all lines of the spectra.

The first search uses a part of the lines, because that is enough for modes with a peak. A mode that the shaker hardly
excites shows only when all lines are used and the clocks of the sensors are correct.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.modal.fit.information import poles_of_fit
from mrpipe.modal.fit.multimode import fit_modes, rising
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.forced_modes import ModeSearch, bands_to_try
from mrpipe.modal.search.pursuit import sets_of_poles
from mrpipe.modal.search.selection import (
    Layout,
    all_floors_measured,
    certainty,
    contradictory_phases,
    contradicts,
    largest_set,
    resolved_set,
)
from mrpipe.modal.spectra import RecordSpectrum, record_spectrum, thinned

_LINES = 24000
_ROUNDS = 2
_SPARE = 2
_SETS = 2
"""Number of sets of hidden poles that are tried, because the best pole of a gap may be the residual of a strong mode.
"""
_BAND = 1.25
_UNCERTAIN = 0.02
"""Relative standard error of a damping ratio above which all lines are used, and a mode may be replaced."""
_SAME = 0.005
"""Largest relative change of a frequency for the same mode in another fit."""


def with_missing_modes(
    search: ModeSearch, tests: Sequence[FrameTest], layout: Layout, high_hz: float = 0.0
) -> ModeSearch:
    """Return the modes plus those that all lines of the spectra show in addition, if there are any.

    Missing modes are first searched up to a little above the known modes, then up to the end of the excitation of each
    test. The band of the modes found may end below a missing mode.

    Parameters
    ----------
    search
        Modes found so far, fewer than floors.
    tests
        The forced tests of the fit, clocks corrected.
    layout
        Floors and masses.
    high_hz
        Upper end of the band [Hz] set by the user; 0 means the end of the excitation.
    """
    best = search
    ends = sorted(high for _, high in bands_to_try(tests, search.band_hz[0], high_hz))
    for _ in range(_ROUNDS):
        missing = layout.floors - len(best.numbers)
        if missing <= 0:
            break
        near = _BAND * float(best.fit.angular_frequencies[-1]) / (2.0 * np.pi)
        found = None
        # where one test ends below another, its noise beyond its own excitation would disturb the search
        for top in [min(ends[-1], near), *(end for end in ends if end > near)]:
            wide = replace(best, band_hz=(best.band_hz[0], top))
            found = found or _with_more(wide, _spectra(wide, tests, top), layout, missing)
        if found is None:
            break
        best = found
    return best if len(best.numbers) > len(search.numbers) else search


def contested(search: ModeSearch, tests: Sequence[FrameTest], layout: Layout) -> ModeSearch:
    """Return a complete set of modes; an uncertain mode is replaced if the data support another one better.

    If the damping ratio of a mode is uncertain, its pole may be spurious, while the search has not tried the true mode.
    The poles that the residual supports are fitted together with the modes. The set of modes is chosen again, by
    certainty. A different set is taken only if its least certain mode is more certain.

    Parameters
    ----------
    search
        As many modes as floors.
    tests
        The forced tests of the fit, clocks corrected.
    layout
        Floors and masses.
    """
    if certainty(search.fit).min() > 1.0 / _UNCERTAIN:
        return search
    spectra = _spectra(search, tests)
    known, fits = _with_hidden(search, spectra, _SPARE)
    fit = next(fits, None)
    if fit is None:
        return search
    numbered = _chosen(fit, layout)
    same = all(_is_among(omega, known) for omega in fit.angular_frequencies[list(numbered)])
    if len(numbered) < layout.floors or same:
        return search
    other = _refitted(search, spectra, fit, numbered, layout)
    if other is None or len(other.numbers) < layout.floors:
        return search
    return other if certainty(other.fit).min() > certainty(known).min() else search


def _is_among(omega: float, fit: MultiModeFit) -> bool:
    return bool(np.abs(fit.angular_frequencies / omega - 1.0).min() < _SAME)


def sharpened(search: ModeSearch, tests: Sequence[FrameTest]) -> ModeSearch:
    """Return the modes fitted to all lines of the spectra if a damping ratio is uncertain; else the same modes.

    A part of the lines is sufficient for modes with a peak, but not for a mode that hardly exceeds the noise.
    """
    modes = search.fit.angular_frequencies.size
    uncertain = float(np.sqrt(np.diag(search.fit.covariance)[modes:].max())) > _UNCERTAIN
    spectra = _spectra(search, tests)
    used = sum(item.omega.size for item in search.fit.spectra)
    if not uncertain or sum(item.omega.size for item in spectra) < 1.3 * used:
        return search
    start = poles_of_fit(search.fit, spectra)
    places = rising(start)
    omega, zeta = np.exp(start.reshape(2, -1))
    whole = fit_modes(spectra, omega, zeta, passes=2, evaluations=8, near=True)
    fit = whole.only(np.flatnonzero(places < modes).tolist())
    near = np.abs(fit.angular_frequencies / search.fit.angular_frequencies - 1.0) < _SAME
    return replace(search, fit=fit) if near.all() else search


def _spectra(search: ModeSearch, tests: Sequence[FrameTest], top_hz: float = np.inf) -> tuple[RecordSpectrum, ...]:
    """Return the spectra of the tests up to `top_hz`; default: up to a little above the highest mode."""
    if not np.isfinite(top_hz):
        top_hz = min(search.band_hz[1], _BAND * float(search.fit.angular_frequencies[-1]) / (2.0 * np.pi))
    return thinned([record_spectrum(test, (search.band_hz[0], top_hz)) for test in tests], _LINES)


def _with_hidden(
    search: ModeSearch, spectra: Sequence[RecordSpectrum], number: int
) -> tuple[MultiModeFit, Iterator[MultiModeFit]]:
    """Return the fit of the modes found, and fits with up to `number` hidden poles: of each set of poles one."""
    known = fit_modes(
        spectra, search.fit.angular_frequencies, search.fit.damping_ratios, passes=2, evaluations=4, near=True
    )
    band = (2.0 * np.pi * 1.05 * search.band_hz[0], 0.99 * float(max(item.omega[-1] for item in spectra)))

    def fits() -> Iterator[MultiModeFit]:
        for extra in sets_of_poles(known, band, number)[:_SETS]:
            omega = np.concatenate([known.angular_frequencies, [item.angular_frequency for item in extra]])
            zeta = np.concatenate([known.damping_ratios, [item.damping_ratio for item in extra]])
            yield _plausible(fit_modes(spectra, omega, zeta, passes=2, evaluations=10, near=True), known)

    return known, fits()


def _plausible(fit: MultiModeFit, known: MultiModeFit) -> MultiModeFit:
    """Return the fit without new poles that are beyond its lines or have contradictory phases."""
    fit = _in_band(fit)
    phases = contradictory_phases(fit)
    kept = [i for i, omega in enumerate(fit.angular_frequencies) if not phases[i] or _is_among(omega, known)]
    return fit.only(kept)


def _in_band(fit: MultiModeFit) -> MultiModeFit:
    """Return the fit without poles beyond its lines, because such a pole represents all modes there."""
    lines = np.concatenate([item.omega for item in fit.spectra])
    omega = fit.angular_frequencies
    return fit.only(np.flatnonzero((omega >= lines.min()) & (omega <= lines.max())).tolist())


def _with_more(
    search: ModeSearch, spectra: Sequence[RecordSpectrum], layout: Layout, missing: int
) -> ModeSearch | None:
    """Return a larger set of modes; None where the spectra support none."""
    for fit in _with_hidden(search, spectra, missing + _SPARE)[1]:
        numbered = _chosen(fit, layout)
        if len(numbered) > len(search.numbers):
            found = _refitted(search, spectra, fit, numbered, layout)
            if found is not None and len(found.numbers) > len(search.numbers):
                return found
    return None


def _chosen(fit: MultiModeFit, layout: Layout) -> dict[int, int]:
    """Return pole -> mode number (from 1), by the signs of shapes or, if they are not sufficient, by resolved poles."""
    numbered = largest_set(fit, layout, certainty(fit))
    if len(numbered) >= layout.floors or all_floors_measured(fit, layout):
        return numbered
    return resolved_set(fit, layout) or numbered


def _refitted(
    search: ModeSearch, spectra: Sequence[RecordSpectrum], fit: MultiModeFit, numbered: dict[int, int], layout: Layout
) -> ModeSearch | None:
    """Fit the modes without the poles that are not modes; None if one of them then becomes doubtful."""
    keep = sorted(numbered)
    omega, zeta = fit.angular_frequencies[keep], fit.damping_ratios[keep]
    refined = _plausible(fit_modes(spectra, omega, zeta, passes=2, evaluations=10, near=True), search.fit)
    again = _chosen(refined, layout)
    if contradicts(refined, layout) or len(again) < len(keep):
        return None
    return replace(search, fit=refined.only(sorted(again)), numbers=tuple(again[pole] for pole in sorted(again)))
