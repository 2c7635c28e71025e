"""From a frame campaign to M, C, K and modes, with intervals and checks (chapter 3)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.errors import UserError
from mrpipe.modal.checks import LARGEST_COUPLING, check_mode_matrix, modal_coupling, orthogonal_shapes
from mrpipe.modal.decay import DecayResult, Estimate, analyse_decay
from mrpipe.modal.multimode import MultiModeFit
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search import check_channels, find_modes
from mrpipe.modal.tridiagonal import TridiagonalFit, fit_tridiagonal
from mrpipe.modal.verification import (
    FrequencyVerification,
    TimeVerification,
    verify_in_frequency,
    verify_in_time,
)
from mrpipe.structures import (
    Frame,
    frame_from_modes,
    mass_matrix,
    modal_assurance,
    modal_damping_matrix,
    natural_modes,
    normalise_to_largest,
)

_NORMAL_95 = 1.959964
_LEAST_COHERENCE = 0.5
_ENOUGH_COHERENCE = 0.9
_WIDEST_DECAY_INTERVAL = 0.02


@dataclass(frozen=True)
class IdentificationOptions:
    """What the user may choose.

    Attributes
    ----------
    band_low_hz, band_high_hz
        Where modes are looked for; 0 for the high end means up to where the excitation ends.
    damping_from
        `decay` (where there is one, else the sweep) or `sweep`.
    stiffness_form
        `modal` by (3.14) to (3.16), or `tridiagonal`.
    orthogonal
        Take the measured shapes to the nearest ones orthogonal to the mass, unless they contradict that.
    mode_matrix
        Shape (n, n) to use in place of the measured shapes; None for the measured ones.
    mode_matrix_name
        For messages.
    """

    band_low_hz: float = 0.2
    band_high_hz: float = 0.0
    damping_from: str = "decay"
    stiffness_form: str = "modal"
    orthogonal: bool = True
    mode_matrix: FloatArray | None = None
    mode_matrix_name: str = ""


@dataclass(frozen=True)
class FrameIdentification:
    """Everything that identification found.

    Attributes
    ----------
    frame
        M, C, K.
    frequencies
        Natural angular frequencies with intervals [rad/s].
    damping
        Damping ratios that went into C, with intervals.
    damping_source
        `decay`, `sweep`, or `decay and sweep` where the decay is uncertain, a mode.
    sweep_damping
        Damping ratios of the multi-mode fit of the forced tests: the second method.
    mode_shapes
        Shape (n, n), largest element of a mode +1.
    mac
        Shape (n, n): measured shapes against those of the frame.
    decays
        One a mode at most (the most certain one); modes without a decay are missing.
    fit, tridiagonal, in_time, in_frequency
        Parts, for the artifact and the report.
    phase_scatter
        Shape (n,): largest imaginary part of a mode's residues over the largest residue.
    tests
        The forced tests, those of the fit first; all are simulated for verification.
    band_hz
        Band of the fit.
    findings
        What the user should know, one line each.
    """

    frame: Frame
    frequencies: tuple[Estimate, ...]
    damping: tuple[Estimate, ...]
    damping_source: tuple[str, ...]
    sweep_damping: tuple[Estimate, ...]
    mode_shapes: FloatArray
    mac: FloatArray
    decays: dict[int, DecayResult]
    fit: MultiModeFit
    tridiagonal: TridiagonalFit
    in_time: tuple[TimeVerification, ...]
    in_frequency: FrequencyVerification
    phase_scatter: FloatArray
    tests: tuple[FrameTest, ...]
    band_hz: tuple[float, float]
    findings: tuple[str, ...]


def _one_place(tests: FrameTests) -> tuple[tuple[FrameTest, ...], list[str]]:
    """Return the forced tests with the commonest place of excitation and kind of channels."""
    keys = [(test.shaker_floor, test.is_displacement) for test in tests.forced]
    wanted = Counter(keys).most_common(1)[0][0]
    chosen = tuple(test for test, key in zip(tests.forced, keys, strict=True) if key == wanted)
    left = [test.name for test, key in zip(tests.forced, keys, strict=True) if key != wanted]
    return _training_first(chosen), [
        f"test {name} is excited or measured elsewhere than the others and was left out" for name in left
    ]


def _training_first(tests: tuple[FrameTest, ...]) -> tuple[FrameTest, ...]:
    return tuple(sorted(tests, key=lambda test: test.role == "validation"))


def _find(
    forced: tuple[FrameTest, ...], tests: FrameTests, options: IdentificationOptions
) -> tuple[MultiModeFit, tuple[float, float], list[str]]:
    """Find the modes in the tests that are not for validation; in all of them where a mode is too weak in those."""
    first = tuple(test for test in forced if test.role != "validation") or forced
    arguments = (tests.floor_masses, options.band_low_hz, options.band_high_hz, tests.source, tests.decays)
    sets = [first]
    # sweeps put more into each mode than random motion, and fewer tests are fitted sooner
    for more in (tuple(test for test in forced if test.kind == "sweep"), forced):
        if len(more) > len(sets[-1]):
            sets.append(more)
    notes: list[str] = []
    for chosen in sets[:-1]:
        try:
            fit, band = find_modes(chosen, *arguments)
        except UserError:
            fit = None
        if fit is not None and _sound(fit, tests.floor_masses):
            return fit, band, notes
        notes = ["a mode is weak in the training tests: tests for validation were taken for the fit as well"]
    return *find_modes(sets[-1], *arguments), notes


def _sound(fit: MultiModeFit, floor_masses: FloatArray) -> bool:
    """Return whether every mode stands out and the shapes are orthogonal to the mass."""
    coupling = modal_coupling(np.real(fit.residues), np.diag(floor_masses))
    return bool(
        fit.mode_coherence().min() >= _ENOUGH_COHERENCE and np.abs(np.triu(coupling, 1)).max() <= LARGEST_COUPLING
    )


def _check_coherence(fit: MultiModeFit, tests: FrameTests) -> list[str]:
    """Raise where a peak is mostly noise; return warnings for single floors."""
    findings = []
    frequency = fit.angular_frequencies / (2.0 * np.pi)
    check_channels(fit.coherence, tests.source)
    pooled = fit.mode_coherence()
    weak = np.flatnonzero(pooled < _LEAST_COHERENCE)
    if weak.size:
        mode = int(weak[0])
        place = f"mode {mode + 1} at {frequency[mode]:.3g} Hz"
        problem = f"coherence at the peak is {pooled[mode]:.2f}, below {_LEAST_COHERENCE:g}"
        raise UserError(tests.source, place, problem, "excite it harder or longer, or reduce the noise")
    shape = np.abs(fit.residues) / np.abs(fit.residues).max(axis=0)
    for floor, mode in np.argwhere((fit.coherence < _LEAST_COHERENCE) & (shape > 0.3)):
        value = fit.coherence[floor, mode]
        findings.append(f"floor {floor + 1}, mode {mode + 1}: coherence at the peak is only {value:.2f}")
    return findings


def _decays(tests: FrameTests, fit: MultiModeFit) -> tuple[dict[int, DecayResult], list[str]]:
    shapes = np.real(fit.residues)
    results: dict[int, DecayResult] = {}
    findings = []
    for test in tests.decays:
        result = analyse_decay(test, shapes, fit.angular_frequencies, fit.damping_ratios)
        if result is None:
            findings.append(f"test {test.name}: no decay stands out of the noise; it was left out")
            continue
        known = results.get(result.mode)
        if known is None or result.exponential_fit.half_width < known.exponential_fit.half_width:
            results[result.mode] = result
    return results, findings


def _pooled(first: Estimate, second: Estimate) -> Estimate:
    weights = np.array([1.0 / max(item.half_width, 1e-12) ** 2 for item in (first, second)])
    value = float(weights @ [first.value, second.value] / weights.sum())
    return Estimate.of(value, float(1.0 / np.sqrt(weights.sum())) / _NORMAL_95)


def _choose_damping(
    sweep: tuple[Estimate, ...], decays: dict[int, DecayResult], damping_from: str
) -> tuple[tuple[Estimate, ...], tuple[str, ...], list[str]]:
    chosen: list[Estimate] = []
    sources: list[str] = []
    findings: list[str] = []
    for mode, second in enumerate(sweep, start=1):
        decay = decays.get(mode)
        first = decay.exponential_fit if decay else None
        if first is None or damping_from != "decay":
            chosen.append(second)
            sources.append("sweep")
        elif first.half_width <= _WIDEST_DECAY_INTERVAL * first.value:
            chosen.append(first)
            sources.append("decay")
        else:
            # neither is sure: the mean of two independent methods, each by its certainty
            chosen.append(_pooled(first, second))
            sources.append("decay and sweep")
        if first is None and damping_from == "decay":
            findings.append(f"mode {mode}: no free decay, damping from the sweep")
        if first is not None:
            apart = abs(first.value - second.value)
            if apart > first.half_width + second.half_width + 0.1 * second.value:
                findings.append(f"mode {mode}: damping is {first.value:.2g} by decay, {second.value:.2g} by sweep")
    return tuple(chosen), tuple(sources), findings


def _check_shapes(shapes: FloatArray, mass: FloatArray, options: IdentificationOptions) -> list[str]:
    found = check_mode_matrix(shapes, mass)
    if not found:
        return []
    message = "; ".join(item.message for item in found)
    if options.mode_matrix is None:
        return [f"measured mode shapes: {message}"]
    wrong = [item for item in found if item.kind in {"wrong-sign", "singular"}]
    remedy = "turn the sign of those elements" if wrong and wrong[0].elements else "give shapes orthogonal to the mass"
    raise UserError(f"mode matrix {options.mode_matrix_name}", "", message, remedy)


def identify_frame(
    tests: FrameTests, options: IdentificationOptions | None = None, progress: Progress = no_progress
) -> FrameIdentification:
    """Identify a frame from its forced and decay tests.

    Parameters
    ----------
    tests
        See :func:`~mrpipe.modal.records.frame_tests`.
    options
        Choices; the defaults are those of the thesis.
    progress
        Told how far it is.

    Raises
    ------
    UserError
        If a mode has no peak, the coherence at a peak is below 0.5, or a given mode matrix is singular or not
        orthogonal to the mass.
    """
    # tall matrices of a few columns gain nothing from threads, and lose a hundredfold where other work shares the cores
    with threadpool_limits(1):
        return _identify(tests, options or IdentificationOptions(), progress)


def _identify(tests: FrameTests, chosen: IdentificationOptions, progress: Progress) -> FrameIdentification:
    forced, findings = _one_place(tests)
    mass = mass_matrix(tests.floor_masses, source=tests.source)
    if chosen.mode_matrix is not None:
        _check_given(chosen, mass, forced[0].floors)
    progress(0.05, "poles")
    fit, band, notes = _find(forced, tests, chosen)
    findings += [*notes, *_check_coherence(fit, tests)]
    progress(0.4, "decays")
    decays, notes = _decays(tests, fit)
    findings += notes
    modes = fit.angular_frequencies.size
    error = np.sqrt(np.diag(fit.covariance))
    frequencies = tuple(Estimate.of(w, w * e) for w, e in zip(fit.angular_frequencies, error[:modes], strict=True))
    sweep = tuple(Estimate.of(z, z * e) for z, e in zip(fit.damping_ratios, error[modes:], strict=True))
    damping, sources, notes = _choose_damping(sweep, decays, chosen.damping_from)
    findings += notes
    measured = np.real(fit.residues)
    shapes = measured if chosen.mode_matrix is None else chosen.mode_matrix
    notes = _check_shapes(shapes, mass, chosen)
    findings += notes
    if chosen.orthogonal and chosen.mode_matrix is None and not notes:
        error = np.linalg.norm(fit.residue_errors, axis=0) / np.linalg.norm(measured, axis=0)
        shapes = orthogonal_shapes(measured, mass, error)
    shapes = normalise_to_largest(shapes)
    progress(0.6, "matrices")
    tridiagonal = fit_tridiagonal(mass, shapes, fit.angular_frequencies)
    zeta = np.array([item.value for item in damping])
    frame = frame_from_modes(
        shapes, fit.angular_frequencies, zeta, tests.floor_masses, name="identified", source=tests.source
    )
    if chosen.stiffness_form == "tridiagonal":
        stiffness = tridiagonal.stiffness
        frame = Frame(mass, modal_damping_matrix(mass, stiffness, zeta), stiffness, "identified, tri-diagonal")
    if tridiagonal.at_bound:
        findings.append(f"tri-diagonal fit: storey {tridiagonal.at_bound[0]} ended at its bound")
    progress(0.75, "verification")
    largest = np.abs(fit.residues).max(axis=0)
    # beyond its highest mode the frame says nothing of what a flexible support does
    inside = (band[0], min(band[1], 1.15 * float(fit.angular_frequencies[-1]) / (2.0 * np.pi)))
    return FrameIdentification(
        frame=frame,
        frequencies=frequencies,
        damping=damping,
        damping_source=sources,
        sweep_damping=sweep,
        mode_shapes=shapes,
        mac=modal_assurance(measured, natural_modes(frame).mode_shapes),
        decays=decays,
        fit=fit,
        tridiagonal=tridiagonal,
        in_time=tuple(verify_in_time(frame, test, inside) for test in forced),
        in_frequency=verify_in_frequency(frame, fit, inside, forced[0].is_displacement, forced[0].shaker_floor),
        phase_scatter=np.abs(fit.residues.imag).max(axis=0) / largest,
        tests=forced,
        band_hz=band,
        findings=tuple(findings),
    )


def _check_given(options: IdentificationOptions, mass: FloatArray, floors: int) -> None:
    shapes = np.asarray(options.mode_matrix, dtype=np.float64)
    if shapes.shape != (floors, floors):
        size = " x ".join(map(str, shapes.shape))
        place = f"mode matrix {options.mode_matrix_name}"
        raise UserError(place, "", f"is {size}", f"the frame has {floors} floors: give {floors} x {floors}")
    if np.linalg.matrix_rank(shapes / np.linalg.norm(shapes, axis=0), tol=1e-8) < mass.shape[0]:
        place = f"mode matrix {options.mode_matrix_name}"
        raise UserError(place, "", "is singular: two modes have the same shape", "give independent shapes")
