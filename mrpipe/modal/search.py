"""Finding as many modes as the frame has floors, and no other peak."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.errors import UserError
from mrpipe.modal.checks import modal_coupling, possible_sign_changes
from mrpipe.modal.free_response import same_place, strongest_frequency, with_decays
from mrpipe.modal.lscf import PoleCandidate, stable_poles
from mrpipe.modal.multimode import MultiModeFit, fit_modes
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import RecordSpectrum, excited_band, record_spectrum

_USUAL_HIGH_HZ = 30.0
_SURPLUS = 4
_LEAST_COHERENCE = 0.5
_DIVERGED_DAMPING = 0.25
_LARGEST_DAMPING = 0.1
_LEAST_DAMPING = 2e-6
_UNKNOWN_SHAPE = 0.5
_LARGEST_COUPLING = 0.15
_SAME_SHAPE = 0.6
_LAST_BAND = 1.25


@dataclass(frozen=True)
class _Found:
    """A fit with poles to spare, and which of them are the frame's (empty where that could not be told)."""

    fit: MultiModeFit
    keep: tuple[int, ...]
    spectra: tuple[RecordSpectrum, ...]
    band_hz: tuple[float, float]


def bands_to_try(tests: Sequence[FrameTest], low_hz: float, high_hz: float) -> list[tuple[float, float]]:
    """Return bands [Hz] in which to look for modes, narrow ones first where the excitation reaches far.

    Parameters
    ----------
    tests
        Forced tests.
    low_hz, high_hz
        As set by the user; 0 for `high_hz` means up to where the excitation ends.
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
    # tests may reach differently far; where all that finds nothing, a narrower band resolves close modes better
    narrower = [0.7 * tops[-1]] if len(tests) > 1 else []
    for top in [*tops, *narrower]:
        if all(abs(top - known) > 0.1 * known for known in bands):
            bands.append(top)
    return [(low_hz, high) for high in bands]


def _strength(fit: MultiModeFit) -> FloatArray:
    """Peak of each mode over noise, largest over floors: |residue| / (2 zeta), shape (r,)."""
    peak = np.abs(fit.residues) / (2.0 * fit.damping_ratios)
    return np.asarray((peak / np.sqrt(fit.noise_variance)[:, None]).max(axis=0))


def _couplings(fit: MultiModeFit, masses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the scaled U'MU of all poles, and how large an element may be by the errors of the shapes."""
    coupling = modal_coupling(fit.residues.real, np.diag(masses))
    error = _shape_errors(fit)
    return coupling, np.minimum(_LARGEST_COUPLING + 2.0 * np.add.outer(error, error), _SAME_SHAPE)


def _shape_errors(fit: MultiModeFit) -> FloatArray:
    """Return the error of each shape over its norm, shape (r,)."""
    norm = np.maximum(np.linalg.norm(fit.residues, axis=0), 1e-300)
    return np.asarray(np.linalg.norm(fit.residue_errors, axis=0) / norm)


def _usable(fit: MultiModeFit) -> BoolArray:
    """Return which poles may be modes: neither run off nor at the bound, coherent, and of a shape that is known."""
    inside = (fit.damping_ratios < _LARGEST_DAMPING) & (fit.damping_ratios > _LEAST_DAMPING)
    return np.asarray(inside & (fit.mode_coherence() >= _LEAST_COHERENCE) & (_shape_errors(fit) < _UNKNOWN_SHAPE))


def _structural(fit: MultiModeFit, masses: FloatArray) -> tuple[int, ...]:
    """Return the modes of the frame: the lowest poles that change sign once more each and are orthogonal to the mass.

    A flexible support's peak above the band has the shape of the highest mode, so the lowest fitting choice is taken;
    empty where there is none.
    """
    floors = masses.size
    usable = _usable(fit)
    ranges = _sign_ranges(fit)
    coupling, allowed = _couplings(fit, masses)

    def extend(chosen: tuple[int, ...]) -> tuple[int, ...]:
        wanted = len(chosen)
        if wanted == floors:
            return chosen
        for pole in range(chosen[-1] + 1 if chosen else 0, usable.size):
            fits = usable[pole] and ranges[pole][0] <= wanted <= ranges[pole][1]
            if fits and all(abs(coupling[pole, other]) <= allowed[pole, other] for other in chosen):
                whole = extend((*chosen, pole))
                if whole:
                    return whole
        return ()

    return extend(()) or _strongest_by_signs(fit, floors)


def _sign_ranges(fit: MultiModeFit) -> list[tuple[int, int]]:
    return [
        possible_sign_changes(shape.real, np.maximum(error, 0.01 * np.abs(shape).max()))
        for shape, error in zip(fit.residues.T, fit.residue_errors.T, strict=True)
    ]


