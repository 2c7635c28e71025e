"""Finding as many modes as the frame has floors, and no other peak."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.modal.checks import sign_changes
from mrpipe.modal.lscf import stable_poles
from mrpipe.modal.multimode import MultiModeFit, fit_modes
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import RecordSpectrum, excited_band, record_spectrum

_USUAL_HIGH_HZ = 30.0
_LARGEST_SURPLUS = 6


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
    top = min(excited_band(tuple(tests))[1], 0.9 * nyquist)
    bands = []
    high = _USUAL_HIGH_HZ / 2.0
    while high < 0.8 * top and top > _USUAL_HIGH_HZ:
        bands.append((low_hz, high))
        high *= 2.0
    return [*bands, (low_hz, top)]


def _strength(fit: MultiModeFit) -> FloatArray:
    """Peak of each mode over noise, largest over floors: |residue| / (2 zeta), shape (r,)."""
    peak = np.abs(fit.residues) / (2.0 * fit.damping_ratios)
    return np.asarray((peak / np.sqrt(fit.noise_variance)[:, None]).max(axis=0))


def _structural(fit: MultiModeFit, floors: int) -> list[int]:
    """Return the modes to keep: mode r of a shear frame changes sign r - 1 times, peaks of a support do not fit in."""
    strength = _strength(fit)
    changes = [sign_changes(shape.real) for shape in fit.residues.T]
    chosen: list[int] = []
    for wanted in range(floors):
        above = chosen[-1] if chosen else -1
        fitting = [index for index in range(above + 1, strength.size) if changes[index] == wanted]
        if not fitting:
            return []
        chosen.append(max(fitting, key=lambda index: strength[index]))
    return chosen


def _next_peak(fit: MultiModeFit) -> float:
    """Return the frequency [rad/s] at which the residual stands out most, far from the modes found."""
    residual = fit.residual() / np.sqrt(fit.noise_variance)
    omega = np.concatenate(fit.omega)
    power = np.sum(np.abs(residual) ** 2, axis=1)
    for found, zeta in zip(fit.angular_frequencies, fit.damping_ratios, strict=True):
        power[np.abs(omega - found) < max(0.01 * found, 6.0 * zeta * found)] = 0.0
    window = 5
    smooth = np.convolve(power, np.full(window, 1.0 / window), mode="same")
    return float(omega[int(np.argmax(smooth))])


def _complete(fit: MultiModeFit, spectra: Sequence[RecordSpectrum], floors: int) -> MultiModeFit:
    """Add modes at the largest peaks of the residual until there are as many as floors."""
    while fit.angular_frequencies.size < floors:
        omega = np.append(fit.angular_frequencies, _next_peak(fit))
        zeta = np.append(fit.damping_ratios, 0.004)
        fit = fit_modes(spectra, omega, zeta)
    return fit


def _first_fit(spectra: Sequence[RecordSpectrum], floors: int, band_hz: tuple[float, float]) -> MultiModeFit | None:
    band = (2.0 * np.pi * band_hz[0], 2.0 * np.pi * band_hz[1])
    orders = range(2 * floors + 2, 2 * floors + 20, 2)
    candidates = [item for item in stable_poles(spectra, orders, band) if item.occurrences >= len(orders) // 2]
    # the end of the band draws poles that are none: fewer occurrences, more damping
    candidates.sort(key=lambda item: (-item.occurrences, item.damping_ratio))
    candidates = candidates[: floors + _LARGEST_SURPLUS]
    if not candidates:
        return None
    omega = np.array([item.angular_frequency for item in candidates])
    zeta = np.array([item.damping_ratio for item in candidates])
    return fit_modes(spectra, omega, zeta)


def find_modes(
    tests: Sequence[FrameTest], low_hz: float, high_hz: float, source: Path
) -> tuple[MultiModeFit, tuple[float, float]]:
    """Return the fit of as many modes as there are floors, and the band [Hz] used.

    Raises
    ------
    UserError
        If a mode has no peak in the band.
    """
    floors = tests[0].floors
    bands = bands_to_try(tests, low_hz, high_hz)
    best: tuple[MultiModeFit, tuple[float, float], list[RecordSpectrum]] | None = None
    for band in bands:
        spectra = [record_spectrum(test, band) for test in tests]
        fit = _first_fit(spectra, floors, band)
        if fit is None:
            continue
        keep = _structural(fit, floors)
        if not keep and fit.angular_frequencies.size < floors:
            fit = _complete(fit, spectra, floors)
            keep = _structural(fit, floors)
        best = (fit, band, spectra)
        if keep:
            return _only(fit, spectra, keep), band
    span = f"between {bands[-1][0]:g} and {bands[-1][1]:.3g} Hz"
    if best is None:
        raise UserError(source, "forced tests", f"no peak {span}", "check channels, or set identify_frame.band_high_hz")
    return _lowest(best[0], best[2], floors, source, span), best[1]


def _only(fit: MultiModeFit, spectra: Sequence[RecordSpectrum], keep: Sequence[int]) -> MultiModeFit:
    index = list(keep)
    if len(index) == fit.angular_frequencies.size:
        return fit
    # a pole beyond the frame's own stays in the fit where it is a real peak inside the band: without it
    # its response would be blamed on the frame
    strength = _strength(fit)
    level = 0.02 * min(strength[index])
    others = [i for i in range(strength.size) if i not in index and strength[i] > level]
    both = sorted([*index, *others])
    refined = fit_modes(spectra, fit.angular_frequencies[both], fit.damping_ratios[both])
    place = [both.index(i) for i in index]
    return refined.only(place)


def _lowest(fit: MultiModeFit, spectra: Sequence[RecordSpectrum], floors: int, source: Path, span: str) -> MultiModeFit:
    """Where the signs of shapes do not tell (a noisy node): the strongest poles; too few is the user's to mend."""
    strength = _strength(fit)
    coherent = [i for i in range(strength.size) if fit.mode_coherence()[i] >= 0.5]
    if len(coherent) < floors:
        number = len(coherent) + 1
        present = fit.angular_frequencies[coherent] / (2.0 * np.pi)
        peaks = ", ".join(f"{value:.3g}" for value in present) or "none"
        problem = f"mode {number} of {floors} has no peak {span} (peaks at {peaks} Hz)"
        remedy = "excite it, or set identify_frame.band_low_hz and band_high_hz"
        raise UserError(source, "forced tests", problem, remedy)
    strongest = sorted(sorted(coherent, key=lambda i: -strength[i])[:floors])
    return _only(fit, spectra, strongest)
