"""Selection of the fitted poles that are modes of the structure.

A pole is usable if its damping is plausible, its response coherent and its shape known. Of the usable poles, those are
taken that can be the modes of one structure: shapes orthogonal to the mass, and, for a chain of floors, one more sign
change from mode to mode. If fewer poles pass than the structure has floors, the largest set of possible modes is
returned with the mode numbers that it allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.search.checks import modal_coupling, possible_sign_changes

LEAST_COHERENCE = 0.5
LARGEST_DAMPING = 0.1
"""Largest damping ratio of a mode of usual damping."""
LEAST_DAMPING = 2e-6
_DIVERGED_DAMPING = 0.25
_CERTAIN = 0.02
"""Relative standard error of a damping ratio below which it is certain."""
_PHASE_LEVEL = 1e-3
"""Probability of a real shape with the measured phases below which noise does not explain them."""
_PROPORTIONAL = 0.3
"""Largest imaginary share of a shape that damping which is not proportional, or a small delay, may cause."""
_UNKNOWN_SHAPE = 0.35
_LARGEST_IMAGINARY = 0.6
_LARGEST_COUPLING = 0.15
_SAME_SHAPE = 0.6
_SAME_SAMPLED_SHAPE = 0.9
_SHAPE_TOLERANCE = 0.01
_LOOSE_TOLERANCE = 0.03


@dataclass(frozen=True)
class Layout:
    """Prior knowledge of the structure for the selection of its modes.

    Attributes
    ----------
    floors
        Number of floors.
    masses
        Shape (floors,) [kg]; None if they are unknown.
    is_chain
        Whether all sensors measure in one direction, so that mode r has r - 1 sign changes.
    motions
        Motions of each floor, each of which has a mode: 3 where a floor moves in two directions and turns.
    """

    floors: int
    masses: FloatArray | None
    is_chain: bool = True
    motions: int = 1

    @property
    def modes(self) -> int:
        """Largest number of modes that are sought."""
        return self.floors * self.motions


def floor_shapes(fit: MultiModeFit, layout: Layout) -> tuple[FloatArray, FloatArray]:
    """Return shapes and their errors at all floors, shape (floors, r); zero and infinite at floors without a sensor."""
    shapes = np.zeros((layout.floors, fit.residues.shape[1]))
    errors = np.full(shapes.shape, np.inf)
    for row, sensor in enumerate(fit.sensors):
        better = np.linalg.norm(fit.residue_errors[row]) < np.linalg.norm(errors[sensor.floor - 1])
        if better:
            shapes[sensor.floor - 1] = fit.residues[row].real
            errors[sensor.floor - 1] = fit.residue_errors[row]
    return shapes, errors


def all_floors_measured(fit: MultiModeFit, layout: Layout) -> bool:
    """Return whether each floor of a chain has a sensor."""
    return layout.is_chain and {sensor.floor for sensor in fit.sensors} == set(range(1, layout.floors + 1))


def strength(fit: MultiModeFit) -> FloatArray:
    """Return the peak of each mode over noise, largest over sensors: |residue| / (2 zeta), shape (r,)."""
    peak = np.abs(fit.residues) / (2.0 * fit.damping_ratios)
    return np.asarray((peak / np.sqrt(fit.noise_variance)[:, None]).max(axis=0))


def certainty(fit: MultiModeFit) -> FloatArray:
    """Return the reciprocal standard error of the logarithm of each damping ratio, shape (r,).

    It compares a mode with the noise at its own frequency. Noise of the excitation and errors of the model are largest
    near strong peaks, so a spurious pole there is uncertain although its response is strong.
    """
    modes = fit.angular_frequencies.size
    return np.asarray(1.0 / np.sqrt(np.maximum(np.diag(fit.covariance)[modes:], 1e-30)))


def shape_errors(fit: MultiModeFit) -> FloatArray:
    """Return the error of each shape over its norm, shape (r,)."""
    norm = np.maximum(np.linalg.norm(fit.residues, axis=0), 1e-300)
    return np.asarray(np.linalg.norm(fit.residue_errors, axis=0) / norm)


def usable(fit: MultiModeFit, *, with_heavy: bool = False) -> BoolArray:
    """Return the poles that may be modes: plausible damping, coherent response, known shape.

    Parameters
    ----------
    fit
        Poles and their shapes.
    with_heavy
        Whether a damping ratio may exceed :data:`LARGEST_DAMPING` where the data determine it well. A pole that only
        describes noise or modes outside the band is heavily damped, too, but its damping is uncertain.
    """
    inside = (fit.damping_ratios < LARGEST_DAMPING) & (fit.damping_ratios > LEAST_DAMPING)
    if with_heavy:
        inside |= (fit.damping_ratios < _DIVERGED_DAMPING) & (certainty(fit) > 1.0 / _CERTAIN)
    return np.asarray(inside & (fit.mode_coherence() >= LEAST_COHERENCE) & (shape_errors(fit) < _UNKNOWN_SHAPE))


def imaginary_share(fit: MultiModeFit) -> FloatArray:
    """Return the norm of the imaginary part of each shape over the norm of the shape, shape (r,)."""
    norm = np.maximum(np.linalg.norm(fit.residues, axis=0), 1e-300)
    return np.asarray(np.linalg.norm(fit.residues.imag, axis=0) / norm)


def real_modes(fit: MultiModeFit) -> list[int]:
    """Return the poles whose shape is real enough for a lightly damped structure; clocks must have been corrected."""
    return [int(i) for i in np.flatnonzero(imaginary_share(fit) <= _LARGEST_IMAGINARY)]


def contradictory_phases(fit: MultiModeFit) -> BoolArray:
    """Return the uncertain poles whose shape is more complex than its errors explain, shape (r,).

    The shape of a weak mode is complex by noise only, if the damping is proportional and the clocks of the sensors were
    corrected. A pole that describes errors of the model instead, for example where the excitation ends, has any phases.
    """
    ratio = fit.residues.imag / np.maximum(fit.residue_errors, 1e-300)
    chance = stats.chi2.sf(np.sum(ratio**2, axis=0), fit.residues.shape[0])
    uncertain = certainty(fit) < 1.0 / _CERTAIN
    return np.asarray(uncertain & (chance < _PHASE_LEVEL) & (imaginary_share(fit) > _PROPORTIONAL))


def sound(fit: MultiModeFit) -> list[int]:
    """Return the poles that neither diverged nor coincide with a stronger one."""
    size = strength(fit)
    kept: list[int] = []
    for index in np.argsort(-size):
        omega = fit.angular_frequencies[index]
        apart = [abs(omega - fit.angular_frequencies[other]) > 1e-3 * omega for other in kept]
        if LEAST_DAMPING < fit.damping_ratios[index] < _DIVERGED_DAMPING and all(apart):
            kept.append(int(index))
    return sorted(kept)


def couplings(fit: MultiModeFit, layout: Layout) -> tuple[FloatArray, FloatArray, float]:
    """Return U'MU of all poles, its largest element within errors, and the value from which two shapes are the same.

    If masses or floors are missing, shapes of different modes are not orthogonal, and only equal shapes are detected.
    """
    if layout.masses is not None and all_floors_measured(fit, layout):
        coupling = modal_coupling(floor_shapes(fit, layout)[0], np.diag(layout.masses))
        error = shape_errors(fit)
        return coupling, np.minimum(_LARGEST_COUPLING + 2.0 * np.add.outer(error, error), _SAME_SHAPE), _SAME_SHAPE
    coupling = modal_coupling(fit.residues.real, np.eye(len(fit.sensors)))
    return coupling, np.full(coupling.shape, _SAME_SAMPLED_SHAPE), _SAME_SAMPLED_SHAPE


def sign_ranges(fit: MultiModeFit, layout: Layout, tolerance: float = _SHAPE_TOLERANCE) -> list[tuple[int, int]]:
    """Return the least and the largest number of sign changes of each shape; a missing sensor widens the range."""
    shapes, errors = floor_shapes(fit, layout)
    largest = np.abs(shapes).max(axis=0)
    return [
        possible_sign_changes(shape, np.maximum(error, tolerance * size))
        for shape, error, size in zip(shapes.T, errors.T, largest, strict=True)
    ]


def complete_set(fit: MultiModeFit, layout: Layout, *, resolved: bool = False) -> tuple[int, ...]:
    """Return one pole for each floor; empty if no such set exists.

    The modes are the lowest poles of which each has one more sign change and that are orthogonal to the mass. The peak
    of a flexible support above the band has the shape of the highest mode, so the lowest possible choice is taken.
    Heavily damped poles are considered where the others give no complete set. `resolved`: as for :func:`largest_set`.
    """
    if not layout.is_chain:
        return ()
    found = _complete_of(fit, layout, usable(fit), resolved=resolved)
    return found or _complete_of(fit, layout, usable(fit, with_heavy=True), resolved=resolved)


def _complete_of(fit: MultiModeFit, layout: Layout, may: BoolArray, *, resolved: bool) -> tuple[int, ...]:
    """Return one pole for each floor of a chain, of the poles that may be modes; empty if no such set exists."""
    ranges = sign_ranges(fit, layout)
    coupling, allowed, _ = couplings(fit, layout)

    def extend(chosen: tuple[int, ...]) -> tuple[int, ...]:
        wanted = len(chosen)
        if wanted == layout.floors:
            return chosen
        for pole in range(chosen[-1] + 1 if chosen else 0, may.size):
            fits = may[pole] and ranges[pole][0] <= wanted <= ranges[pole][1]
            if fits and all(abs(coupling[pole, other]) <= allowed[pole, other] for other in chosen):
                whole = extend((*chosen, pole))
                if whole:
                    return whole
        return ()

    if all_floors_measured(fit, layout):
        found = extend(())
        if found:
            return found
    poles = _distinct(fit, layout, [i for i in sound(fit) if may[i]], resolved=resolved)
    numbered = _numbered(fit, layout, poles, _SHAPE_TOLERANCE)
    return tuple(numbered) if len(numbered) == layout.floors else ()


def contradicts(fit: MultiModeFit, layout: Layout) -> bool:
    """Return whether one of two modes of a final fit is spurious: their shapes are nearly equal, or one is unknown."""
    coupling, _, same = couplings(fit, layout)
    equal = np.abs(np.triu(coupling, 1)) >= same
    return bool(not usable(fit, with_heavy=True).all() or (equal.any() and all_floors_measured(fit, layout)))


def _numbered(
    fit: MultiModeFit, layout: Layout, poles: Sequence[int], tolerance: float, size: FloatArray | None = None
) -> dict[int, int]:
    """Return pole -> mode number (from 1) with rising sign changes: as many poles as possible, then the largest `size`.

    `size`, shape (r,), is by default the strength of the poles.
    """
    score = 1e6 + np.log(np.maximum(strength(fit) if size is None else size, 1e-300))
    ranges = sign_ranges(fit, layout, tolerance)
    best: list[tuple[float, tuple[tuple[int, int], ...]]] = [(0.0, ())] * (layout.floors + 1)
    for pole in sorted(int(item) for item in poles):
        updated = list(best)
        for number in range(1, layout.floors + 1):
            updated[number] = max(updated[number], updated[number - 1], key=lambda item: item[0])
            if ranges[pole][0] <= number - 1 <= ranges[pole][1]:
                before = best[number - 1]
                taken = (before[0] + float(score[pole]), (*before[1], (pole, number)))
                updated[number] = max(updated[number], taken, key=lambda item: item[0])
        best = updated
    return dict(best[-1][1])


def _distinct(fit: MultiModeFit, layout: Layout, poles: Sequence[int], *, resolved: bool = False) -> list[int]:
    """Return the poles without those that have the shape of a stronger one: they are noise or another direction."""
    coupling, _, same = couplings(fit, layout)
    omega = fit.angular_frequencies
    sampled = same > _SAME_SHAPE
    kept: list[int] = []
    for index in sorted(poles, key=lambda i: -float(strength(fit)[i])):
        # with sensors on few floors different modes look alike: merge only neighbours in frequency
        rivals = [i for i in kept if not sampled or abs(omega[i] - omega[index]) < 0.05 * omega[index]]
        rivals = [] if sampled and resolved else rivals
        if all(abs(coupling[index, other]) < same for other in rivals):
            kept.append(index)
    return sorted(kept)


def largest_set(
    fit: MultiModeFit, layout: Layout, size: FloatArray | None = None, *, resolved: bool = False
) -> dict[int, int]:
    """Return pole -> mode number (from 1) for the largest set of poles that can be modes of the structure.

    Of several largest sets that with the largest `size`, shape (r,), is taken; default: the strength of the poles. If
    the poles are known to be `resolved` from each other, those of equal shape count as two, unless the floor masses
    contradict this. Heavily damped poles are considered where modes are missing.
    """
    numbered = _largest_of(fit, layout, usable(fit), size, resolved=resolved)
    if len(numbered) >= layout.floors:
        return numbered
    more = _largest_of(fit, layout, usable(fit, with_heavy=True), size, resolved=resolved)
    return more if len(more) > len(numbered) else numbered


def _largest_of(
    fit: MultiModeFit, layout: Layout, may: BoolArray, size: FloatArray | None, *, resolved: bool
) -> dict[int, int]:
    """Return pole -> mode number for the largest set of the poles that may be modes; see :func:`largest_set`."""
    poles = _distinct(fit, layout, [i for i in sound(fit) if may[i]], resolved=resolved)
    if not layout.is_chain:
        return {pole: number for number, pole in enumerate(poles, start=1)}
    numbered = _numbered(fit, layout, poles, _LOOSE_TOLERANCE, size)
    if len(numbered) < min(len(poles), layout.floors) and _mutually_orthogonal(fit, layout, poles):
        # the modes of a structure that is not a chain need not follow the sign changes
        strongest = sorted(sorted(poles, key=lambda i: -float(strength(fit)[i]))[: layout.floors])
        numbered = {pole: number for number, pole in enumerate(strongest, start=1)}
    return numbered


def resolved_set(fit: MultiModeFit, layout: Layout) -> dict[int, int]:
    """Return pole -> mode number (from 1) if one pole for each floor is a mode by its own data; else empty.

    Such a pole is usable, its shape is real, and it is farther from each more certain pole than the two half-power
    half-widths together. The sign changes of the shapes are not used, because stiffness between floors that are not
    neighbours changes the signs of small elements. The clocks of the sensors must have been corrected.
    """
    may = usable(fit)
    real = set(real_modes(fit))
    omega, width, size = fit.angular_frequencies, fit.damping_ratios * fit.angular_frequencies, certainty(fit)
    kept: list[int] = []
    for pole in sorted(_distinct(fit, layout, [i for i in sound(fit) if may[i] and i in real]), key=lambda i: -size[i]):
        if all(abs(omega[pole] - omega[other]) > width[pole] + width[other] for other in kept):
            kept.append(pole)
    if len(kept) < layout.floors:
        return {}
    return {pole: number for number, pole in enumerate(sorted(kept[: layout.floors]), start=1)}


def _mutually_orthogonal(fit: MultiModeFit, layout: Layout, poles: Sequence[int]) -> bool:
    if layout.masses is None or not all_floors_measured(fit, layout):
        return False
    coupling, allowed, _ = couplings(fit, layout)
    part = np.ix_(poles, poles)
    return bool(np.all(np.abs(np.triu(coupling[part], 1)) <= np.triu(allowed[part], 1)))