def _strongest_by_signs(fit: MultiModeFit, floors: int) -> tuple[int, ...]:
    """Return the strongest rising choice with the sign changes of a shear frame (masses may be wrong), or nothing."""
    score = np.log(np.maximum(_strength(fit), 1e-300))
    score[~_usable(fit)] = -np.inf
    ranges = _sign_ranges(fit)
    poles = score.size
    best = np.full((floors + 1, poles + 1), -np.inf)
    best[0] = 0.0
    taken = np.zeros((floors + 1, poles + 1), dtype=bool)
    for wanted in range(floors):
        for pole in range(poles):
            skip = best[wanted + 1, pole]
            take = -np.inf
            if ranges[pole][0] <= wanted <= ranges[pole][1]:
                take = best[wanted, pole] + score[pole]
            taken[wanted + 1, pole + 1] = take > skip
            best[wanted + 1, pole + 1] = max(skip, take)
    if not np.isfinite(best[floors, poles]):
        return ()
    chosen, pole = [], poles
    for wanted in range(floors, 0, -1):
        while not taken[wanted, pole]:
            pole -= 1
        pole -= 1
        chosen.append(pole)
    return tuple(reversed(chosen))


def _next_peaks(fit: MultiModeFit, number: int) -> list[float]:
    """Return where [rad/s] the residual stands out most, away from the modes found and from each other."""
    residual = fit.residual() / np.sqrt(fit.noise_variance)
    omega = np.concatenate(fit.omega)
    power = np.sum(np.abs(residual) ** 2, axis=1)
    line = float(np.median(np.diff(fit.omega[0])))
    for found, zeta in zip(fit.angular_frequencies, fit.damping_ratios, strict=True):
        power[np.abs(omega - found) < max(2.0 * zeta * found, 0.002 * found, 3.0 * line)] = 0.0
    smooth = np.convolve(power, np.full(5, 0.2), mode="same")
    peaks = []
    for _ in range(number):
        place = float(omega[int(np.argmax(smooth))])
        peaks.append(place)
        smooth[np.abs(omega - place) < 0.02 * place] = 0.0
    return peaks


def _sound(fit: MultiModeFit) -> list[int]:
    """Return the poles that neither ran off nor fell on a stronger one."""
    strength = _strength(fit)
    sound: list[int] = []
    for index in np.argsort(-strength):
        omega = fit.angular_frequencies[index]
        apart = [abs(omega - fit.angular_frequencies[other]) > 1e-3 * omega for other in sound]
        if _LEAST_DAMPING < fit.damping_ratios[index] < _DIVERGED_DAMPING and all(apart):
            sound.append(int(index))
    return sorted(sound)


def _look(
    spectra: tuple[RecordSpectrum, ...],
    masses: FloatArray,
    band_hz: tuple[float, float],
    decays: Sequence[FrameTest] = (),
) -> _Found | None:
    """Fit stable poles; then, while the frame's modes are not complete, doubtful ones and peaks of the residual."""
    floors = masses.size
    band = (2.0 * np.pi * band_hz[0] * 1.05, 2.0 * np.pi * band_hz[1] * 0.99)
    orders = range(2 * floors + 2, 2 * floors + 20, 2)
    candidates = stable_poles(spectra, orders, (0.0, 2.0 * np.pi * band_hz[1]))
    candidates = [item for item in candidates if band[0] <= item.angular_frequency <= band[1]]
    # the end of the band draws poles that are none: fewer occurrences, more damping
    candidates.sort(key=lambda item: (-item.occurrences, item.damping_ratio))
    firm = [item for item in candidates if item.occurrences >= len(orders) // 2][: floors + _SURPLUS]
    firm += _of_decays(decays, firm, band_hz)
    if not firm:
        return None
    doubtful = [item for item in candidates if item not in firm and item.occurrences >= 2 and item.damping_ratio < 0.05]
    fit = with_decays(_fit_candidates(spectra, firm), decays)
    found = _Found(fit, _structural(fit, masses), spectra, band_hz)
    if not found.keep and doubtful:
        more = doubtful[: max(_SURPLUS, floors + _SURPLUS - len(firm))]
        fit = with_decays(_fit_candidates(spectra, [*firm, *more]), decays)
        found = _Found(fit, _structural(fit, masses), spectra, band_hz)
    if not found.keep:
        sound = _sound(fit)
        fit = fit.only(sound)
        extra = _next_peaks(fit, max(2, floors + 2 - len(sound)))
        omega = np.concatenate([fit.angular_frequencies, extra])
        zeta = np.concatenate([fit.damping_ratios, np.full(len(extra), 0.004)])
        fit = with_decays(fit_modes(spectra, omega, zeta, evaluations=15), decays)
        found = _Found(fit, _structural(fit, masses), spectra, band_hz)
    return found


def _of_decays(
    decays: Sequence[FrameTest], known: Sequence[PoleCandidate], band_hz: tuple[float, float]
) -> list[PoleCandidate]:
    """Return the poles that decay tests ring at and that the forced tests do not show as stable."""
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
    floor_masses: FloatArray,
    low_hz: float,
    high_hz: float,
    source: Path,
    decays: Sequence[FrameTest] = (),
) -> tuple[MultiModeFit, tuple[float, float]]:
    """Return the fit of as many modes as there are floors, and the band [Hz] used.

    Modes that the forced tests hardly show are taken from `decays` where these show them better.

    Raises
    ------
    UserError
        If a mode has no peak in the band.
    """
    bands = bands_to_try(tests, low_hz, high_hz)
    span = f"between {low_hz:g} and {max(high for _, high in bands):.3g} Hz"
    best: _Found | None = None
    for band in bands:
        found = _look(tuple(record_spectrum(test, band) for test in tests), floor_masses, band, decays)
        best = found or best
        if found is not None and found.keep:
            return _only(found, found.keep, decays), band
    if best is None:
        raise UserError(source, "forced tests", f"no peak {span}", "check channels, or set identify_frame.band_high_hz")
    return _only(best, _strongest(best, floor_masses, source, span), decays), best.band_hz


