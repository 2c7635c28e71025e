"""From a frame campaign to M, C, K and modes, with intervals and checks (chapter 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.errors import UserError
from mrpipe.modal.agreement import ModesOfTests, modes_of_tests, of_agreeing_tests, order_findings, without_weak_clocks
from mrpipe.modal.clocks.delays import SensorClock, corrected, expected_clocks
from mrpipe.modal.comparison import compare_with_tests
from mrpipe.modal.decays.choice import LONGER_RECORDS, choose_damping, decays_of_modes
from mrpipe.modal.decays.decay import DecayResult, Estimate
from mrpipe.modal.doubts import Doubt
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.identification import FrameIdentification, GivenShapes, errors_of_rows
from mrpipe.modal.loggers import aligned
from mrpipe.modal.matrices.assembly import Assembly, PartialModes, assemble_partial, storey_model_findings
from mrpipe.modal.matrices.declared_masses import check_declared_masses
from mrpipe.modal.matrices.exchanged import exchanged_finding, exchanged_floors
from mrpipe.modal.matrices.rigid_floors import RigidShapes, assemble_rigid, rigid_shapes
from mrpipe.modal.matrices.scaling import Scale, find_scale, masses_of
from mrpipe.modal.matrices.tridiagonal import fit_tridiagonal
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.checks import check_mode_matrix, orthogonal_shapes, reversed_finding
from mrpipe.modal.search.chosen_tests import ChosenTests, training_first
from mrpipe.modal.search.forced_modes import ModeSearch, check_channels
from mrpipe.modal.search.selection import (
    LEAST_COHERENCE,
    Layout,
    all_floors_measured,
    floor_shapes,
    sign_ranges,
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
from mrpipe.words import listed

_LOOSE_SIGNS = 0.03


def _check_coherence(fit: MultiModeFit, tests: FrameTests) -> list[str]:
    """Raise UserError if a mode is mostly noise; return warnings for single floors."""
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
        raise UserError(tests.source, place, problem, "excite this mode more strongly or longer, or reduce the noise")
    shape = np.abs(fit.residues) / np.abs(fit.residues).max(axis=0)
    for row, mode in np.argwhere((fit.coherence < LEAST_COHERENCE) & (shape > 0.3)):
        value = fit.coherence[row, mode]
        findings.append(f"floor {floors[row]}, mode {mode + 1}: coherence at the peak is only {value:.2f}")
    return findings


def _check_shapes(shapes: FloatArray, mass: FloatArray, given: GivenShapes | None) -> list[str]:
    found = check_mode_matrix(shapes, mass)
    if not found:
        return []
    message = "; ".join(item.message for item in found)
    if given is None:
        return [Doubt(f"measured mode shapes: {message}")]
    wrong = [item for item in found if item.kind in {"wrong-sign", "singular"}]
    remedy = (
        "change the sign of those elements" if wrong and wrong[0].elements else "give shapes orthogonal to the mass"
    )
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
        See :func:`~mrpipe.modal.recordings.frame_tests`.
    options
        Choices; the defaults are those of the settings.
    progress
        Called with the share that is done.
    given_shapes
        Mode shapes to use instead of the measured ones.

    Raises
    ------
    UserError
        If no mode is found, the coherence at a peak is below 0.5, or a given mode matrix is singular or not
        orthogonal to the mass.
    """
    # threads do not accelerate tall matrices with a few columns, and are slower if other work uses the cores
    with threadpool_limits(1):
        return _identify(tests, options or IdentificationOptions(), progress, given_shapes)


def _layout(tests: FrameTests) -> Layout:
    shown = (*tests.forced, *tests.ambient) or tests.decays
    directions = {sensor.direction for test in shown for sensor in test.sensors}
    if tests.positions:
        return Layout(3 * tests.floor_masses.size, None, is_chain=False)
    masses = tests.floor_masses if np.isfinite(tests.floor_masses).all() else None
    is_chain = len(directions) <= 1
    return Layout(tests.floor_masses.size, masses, is_chain, motions=1 if is_chain else 3)


