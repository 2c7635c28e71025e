"""From a frame campaign to M, C, K and modes, with intervals and checks (chapter 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.errors import UserError
from mrpipe.modal.ambient import find_ambient_modes
from mrpipe.modal.assembly import Assembly, PartialModes, assemble_partial
from mrpipe.modal.checks import LARGEST_COUPLING, check_mode_matrix, modal_coupling, orthogonal_shapes
from mrpipe.modal.clocks import SensorClock, added, corrected, estimate_clocks
from mrpipe.modal.decay import DecayResult, Estimate, analyse_decay
from mrpipe.modal.lscf import PoleCandidate
from mrpipe.modal.multimode import MultiModeFit, fit_modes
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests, Place
from mrpipe.modal.search import ModeSearch, check_channels, find_modes
from mrpipe.modal.selection import (
    LEAST_COHERENCE,
    Layout,
    all_floors_measured,
    floor_shapes,
    real_modes,
    sign_ranges,
)
from mrpipe.modal.spectra import record_spectrum, thinned
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
_ENOUGH_COHERENCE = 0.9
_LOOSE_SIGNS = 0.03
_CLOCK_ROUNDS = 3
_CLOCK_LINES = 4000
_WIDEST_DECAY_INTERVAL = 0.02


@dataclass(frozen=True)
class GivenShapes:
    """Mode shapes to use in place of the measured ones, shape (n, n), and their name for messages."""

    shapes: FloatArray
    name: str = ""


@dataclass(frozen=True)
class FrameIdentification:
    """Everything that identification found, n floors and r modes.

    Attributes
    ----------
    frame
        M, C, K; None where the data determine modes only.
    frequencies
        Natural angular frequencies with intervals [rad/s].
    damping
        Damping ratios that went into C, with intervals.
    damping_source
        `decay`, `sweep`, or `decay and sweep` where the decay is uncertain, a mode.
    sweep_damping
        Damping ratios of the multi-mode fit of the forced tests: the second method.
    mode_shapes
        Shape (n, r), largest element of a mode +1; nan at floors where nothing determines it. With several directions:
        a row a sensor.
    mac
        Shape (r, r): measured shapes against the same modes of the frame (against themselves without a frame).
    decays
        One a mode at most (the most certain one); modes without a decay are missing.
    fit, tridiagonal, in_time, in_frequency
        Parts, for the artifact and the report; None or empty where there is no frame.
    phase_scatter
        Shape (n,): largest imaginary part of a mode's residues over the largest residue.
    tests
        The forced tests, those of the fit first; all are simulated for verification.
    band_hz
        Band of the fit.
    findings
        What the user should know, one line each.
    numbers
        Mode number (from 1) of each mode.
    clocks
        Delays of the sensors that were corrected.
    candidates
        The stabilisation chart: poles that appear at several model orders.
    degrees_of_freedom
        Name of each row of `mode_shapes`.
    masses, mass_intervals
        Shape (n,) and (n, 2) [kg]; nan where unknown.
    """

    frame: Frame | None
    frequencies: tuple[Estimate, ...]
    damping: tuple[Estimate, ...]
    damping_source: tuple[str, ...]
    sweep_damping: tuple[Estimate, ...]
    mode_shapes: FloatArray
    mac: FloatArray
    decays: dict[int, DecayResult]
    fit: MultiModeFit
    tridiagonal: TridiagonalFit | None
    in_time: tuple[TimeVerification, ...]
    in_frequency: FrequencyVerification | None
    phase_scatter: FloatArray
    tests: tuple[FrameTest, ...]
    band_hz: tuple[float, float]
    findings: tuple[str, ...]
    numbers: tuple[int, ...]
    clocks: tuple[SensorClock, ...]
    candidates: tuple[PoleCandidate, ...]
    degrees_of_freedom: tuple[str, ...]
    masses: FloatArray
    mass_intervals: FloatArray


def _training_first(tests: tuple[FrameTest, ...]) -> tuple[FrameTest, ...]:
    return tuple(sorted(tests, key=lambda test: test.role == "validation"))


@dataclass(frozen=True)
class _Chosen:
    """Modes found, and the tests of the fit (delays of their sensors corrected)."""

    search: ModeSearch
    tests: tuple[FrameTest, ...]


def _find(
    forced: tuple[FrameTest, ...], tests: FrameTests, layout: Layout, options: IdentificationOptions
) -> tuple[_Chosen, list[str]]:
    """Find the modes in the tests that are not for validation; in more tests where modes are weak or missing there."""
    first = tuple(test for test in forced if test.role != "validation") or forced
    arguments = (layout, options.band_low_hz, options.band_high_hz, tests.source, tests.decays)
    sets = [first]
    # sweeps put more energy into each mode than random motion, and fewer tests are fitted sooner
    for more in (tuple(test for test in forced if test.kind == "sweep"), forced):
        if len(more) > len(sets[-1]):
            sets.append(more)
    found: list[_Chosen] = []
    fault: UserError | None = None
    for chosen in sets:
        try:
            found.append(_Chosen(find_modes(chosen, *arguments), chosen))
        except UserError as error:
            fault = error
            continue
        if _is_sound(found[-1].search.fit, layout):
            break
    if not found:
        raise fault or UserError(tests.source, "forced tests", "no mode found", "check the channels")
    # of several doubtful sets the one with most modes counts, and among equals the one that leaves validation tests out
    sound = [item for item in found if _is_sound(item.search.fit, layout)]
    best = max(sound or found, key=lambda item: (len(item.search.numbers), -_largest_coupling(item.search.fit, layout)))
    used = [test.name for test in best.tests if test.role == "validation" and test not in first]
    notes = [f"modes are weak in the training tests: validation tests were used in the fit ({', '.join(used)})"]
    return best, notes if used else []


def _is_sound(fit: MultiModeFit, layout: Layout) -> bool:
    """Return whether all modes were found, each stands out, and the shapes are orthogonal to the mass."""
    if fit.mode_coherence().min() < _ENOUGH_COHERENCE:
        return False
    if not layout.is_chain or layout.masses is None or not all_floors_measured(fit, layout):
        return fit.angular_frequencies.size >= layout.floors
    return fit.angular_frequencies.size == layout.floors and _largest_coupling(fit, layout) <= LARGEST_COUPLING


def _largest_coupling(fit: MultiModeFit, layout: Layout) -> float:
    """Return the largest element off the diagonal of the scaled U'MU; zero where it cannot be known."""
    if layout.masses is None or not all_floors_measured(fit, layout):
        return 0.0
    coupling = modal_coupling(floor_shapes(fit, layout)[0], np.diag(layout.masses))
    return float(np.abs(np.triu(coupling, 1)).max())