def _only(found: _Found, keep: Sequence[int], decays: Sequence[FrameTest]) -> MultiModeFit:
    """Fit once more with the frame's poles and those beyond them that are real peaks, up to a little above the frame.

    Without a support's peak its response would be blamed on the frame. A peak just beyond the band of the search is no
    power series inside it, so the band ends well before what is not the frame's.
    """
    fit = found.fit
    strength = _strength(fit)
    level = 0.1 * min(strength[list(keep)])
    others = [i for i in _sound(fit) if i not in keep and strength[i] > level and fit.damping_ratios[i] < 0.1]
    both = sorted([*keep, *others])
    top = _LAST_BAND * float(fit.angular_frequencies[list(keep)].max())
    refined = fit_modes(
        [item.below(top) for item in found.spectra], fit.angular_frequencies[both], fit.damping_ratios[both]
    )
    place = [int(np.argmin(np.abs(refined.angular_frequencies - fit.angular_frequencies[i]))) for i in keep]
    return with_decays(refined, decays).only(place)


def _strongest(found: _Found, masses: FloatArray, source: Path, span: str) -> tuple[int, ...]:
    """Where signs of shapes do not tell: the strongest coherent poles of different shape, or what is missing."""
    fit, floors = found.fit, masses.size
    strength = _strength(fit)
    coupling = modal_coupling(fit.residues.real, np.diag(masses))
    usable = _usable(fit)
    coherent = [i for i in _sound(fit) if usable[i]]
    chosen: list[int] = []
    for index in sorted((i for i in coherent if fit.damping_ratios[i] < _LARGEST_DAMPING), key=lambda i: -strength[i]):
        # two poles of one shape are one mode, or a mode and noise
        if len(chosen) < floors and all(abs(coupling[index, other]) < _SAME_SHAPE for other in chosen):
            chosen.append(index)
    chosen.sort()
    if len(chosen) < floors:
        if chosen:
            check_channels(fit.coherence[:, chosen], source)
        present = fit.angular_frequencies[chosen] / (2.0 * np.pi)
        peaks = ", ".join(f"{value:.3g}" for value in present) or "none"
        problem = f"mode {_missing_mode(fit, chosen)} of {floors} has no peak {span} (peaks at {peaks} Hz)"
        remedy = "excite it, or set identify_frame.band_low_hz and band_high_hz"
        raise UserError(source, "forced tests", problem, remedy)
    return tuple(chosen)


def check_channels(coherence: FloatArray, source: Path) -> None:
    """Raise where a floor, a row of `coherence` (n, r), answers to the excitation at none of the peaks."""
    dead = np.flatnonzero(np.all(coherence < _LEAST_COHERENCE, axis=1))
    if dead.size:
        place = f"channel of floor {dead[0] + 1}"
        problem = f"coherence is below {_LEAST_COHERENCE:g} at every peak (largest {coherence[dead[0]].max():.2f})"
        raise UserError(source, place, problem, "check the sensor, its cable and its column")


def _missing_mode(fit: MultiModeFit, chosen: Sequence[int]) -> int:
    """Return the first mode (from 1) whose number of sign changes no chosen pole can have."""
    ranges = _sign_ranges(fit)
    for wanted, pole in enumerate(chosen):
        if not ranges[pole][0] <= wanted <= ranges[pole][1]:
            return wanted + 1
    return len(chosen) + 1