@dataclass(frozen=True)
class _Damping:
    """Frequencies and damping ratios of the modes, from the fit, from decays, and as they are used for C."""

    frequencies: tuple[Estimate, ...]
    of_the_fit: tuple[Estimate, ...]
    decays: dict[int, DecayResult]
    used: tuple[Estimate, ...]
    sources: tuple[str, ...]


def _identify(
    tests: FrameTests, options: IdentificationOptions, progress: Progress, given: GivenShapes | None
) -> FrameIdentification:
    layout = _layout(tests)
    if given is not None:
        _check_given(given, tests.floor_masses)
    found = modes_of_tests(tests, layout, options, progress)
    try:
        result = _completed(tests, layout, options, progress, given, found)
    except UserError:
        again = of_agreeing_tests(found, tests, layout, options, progress)
        if again is None:
            raise
        return _completed(tests, layout, options, progress, given, again)
    if result.amplitude is None:
        again = of_agreeing_tests(found, tests, layout, options, progress)
    else:
        # laws over amplitude explain why tests differ, and a part of what looked like delays
        left = float(np.sqrt(np.mean(result.amplitude.error)))
        again = without_weak_clocks(found, left, tests, layout, options, progress)
    return result if again is None else _completed(tests, layout, options, progress, given, again)


def _completed(
    tests: FrameTests,
    layout: Layout,
    options: IdentificationOptions,
    progress: Progress,
    given: GivenShapes | None,
    found: ModesOfTests,
) -> FrameIdentification:
    """Return the structure that follows from the modes, and its comparison with the tests."""
    chosen, clocks, fit = found.chosen, found.clocks, found.chosen.search.fit
    findings = _findings_on_tests(tests, layout, found)
    progress(0.5, "decays")
    damping, damping_notes = _damping(tests, fit, options)
    progress(0.6, "matrices")
    scale, notes = find_scale(fit, tests, layout, options)
    findings += notes
    rigid = rigid_shapes(fit, tests.positions, tests.source) if tests.positions else None
    zeta = np.array([item.value for item in damping.used])
    if rigid is None:
        assembly, notes = _assemble(chosen.search, zeta, tests, layout, options, given, scale)
    else:
        assembly, notes = _assemble_rigid(fit, rigid, zeta, tests)
    findings += notes
    order = order_findings(chosen, tests, layout, options)
    findings += order
    progress(0.75, "verification")
    shown = _shown(training_first(tests.forced), chosen, clocks)
    positions = None if rigid is None else tests.positions
    compared, notes = compare_with_tests(assembly.frame, shown, chosen, positions, options, progress, found.odd)
    findings += notes
    # more data of a structure that is not the same in all tests do not make its damping more certain
    changes = found.differ or compared.amplitude is not None
    findings += [note.removesuffix(LONGER_RECORDS) if changes else note for note in damping_notes]
    is_certain = not any(isinstance(note, Doubt) for note in notes)
    unsound = assembly.exchanged or bool(order) or any(test.is_clipped for test in chosen.tests)
    masses = None if unsound else check_declared_masses(fit, layout, scale, with_scale=is_certain)
    findings += [] if masses is None else [Doubt(line) for line in masses.findings]
    doubted = masses is not None and bool(masses.findings)
    return FrameIdentification(
        frame=assembly.frame,
        frequencies=damping.frequencies,
        damping=damping.used,
        damping_source=damping.sources,
        sweep_damping=damping.of_the_fit,
        mode_shapes=assembly.shapes,
        mac=_assurance(fit, layout, assembly, rigid),
        shape_errors=errors_of_rows(assembly.shapes, *_measured_rows(fit, layout, rigid)),
        decays=damping.decays,
        fit=fit,
        tridiagonal=None if order else assembly.storeys,
        in_time=compared.in_time,
        in_frequency=compared.in_frequency,
        phase_scatter=np.abs(fit.residues.imag).max(axis=0) / np.abs(fit.residues).max(axis=0),
        tests=compared.tests,
        band_hz=chosen.search.band_hz,
        findings=tuple(map(str, findings)),
        doubts=tuple(str(line) for line in findings if isinstance(line, Doubt)),
        numbers=assembly.numbers,
        clocks=clocks,
        candidates=chosen.search.candidates,
        degrees_of_freedom=_names(fit, layout) if rigid is None else rigid.names,
        masses=assembly.masses,
        mass_intervals=masses.intervals if masses is not None and doubted else assembly.mass_intervals,
        amplitude=compared.amplitude,
        amplitude_in_time=compared.amplitude_in_time,
    )