def _imaginary_part(fit: MultiModeFit) -> float:
    """Return the squared imaginary parts of the residues over their variance, summed."""
    return float(np.sum(np.square(fit.residues.imag / np.maximum(fit.residue_errors, 1e-300))))


def _with_clocks(
    chosen: _Chosen, tests: FrameTests, layout: Layout, options: IdentificationOptions
) -> tuple[_Chosen, tuple[SensorClock, ...]]:
    """Correct the clocks of the sensors where that makes the mode shapes real, and search again."""
    clocks: list[SensorClock] = []
    moved = chosen.tests
    fit = chosen.search.fit
    before = _imaginary_part(fit)
    for round_number in range(_CLOCK_ROUNDS):
        new = [item for item in estimate_clocks(fit, moved, steps=round_number == 0) if not item.is_zero]
        if not new:
            break
        clocks = added(clocks, new)
        moved = tuple(corrected(test, clocks) for test in chosen.tests)
        lines = [(item.omega[0], item.omega[-1]) for item in fit.spectra]
        band = (min(low for low, _ in lines) / (2.0 * np.pi), max(high for _, high in lines) / (2.0 * np.pi))
        spectra = thinned([record_spectrum(test, band) for test in moved], _CLOCK_LINES)
        fit = fit_modes(spectra, fit.angular_frequencies, fit.damping_ratios, passes=2, evaluations=10)
    cost = 2.0 * len(clocks) * np.log(max(fit.residues.size, 2))
    if not clocks or _imaginary_part(fit) + cost > before:
        return chosen, ()
    again = find_modes(moved, layout, options.band_low_hz, options.band_high_hz, tests.source, tests.decays)
    if len(again.numbers) < len(chosen.search.numbers):
        return chosen, ()
    return _Chosen(again, moved), tuple(clocks)


