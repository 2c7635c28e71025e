"""Finding the modes of a frame in its forced tests: stable poles, then hidden ones, then the choice among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.modal.fit.lscf import PoleCandidate, stable_poles
from mrpipe.modal.fit.matrix_fraction import matrix_orders, stable_matrix_poles
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.free_response import same_place, strongest_frequency, with_decays
from mrpipe.modal.search.pursuit import hidden_poles
from mrpipe.modal.search.selection import (
    LEAST_COHERENCE,
    Layout,
    certainty,
    complete_set,
    contradicts,
    largest_set,
    sound,
    strength,
)
from mrpipe.modal.spectra import RecordSpectrum, excited_band, record_spectrum, thinned

_USUAL_HIGH_HZ = 30.0
_SURPLUS = 4
_FEWEST_ORDERS = 5
"""Least number of orders of a matrix-fraction model that show which poles are stable."""
_LAST_BAND = 1.25
_ROUNDS = 3
_SEARCH_LINES = 2500
_FIT_LINES = 6000
_SAME_POLE = 0.02
"""Largest relative change of a frequency in the last fit for the same pole."""


@dataclass(frozen=True)
class ModeSearch:
    """Result of the search for modes.

    Attributes
    ----------
    fit
        Fit with the poles of the modes.
    band_hz
        Band of the fit [Hz].
    numbers
        Mode number (from 1) of each pole of the fit; 1, 2, ... n where the set is complete.
    candidates
        The stabilisation chart: poles that appear at several model orders.
    notes
        Messages for the user on the modes, one line each.
    """

    fit: MultiModeFit
    band_hz: tuple[float, float]
    numbers: tuple[int, ...]
    candidates: tuple[PoleCandidate, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Found:
    """A fit with more poles than needed, and the poles that are modes (empty if the set is not complete)."""

    fit: MultiModeFit
    keep: tuple[int, ...]
    spectra: tuple[RecordSpectrum, ...]
    band_hz: tuple[float, float]
    candidates: tuple[PoleCandidate, ...] = ()


def bands_to_try(tests: Sequence[FrameTest], low_hz: float, high_hz: float) -> list[tuple[float, float]]:
    """Return bands [Hz] in which modes are searched, narrow ones first if the excitation has a wide band.

    Parameters
    ----------
    tests
        Forced tests.
    low_hz, high_hz
        Settings of the user; 0 for `high_hz`: up to the end of the excitation.
    """
    nyquist = 0.5 * min(item.sampling_rate_hz for item in tests)
    if high_hz > 0.0:
        return [(low_hz, min(high_hz, 0.95 * nyquist))]
    tops = sorted(min(excited_band((test,))[1], 0.9 * nyquist) for test in tests)
    bands = []
    high = _USUAL_HIGH_HZ / 2.0
    while high < 0.8 * tops[-1] and tops[-1] > _USUAL_HIGH_HZ:
        bands.append(high)
        high *= 2.0
    # tests may have different bands; if nothing is found, a narrower band resolves close modes better
    narrower = [0.7 * tops[-1]] if len(tests) > 1 else []
    for top in [*tops, *narrower]:
        if all(abs(top - known) > 0.1 * known for known in bands):
            bands.append(top)
    return [(low_hz, high) for high in bands]


def _look(
    spectra: tuple[RecordSpectrum, ...],
    layout: Layout,
    band_hz: tuple[float, float],
    decays: Sequence[FrameTest] = (),
) -> _Found | None:
    """Fit stable poles; while the set of modes is not complete, fit less stable and hidden poles as well."""
    modes = layout.modes
    whole, spectra = spectra, thinned(spectra, _SEARCH_LINES)
    band = (2.0 * np.pi * band_hz[0] * 1.05, 2.0 * np.pi * band_hz[1] * 0.99)
    whole_band = (0.0, 2.0 * np.pi * band_hz[1])
    orders = range(0) if layout.is_chain else matrix_orders(spectra, modes)
    if len(orders) >= _FEWEST_ORDERS:
        candidates = stable_matrix_poles(spectra, orders, whole_band)
    else:
        orders = range(2 * modes + 2, 2 * modes + 20, 2)
        candidates = stable_poles(spectra, orders, whole_band)
    candidates = [item for item in candidates if band[0] <= item.angular_frequency <= band[1]]
    # poles at the end of the band are often numerical: they occur less often and have more damping
    candidates.sort(key=lambda item: (-item.occurrences, item.damping_ratio))
    firm = [item for item in candidates if item.occurrences >= len(orders) // 2][: modes + _SURPLUS]
    firm += _of_decays(decays, firm, band_hz)
    if not firm:
        return None

    def found(fit: MultiModeFit) -> _Found:
        return _Found(fit, complete_set(fit, layout), whole, band_hz, tuple(candidates))

    doubtful = [item for item in candidates if item not in firm and item.occurrences >= 2 and item.damping_ratio < 0.05]
    best = found(with_decays(_fit_candidates(spectra, firm), decays))
    if not best.keep and doubtful:
        more = doubtful[: max(_SURPLUS, modes + _SURPLUS - len(firm))]
        best = found(with_decays(_fit_candidates(spectra, [*firm, *more]), decays))
    for _ in range(_ROUNDS):
        if best.keep:
            break
        kept = sound(best.fit)
        fit = best.fit.only(kept)
        extra = hidden_poles(best.fit, band, max(2, modes + 1 - len(kept)))
        if not extra:
            break
        omega = np.concatenate([fit.angular_frequencies, [item.angular_frequency for item in extra]])
        zeta = np.concatenate([fit.damping_ratios, [item.damping_ratio for item in extra]])
        best = found(with_decays(fit_modes(spectra, omega, zeta, evaluations=15), decays))
        if len(omega) > 2 * modes + 2 * _SURPLUS:
            break
    return best


def _of_decays(
    decays: Sequence[FrameTest], known: Sequence[PoleCandidate], band_hz: tuple[float, float]
) -> list[PoleCandidate]:
    """Return the poles of decay tests that are not stable poles of the forced tests."""
    new: list[PoleCandidate] = []
    for test in decays:
        omega = strongest_frequency(test, band_hz)
        others = [item.angular_frequency for item in [*known, *new]]
        if omega is not None and not any(same_place(test, omega, other) for other in others):
            new.append(PoleCandidate(omega, 0.004, 0))
    return new


def _fit_candidates(spectra: Sequence[RecordSpectrum], candidates: Sequence[PoleCandidate]) -> MultiModeFit:
    omega = np.array([item.angular_frequency for item in candidates])
    zeta = np.array([item.damping_ratio for item in candidates])
    return fit_modes(spectra, omega, zeta, passes=2, evaluations=12)


def find_modes(
    tests: Sequence[FrameTest],
    layout: Layout,
    low_hz: float,
    high_hz: float,
    source: Path,
    decays: Sequence[FrameTest] = (),
) -> ModeSearch:
    """Return the modes that the tests show: one for each floor if they can be found, else fewer.

    Modes that the forced tests hardly show are taken from `decays` if these show them better.

    Raises
    ------
    UserError
        If no mode is found, or a sensor does not respond to the excitation.
    """
    incomplete: list[_Found] = []
    bands = bands_to_try(tests, low_hz, high_hz)
    for band in bands:
        spectra = tuple(record_spectrum(test, band) for test in tests)
        found = _look(spectra, layout, band, decays)
        if found is not None and found.keep:
            refined, left = _only(found, found.keep, decays)
            if len(left) == layout.floors and not contradicts(refined, layout):
                numbers = tuple(range(1, layout.floors + 1))
                return ModeSearch(refined, band, numbers, found.candidates)
        if found is not None:
            incomplete.append(found)
    best = _best_of_bands(incomplete, layout, source, decays)
    if best is None:
        span = f"between {low_hz:g} and {max(high for _, high in bands):.3g} Hz"
        remedy = (
            "check the channels, or set identify_frame.band_high_hz; if the structure also moves at supports that were "
            "not measured, or on soft soil, write kind: ambient for these tests, so that the modes come from the "
            "responses alone"
        )
        raise UserError(source, "forced tests", f"no mode found {span}", remedy)
    return best


def _best_of_bands(
    found: Sequence[_Found], layout: Layout, source: Path, decays: Sequence[FrameTest]
) -> ModeSearch | None:
    """Return the largest set of modes after the last fit; None without modes.

    A pole at the end of a narrow band represents the modes beyond it, and the last fit moves it. The sets are therefore
    compared after that fit. Of equally large sets of a chain of floors the last one is taken, because missing modes of
    a chain are searched later and compete with those found. Other structures have no such search. Of their equally
    large sets that is taken whose least certain mode is more certain: if a strong mode is missed, poles close to it
    represent it together, and each of them is uncertain.
    """
    sets = [(largest_set(item.fit, layout), item) for item in reversed(found)]
    best: ModeSearch | None = None
    for chosen, item in sorted(sets, key=lambda pair: -len(pair[0])):
        rivals = best is None or len(chosen) + (not layout.is_chain) > len(best.numbers)
        if chosen and rivals:
            search = _incomplete(item, chosen, layout, source, decays)
            best = search if best is None or _rank(search, layout) > _rank(best, layout) else best
    return best


def _rank(search: ModeSearch, layout: Layout) -> tuple[int, float]:
    """Return the number of modes and, if the floors do not form a chain, the certainty of the least certain mode."""
    return len(search.numbers), 0.0 if layout.is_chain else float(certainty(search.fit).min())


def _incomplete(
    best: _Found, chosen: dict[int, int], layout: Layout, source: Path, decays: Sequence[FrameTest]
) -> ModeSearch:
    """Return the modes of a set that is not complete, without those whose shape is doubtful after the last fit."""
    if len(chosen) < layout.floors:
        check_channels(best.fit.coherence[:, list(chosen)], [item.floor for item in best.fit.sensors], source)
    refined, left = _only(best, list(chosen), decays)
    if not contradicts(refined, layout):
        return ModeSearch(refined, best.band_hz, tuple(chosen[pole] for pole in left), best.candidates)
    kept = largest_set(refined, layout) or {0: 1}
    return ModeSearch(refined.only(list(kept)), best.band_hz, tuple(kept.values()), best.candidates)


def _only(found: _Found, keep: Sequence[int], decays: Sequence[FrameTest]) -> tuple[MultiModeFit, tuple[int, ...]]:
    """Fit again with the poles of the modes and with other real peaks up to a little above the highest mode.

    Returns the fit of the modes and which of `keep` they are. A pole that has moved to another one is left out.

    Without the peak of a flexible support its response would be attributed to the frame. The band ends just above the
    highest mode, because a peak just beyond the band is not a power series inside it.
    """
    fit = found.fit
    size = strength(fit)
    level = 0.1 * min(size[list(keep)])
    others = [i for i in sound(fit) if i not in keep and size[i] > level and fit.damping_ratios[i] < 0.1]
    both = sorted([*keep, *others])
    top = _LAST_BAND * float(fit.angular_frequencies[list(keep)].max())
    spectra = thinned([item.below(top) for item in found.spectra], _FIT_LINES)
    refined = fit_modes(spectra, fit.angular_frequencies[both], fit.damping_ratios[both])
    places: dict[int, int] = {}
    apart = sound(refined)
    for i in sorted(keep):
        distance = np.abs(refined.angular_frequencies[apart] / fit.angular_frequencies[i] - 1.0)
        nearest = int(np.argmin(distance))
        if distance[nearest] < _SAME_POLE and apart[nearest] not in places.values():
            places[i] = apart[nearest]
    return with_decays(refined, decays).only(list(places.values())), tuple(places)


def check_channels(coherence: FloatArray, floors: Sequence[int], source: Path) -> None:
    """Raise UserError if a sensor, a row of `coherence` (n, r), does not respond to the excitation at any peak."""
    dead = np.flatnonzero(np.all(coherence < LEAST_COHERENCE, axis=1))
    if dead.size:
        place = f"channel of floor {floors[dead[0]]}"
        problem = f"coherence is below {LEAST_COHERENCE:g} at every peak (largest {coherence[dead[0]].max():.2f})"
        raise UserError(source, place, problem, "check the sensor, its cable and its column")