def _findings_on_tests(tests: FrameTests, layout: Layout, found: ModesOfTests) -> list[str]:
    """Return findings on the tests and on the shapes of the modes."""
    search = found.chosen.search
    findings = [*found.findings, *tests.notes, *_shape_findings(search, layout)]
    findings += _check_coherence(search.fit, tests) if tests.forced else []
    clipped = listed([test.name for test in found.chosen.tests if test.is_clipped])
    if clipped:
        findings.append(Doubt(f"test {clipped}: shapes and damping ratios may be wrong because sensors are clipped"))
    return findings


def _shape_findings(search: ModeSearch, layout: Layout) -> list[str]:
    """Return findings on the first shape of a chain of floors: sensors with the opposite sign."""
    if not layout.is_chain or search.numbers[0] != 1:
        return []
    shapes, errors = floor_shapes(search.fit, layout)
    return [Doubt(line) for line in reversed_finding(shapes[:, 0], errors[:, 0])]


def _damping(tests: FrameTests, fit: MultiModeFit, options: IdentificationOptions) -> tuple[_Damping, list[str]]:
    decays, findings = decays_of_modes(tests, fit)
    frequencies, of_the_fit = _estimates(fit)
    if not tests.forced and not tests.ambient and options.decay_method == "exponential-fit":
        # the fit contains all modes and all decays already
        return _Damping(frequencies, of_the_fit, decays, of_the_fit, ("decay",) * len(of_the_fit)), []
    other = "sweep" if tests.forced else "ambient"
    used, sources, notes = choose_damping(of_the_fit, decays, options.damping_from, other, options.decay_method)
    return _Damping(frequencies, of_the_fit, decays, used, sources), [*findings, *notes]


def _estimates(fit: MultiModeFit) -> tuple[tuple[Estimate, ...], tuple[Estimate, ...]]:
    """Return angular frequencies [rad/s] and damping ratios of the fit, with their intervals."""
    modes = fit.angular_frequencies.size
    poles = np.concatenate([fit.angular_frequencies, fit.damping_ratios])
    freedom = fit.freedom if fit.freedom.size else np.full(poles.size, np.inf)
    errors = np.sqrt(np.diag(fit.covariance))
    estimates = tuple(map(Estimate.of_logarithm, poles.tolist(), errors.tolist(), freedom.tolist()))
    return estimates[:modes], estimates[modes:]


def _shown(forced: Sequence[FrameTest], chosen: ChosenTests, clocks: Sequence[SensorClock]) -> tuple[FrameTest, ...]:
    """Return the forced tests with corrected delays of their sensors, also those that were not fitted."""
    fitted = {test.name: test for test in chosen.tests}
    others = [test for test in forced if test.name not in fitted]
    # a test that was not fitted has delays of its own only where its loggers are far apart
    own = [item for item in clocks if item.test not in fitted]
    known = {item.test for item in own}
    delays = expected_clocks(clocks, chosen.tests, [test for test in others if test.name not in known])
    return tuple(fitted[test.name] if test.name in fitted else aligned(corrected(test, delays), own) for test in forced)


def _measured_rows(fit: MultiModeFit, layout: Layout, rigid: RigidShapes | None) -> tuple[FloatArray, FloatArray]:
    """Return measured shapes and their errors in the rows of the result."""
    if rigid is not None:
        return rigid.shapes, rigid.errors
    return floor_shapes(fit, layout) if layout.is_chain else (fit.residues.real, fit.residue_errors)


def _names(fit: MultiModeFit, layout: Layout) -> tuple[str, ...]:
    if layout.is_chain:
        return tuple(f"floor {floor}" for floor in range(1, layout.floors + 1))
    return tuple(f"floor {sensor.floor} {sensor.direction}".strip() for sensor in fit.sensors)