def _ambient_findings(tests: FrameTests) -> list[str]:
    scale = "given floor masses" if np.isfinite(tests.floor_masses).any() else "nothing"
    return [
        "the excitation was not measured: modal masses and participations cannot be known; the scale of M, C and K "
        f"comes from {scale}"
    ]


def _without_complex(search: ModeSearch) -> ModeSearch:
    """Return the modes without those whose shape is not real even with correct clocks: they are no modes."""
    kept = real_modes(search.fit)
    if not kept or len(kept) == len(search.numbers):
        return search
    return replace(search, fit=search.fit.only(kept), numbers=tuple(search.numbers[i] for i in kept))


def _clock_findings(clocks: Sequence[SensorClock]) -> list[str]:
    findings = []
    for name in dict.fromkeys(item.test for item in clocks):
        own = [item for item in clocks if item.test == name]
        delays = ", ".join(_delay_text(item) for item in own)
        findings.append(f"test {name}: clocks of sensors were corrected ({delays})")
    return findings


def _delay_text(clock: SensorClock) -> str:
    text = f"floor {clock.sensor.floor}{clock.sensor.direction} {1e3 * clock.offset_s:+.2f} ms"
    if clock.drift:
        text += f" and {1e6 * clock.drift:+.1f} us/s"
    if clock.step_s:
        text += f" and {1e3 * clock.step_s:+.2f} ms from {clock.step_at_s:.3g} s"
    return text


def _check_coherence(fit: MultiModeFit, tests: FrameTests) -> list[str]:
    """Raise where a mode is mostly noise; return warnings for single floors."""
    findings = []
    frequency = fit.angular_frequencies / (2.0 * np.pi)
    floors = [sensor.floor for sensor in fit.sensors]
    check_channels(fit.coherence, floors, tests.source)
    pooled = fit.mode_coherence()
    weak = np.flatnonzero(pooled < LEAST_COHERENCE)
    if weak.size:
        mode = int(weak[0])
        place = f"mode {mode + 1} at {frequency[mode]:.3g} Hz"
        problem = f"coherence at the peak is {pooled[mode]:.2f}, below {LEAST_COHERENCE:g}"
        raise UserError(tests.source, place, problem, "excite it harder or longer, or reduce the noise")
    shape = np.abs(fit.residues) / np.abs(fit.residues).max(axis=0)
    for row, mode in np.argwhere((fit.coherence < LEAST_COHERENCE) & (shape > 0.3)):
        value = fit.coherence[row, mode]
        findings.append(f"floor {floors[row]}, mode {mode + 1}: coherence at the peak is only {value:.2f}")
    return findings


def _decays(tests: FrameTests, fit: MultiModeFit) -> tuple[dict[int, DecayResult], list[str]]:
    results: dict[int, DecayResult] = {}
    findings = []
    for test in tests.decays:
        common, shapes = _same_sensors(test, fit)
        if common is None:
            findings.append(f"test {test.name}: none of its sensors is in a forced test; it was left out")
            continue
        result = analyse_decay(common, shapes, fit.angular_frequencies, fit.damping_ratios)
        if result is None:
            findings.append(
                f"test {test.name}: fewer than six peaks of a free decay stand out of the noise; it was left out"
            )
            continue
        known = results.get(result.mode)
        if known is None or result.exponential_fit.half_width < known.exponential_fit.half_width:
            results[result.mode] = result
    return results, findings