def _assemble_rigid(
    fit: MultiModeFit, rigid: RigidShapes, zeta: FloatArray, tests: FrameTests
) -> tuple[Assembly, list[str]]:
    axis = next((place.direction for place in fit.inputs if place.direction), "x")
    assembly = assemble_rigid(fit, rigid, zeta, tests.floor_masses, tests.inertias, axis)
    return assembly, list(assembly.findings)


def _assemble(
    search: ModeSearch,
    zeta: FloatArray,
    tests: FrameTests,
    layout: Layout,
    options: IdentificationOptions,
    given: GivenShapes | None,
    scale: Scale,
) -> tuple[Assembly, list[str]]:
    """Return the structure: by (3.14) to (3.18) if modes and sensors are complete, else by a storey model."""
    fit = search.fit
    if layout.masses is None and given is None:
        masses = masses_of(fit, layout, tests.floor_masses, scale)
        if masses is not None:
            known = replace(tests, floor_masses=masses.masses)
            assembly, findings = _assemble(
                search, zeta, known, replace(layout, masses=masses.masses), options, None, scale
            )
            text = f"unknown masses follow from the orthogonality of the modes and from {scale.source}"
            return replace(assembly, mass_intervals=masses.intervals), [text, *findings]
    complete = search.numbers == tuple(range(1, layout.floors + 1)) and all_floors_measured(fit, layout)
    if layout.masses is None or not (complete or given is not None):
        assembly = assemble_partial(_partial(search, zeta, layout, scale), tests.floor_masses, layout, tests.source)
        return assembly, list(assembly.findings)
    mass = mass_matrix(layout.masses, source=tests.source)
    measured, errors = floor_shapes(fit, layout)
    shapes = measured if given is None else given.shapes
    findings = _check_shapes(shapes, mass, given)
    if options.orthogonal_shapes and given is None and not findings:
        shapes = orthogonal_shapes(measured, mass, np.linalg.norm(errors, axis=0) / np.linalg.norm(measured, axis=0))
    shapes = normalise_to_largest(shapes)
    places = exchanged_floors(layout.masses, measured, errors, fit.angular_frequencies) if given is None else ()
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
    if places:
        findings.append(Doubt(exchanged_finding(places)))
    else:
        findings += storey_model_findings(storeys, search.numbers, "K follows from the modes instead")
    assembly = Assembly(frame, shapes, search.numbers, storeys, layout.masses, intervals, ())
    return replace(assembly, storeys=None if places else storeys, exchanged=bool(places)), findings


def _partial(search: ModeSearch, zeta: FloatArray, layout: Layout, scale: Scale) -> PartialModes:
    fit = search.fit
    if not layout.is_chain:
        rows = tuple(range(len(fit.sensors)))
        open_numbers = ((1, len(rows)),) * zeta.size
        return PartialModes(fit.angular_frequencies, zeta, fit.residues.real, fit.residue_errors, rows, open_numbers)
    shapes, errors = floor_shapes(fit, layout)
    measured = tuple(sorted({sensor.floor - 1 for sensor in fit.sensors}))
    # the mode numbers of the search rise; ranges without this condition can contradict each other
    ranges = zip(sign_ranges(fit, layout, _LOOSE_SIGNS), search.numbers, strict=True)
    possible = tuple((min(low + 1, number), max(high + 1, number)) for (low, high), number in ranges)
    if len(search.numbers) == layout.floors:
        possible = tuple((number, number) for number in search.numbers)
    return PartialModes(
        angular_frequencies=fit.angular_frequencies,
        damping_ratios=zeta,
        shapes=shapes,
        errors=errors,
        measured=measured,
        possible_numbers=possible,
        scaled_residues=scale.residues,
        driven=scale.floor - 1,
        scale_errors=scale.errors,
        scaled_by=scale.source,
    )


def _assurance(fit: MultiModeFit, layout: Layout, assembly: Assembly, rigid: RigidShapes | None = None) -> FloatArray:
    """Return the modal assurance (MAC) of measured shapes with the modes of the frame, at the measured floors."""
    if rigid is not None and assembly.frame is not None:
        return modal_assurance(rigid.shapes, natural_modes(assembly.frame).mode_shapes)
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