def _same_sensors(test: FrameTest, fit: MultiModeFit) -> tuple[FrameTest | None, FloatArray]:
    """Return a decay test with the sensors that the fit knows as well, and the shapes at those, shape (s, r)."""
    known = [Place(sensor.floor, sensor.direction) for sensor in fit.sensors]
    columns = [i for i, sensor in enumerate(test.sensors) if Place(sensor.floor, sensor.direction) in known]
    if not columns:
        return None, np.zeros((0, fit.angular_frequencies.size))
    places = tuple(Place(test.sensors[i].floor, test.sensors[i].direction) for i in columns)
    part = replace(
        test,
        responses=test.responses[:, columns],
        is_displacement=tuple(test.is_displacement[i] for i in columns),
        places=places,
    )
    return part, np.real(fit.residues[[known.index(place) for place in places]])


def _pooled(first: Estimate, second: Estimate) -> Estimate:
    weights = np.array([1.0 / max(item.half_width, 1e-12) ** 2 for item in (first, second)])
    value = float(weights @ [first.value, second.value] / weights.sum())
    return Estimate.of(value, float(1.0 / np.sqrt(weights.sum())) / _NORMAL_95)


def _choose_damping(
    sweep: tuple[Estimate, ...], decays: dict[int, DecayResult], damping_from: str, other: str
) -> tuple[tuple[Estimate, ...], tuple[str, ...], list[str]]:
    chosen: list[Estimate] = []
    sources: list[str] = []
    findings: list[str] = []
    for mode, second in enumerate(sweep, start=1):
        decay = decays.get(mode)
        first = decay.exponential_fit if decay else None
        if first is None or damping_from != "decay":
            chosen.append(second)
            sources.append(other)
        elif first.half_width <= _WIDEST_DECAY_INTERVAL * first.value:
            chosen.append(first)
            sources.append("decay")
        else:
            # neither is sure: the mean of two independent methods, each by its certainty
            chosen.append(_pooled(first, second))
            sources.append(f"decay and {other}")
        if first is None and damping_from == "decay":
            findings.append(f"mode {mode}: no free decay, damping from the {other}")
        if first is not None:
            apart = abs(first.value - second.value)
            if apart > first.half_width + second.half_width + 0.1 * second.value:
                findings.append(f"mode {mode}: damping is {first.value:.2g} by decay, {second.value:.2g} by sweep")
    return tuple(chosen), tuple(sources), findings


def _check_shapes(shapes: FloatArray, mass: FloatArray, given: GivenShapes | None) -> list[str]:
    found = check_mode_matrix(shapes, mass)
    if not found:
        return []
    message = "; ".join(item.message for item in found)
    if given is None:
        return [f"measured mode shapes: {message}"]
    wrong = [item for item in found if item.kind in {"wrong-sign", "singular"}]
    remedy = "turn the sign of those elements" if wrong and wrong[0].elements else "give shapes orthogonal to the mass"
    raise UserError(f"mode matrix {given.name}", "", message, remedy)


def identify_frame(
    tests: FrameTests,
    options: IdentificationOptions | None = None,
    progress: Progress = no_progress,
    given_shapes: GivenShapes | None = None,
) -> FrameIdentification:
    """Identify a frame from its forced and decay tests.

    Parameters
    ----------
    tests
        See :func:`~mrpipe.modal.records.frame_tests`.
    options
        Choices; the defaults are those of the settings.
    progress
        Called with the share that is done.
    given_shapes
        Mode shapes to use in place of the measured ones.

    Raises
    ------
    UserError
        If no mode is found, the coherence at a peak is below 0.5, or a given mode matrix is singular or not
        orthogonal to the mass.
    """
    # tall matrices of a few columns gain nothing from threads, and slow down where other work shares the cores
    with threadpool_limits(1):
        return _identify(tests, options or IdentificationOptions(), progress, given_shapes)


def _layout(tests: FrameTests) -> Layout:
    directions = {sensor.direction for test in (*tests.forced, *tests.ambient) for sensor in test.sensors}
    masses = tests.floor_masses if np.isfinite(tests.floor_masses).all() else None
    return Layout(tests.floor_masses.size, masses, is_chain=len(directions) <= 1)


def _identify(
    tests: FrameTests, options: IdentificationOptions, progress: Progress, given: GivenShapes | None
) -> FrameIdentification:
    layout = _layout(tests)
    forced = _training_first(tests.forced)
    if given is not None:
        _check_given(given, tests.floor_masses)
    progress(0.05, "poles")
    clocks: tuple[SensorClock, ...] = ()
    if not forced:
        band = (options.band_low_hz, options.band_high_hz)
        chosen = _Chosen(find_ambient_modes(tests.ambient, layout, *band, tests.source), ())
        findings = _ambient_findings(tests)
    else:
        chosen, findings = _find(forced, tests, layout, options)
    if tests.ambient and forced:
        findings.append("ambient tests were not used, because forced tests determine the modes better")
    if options.clock_correction and forced:
        progress(0.3, "clocks")
        chosen, clocks = _with_clocks(chosen, tests, layout, options)
        findings += _clock_findings(clocks)
        chosen = _Chosen(_without_complex(chosen.search), chosen.tests)
    fit = chosen.search.fit
    findings += _check_coherence(fit, tests) if forced else []
    progress(0.5, "decays")
    decays, notes = _decays(tests, fit)
    findings += notes
    modes = fit.angular_frequencies.size
    error = np.sqrt(np.diag(fit.covariance))
    frequencies = tuple(Estimate.of(w, w * e) for w, e in zip(fit.angular_frequencies, error[:modes], strict=True))
    sweep = tuple(Estimate.of(z, z * e) for z, e in zip(fit.damping_ratios, error[modes:], strict=True))
    damping, sources, notes = _choose_damping(sweep, decays, options.damping_from, "sweep" if forced else "ambient")
    findings += notes
    progress(0.6, "matrices")
    zeta = np.array([item.value for item in damping])
    assembly, notes = _assemble(chosen.search, zeta, tests, layout, options, given)
    findings += notes
    progress(0.75, "verification")
    corrected_tests = {test.name: test for test in chosen.tests}
    shown = tuple(corrected_tests.get(test.name, test) for test in forced)
    # beyond its highest mode the frame says nothing of what a flexible support does
    band = chosen.search.band_hz
    inside = (band[0], min(band[1], 1.15 * float(fit.angular_frequencies[-1]) / (2.0 * np.pi)))
    frame = assembly.frame
    return FrameIdentification(
        frame=frame,
        frequencies=frequencies,
        damping=damping,
        damping_source=sources,
        sweep_damping=sweep,
        mode_shapes=assembly.shapes,
        mac=_assurance(fit, layout, assembly),
        decays=decays,
        fit=fit,
        tridiagonal=assembly.storeys,
        in_time=() if frame is None or not forced else tuple(verify_in_time(frame, test, inside) for test in shown),
        in_frequency=None if frame is None or not forced else verify_in_frequency(frame, fit, inside),
        phase_scatter=np.abs(fit.residues.imag).max(axis=0) / np.abs(fit.residues).max(axis=0),
        tests=shown,
        band_hz=band,
        findings=tuple(findings),
        numbers=assembly.numbers,
        clocks=clocks,
        candidates=chosen.search.candidates,
        degrees_of_freedom=_names(fit, layout),
        masses=assembly.masses,
        mass_intervals=assembly.mass_intervals,
    )


def _names(fit: MultiModeFit, layout: Layout) -> tuple[str, ...]:
    if layout.is_chain:
        return tuple(f"floor {floor}" for floor in range(1, layout.floors + 1))
    return tuple(f"floor {sensor.floor} {sensor.direction}".strip() for sensor in fit.sensors)


def _assemble(
    search: ModeSearch,
    zeta: FloatArray,
    tests: FrameTests,
    layout: Layout,
    options: IdentificationOptions,
    given: GivenShapes | None,
) -> tuple[Assembly, list[str]]:
    """Return the structure: by (3.14) to (3.18) where modes and sensors are complete, else by a storey model."""
    fit = search.fit
    complete = search.numbers == tuple(range(1, layout.floors + 1)) and all_floors_measured(fit, layout)
    if layout.masses is None or not (complete or given is not None):
        assembly = assemble_partial(_partial(search, zeta, layout), tests.floor_masses, layout, tests.source)
        return assembly, list(assembly.findings)
    mass = mass_matrix(layout.masses, source=tests.source)
    measured, errors = floor_shapes(fit, layout)
    shapes = measured if given is None else given.shapes
    findings = _check_shapes(shapes, mass, given)
    if options.orthogonal_shapes and given is None and not findings:
        shapes = orthogonal_shapes(measured, mass, np.linalg.norm(errors, axis=0) / np.linalg.norm(measured, axis=0))
    shapes = normalise_to_largest(shapes)
    storeys = fit_tridiagonal(mass, shapes, fit.angular_frequencies)
    frame = frame_from_modes(
        shapes, fit.angular_frequencies, zeta, layout.masses, name="identified", source=tests.source
    )
    if options.stiffness_form == "tridiagonal":
        stiffness = storeys.stiffness
        frame = Frame(mass, modal_damping_matrix(mass, stiffness, zeta), stiffness, "identified, tri-diagonal")
    if storeys.at_bound:
        findings.append(f"tri-diagonal fit: storey {storeys.at_bound[0]} ended at its bound")
    intervals = np.column_stack([layout.masses, layout.masses])
    return Assembly(frame, shapes, search.numbers, storeys, layout.masses, intervals, ()), findings


def _partial(search: ModeSearch, zeta: FloatArray, layout: Layout) -> PartialModes:
    fit = search.fit
    if not layout.is_chain:
        rows = tuple(range(len(fit.sensors)))
        open_numbers = ((1, len(rows)),) * zeta.size
        return PartialModes(fit.angular_frequencies, zeta, fit.residues.real, fit.residue_errors, rows, open_numbers)
    shapes, errors = floor_shapes(fit, layout)
    measured = tuple(sorted({sensor.floor - 1 for sensor in fit.sensors}))
    possible = tuple((low + 1, high + 1) for low, high in sign_ranges(fit, layout, _LOOSE_SIGNS))
    scaled, driven = _scaled_residues(fit)
    return PartialModes(fit.angular_frequencies, zeta, shapes, errors, measured, possible, scaled, driven)


def _scaled_residues(fit: MultiModeFit) -> tuple[FloatArray | None, int]:
    """Return acceleration over force [1/kg] of each mode at a floor where a measured force acts and a sensor is."""
    for column, place in enumerate(fit.inputs):
        rows = [i for i, sensor in enumerate(fit.sensors) if sensor[:2] == place[:2] and place.floor > 0]
        if rows:
            values = fit.input_residues[rows[0], column].real
            # the sign of a recorded force is a matter of convention: the driving point always follows the force
            return np.asarray(values * np.sign(np.nansum(values))), place.floor - 1
    return None, -1


def _assurance(fit: MultiModeFit, layout: Layout, assembly: Assembly) -> FloatArray:
    """Return the modal assurance of measured shapes against the same modes of the frame, at the measured floors."""
    if assembly.frame is None:
        return modal_assurance(fit.residues.real, fit.residues.real)
    rows = sorted({sensor.floor - 1 for sensor in fit.sensors})
    model = natural_modes(assembly.frame).mode_shapes[:, np.asarray(assembly.numbers) - 1]
    return modal_assurance(floor_shapes(fit, layout)[0][rows], model[rows])


def _check_given(given: GivenShapes, masses: FloatArray) -> None:
    shapes = np.asarray(given.shapes, dtype=np.float64)
    floors = masses.size
    place = f"mode matrix {given.name}"
    if not np.isfinite(masses).all():
        raise UserError(place, "", "needs the floor masses", "give frame.floor_masses_kg in campaign.yaml")
    if shapes.shape != (floors, floors):
        size = " x ".join(map(str, shapes.shape))
        raise UserError(place, "", f"is {size}", f"the frame has {floors} floors: give {floors} x {floors}")
    if np.linalg.matrix_rank(shapes / np.linalg.norm(shapes, axis=0), tol=1e-8) < floors:
        raise UserError(place, "", "is singular: two modes have the same shape", "give independent shapes")
