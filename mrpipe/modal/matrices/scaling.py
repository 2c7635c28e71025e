"""Scale of the modes, from the force of a shaker or from tests with known added masses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.ambient.clocks import synchronised
from mrpipe.modal.ambient.free_decays import find_decay_modes
from mrpipe.modal.ambient.harmonics import without_harmonics
from mrpipe.modal.ambient.modes import find_ambient_modes
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.matrices.added_mass import modal_scale
from mrpipe.modal.matrices.masses import FloorMasses, masses_by_orthogonality
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.chosen_tests import choose_tests, with_clocks
from mrpipe.modal.search.selection import Layout, all_floors_measured, floor_shapes, shape_errors
from mrpipe.words import in_percent

_USUAL_FORCE_ERROR = 0.02


@dataclass(frozen=True)
class Scale:
    """Scale of the modes, if it is known.

    Attributes
    ----------
    residues
        Shape (r,) [1/kg]: squared mass-normalised shape at `floor`; nan where unknown. None without a scale.
    errors
        Shape (r,): relative standard errors; None: the usual error.
    floor
        Floor, from 1; 0 without a scale.
    source
        Source of the scale, for messages.
    """

    residues: FloatArray | None = None
    errors: FloatArray | None = None
    floor: int = 0
    source: str = "the given masses"


def find_scale(
    fit: MultiModeFit, tests: FrameTests, layout: Layout, options: IdentificationOptions
) -> tuple[Scale, list[str]]:
    """Return the scale of the modes: from the force of a shaker, else from added masses.

    If the floor masses are known, tests with added masses are a check of them, and a finding reports the result.
    """
    scale = _of_force(fit)
    if not tests.with_added_masses or not layout.is_chain:
        return scale, []
    added = _of_added_masses(fit, tests, layout, options)
    findings = []
    if added.residues is not None:
        unknown = int(np.count_nonzero(~np.isfinite(added.residues)))
        if unknown:
            findings.append(
                f"the added mass is too small, or is at a node, so that {unknown} of the modes have no scale"
            )
        findings += _compared(fit, layout, added)
    else:
        findings.append(
            "the added mass shifts no mode by more than its error, so it does not determine the scale of the modes"
        )
    return (scale if scale.residues is not None else added), findings


def _of_force(fit: MultiModeFit) -> Scale:
    """Return acceleration over force [1/kg] of each mode at a floor where a measured force acts and a sensor is."""
    for column, place in enumerate(fit.inputs):
        rows = [i for i, sensor in enumerate(fit.sensors) if sensor[:2] == place[:2] and place.floor > 0]
        if rows:
            values = fit.input_residues[rows[0], column].real
            # the sign of a recorded force is a convention: the driving point always moves in the direction of the force
            values = np.asarray(values * np.sign(np.nansum(values)))
            return Scale(values, None, place.floor, "the measured force")
    return Scale()


def _of_added_masses(fit: MultiModeFit, tests: FrameTests, layout: Layout, options: IdentificationOptions) -> Scale:
    states: dict[tuple[tuple[int, float], ...], list[FrameTest]] = {}
    for test in tests.with_added_masses:
        states.setdefault(test.added_masses, []).append(test)
    changed = [(_modes(own, tests, layout, options), dict(added)) for added, own in states.items()]
    found = modal_scale(fit, changed)
    if not np.isfinite(found.values).any():
        return Scale()
    # the floor at which the smallest modal motion is largest has the smallest errors
    shapes = floor_shapes(fit, layout)[0]
    unit = np.abs(shapes / np.linalg.norm(shapes, axis=0))
    floor = int(np.argmax(unit.min(axis=1)))
    return Scale(found.values * unit[floor] ** 2, found.errors, floor + 1, "the added masses")


def _modes(own: list[FrameTest], tests: FrameTests, layout: Layout, options: IdentificationOptions) -> MultiModeFit:
    """Return the modes of one state of the structure; masses are left out, because they have changed."""
    state = Layout(layout.floors, None, layout.is_chain)
    forced = tuple(test for test in own if test.kind not in {"ambient", "free-decay"})
    if not forced and all(test.kind == "free-decay" for test in own):
        return find_decay_modes(own, state, options.band_low_hz, options.band_high_hz, tests.source).fit
    if not forced:
        band = (options.band_low_hz, options.band_high_hz)
        quiet, _ = without_harmonics(own, options.band_low_hz)
        moved, _ = synchronised(quiet, band, options)
        return find_ambient_modes(moved, state, *band, tests.source, options.ambient_method).fit
    alone = FrameTests(forced, (), np.full(layout.floors, np.nan), tests.source)
    chosen, _ = choose_tests(forced, alone, state, options)
    if options.clock_correction:
        chosen, _ = with_clocks(chosen, alone, state, options)
    return chosen.search.fit


def _compared(fit: MultiModeFit, layout: Layout, scale: Scale) -> list[str]:
    """Return how the given masses agree with the added masses; nothing where masses or floors are unknown."""
    if layout.masses is None or scale.residues is None or not all_floors_measured(fit, layout):
        return []
    shapes = floor_shapes(fit, layout)[0]
    own = shapes[scale.floor - 1] ** 2 / (layout.masses @ shapes**2)
    errors = np.ones(own.size) if scale.errors is None else scale.errors
    known = np.isfinite(scale.residues)
    weight = 1.0 / errors[known] ** 2
    ratio = float(np.exp(weight @ np.log(own[known] / scale.residues[known]) / weight.sum()))
    error = float(1.0 / np.sqrt(weight.sum()))
    return [
        f"check of the floor masses: the added masses give {in_percent(ratio, 1)} of the given ones "
        f"(standard error {in_percent(error, 1)})"
    ]


def masses_of(fit: MultiModeFit, layout: Layout, masses: FloatArray, scale: Scale) -> FloorMasses | None:
    """Return all floor masses from the orthogonality of the modes; None where the data do not determine them."""
    if not all_floors_measured(fit, layout):
        return None
    shapes = floor_shapes(fit, layout)[0]
    modes = shapes.shape[1]
    scales, errors = np.full(modes, np.nan), np.full(modes, np.inf)
    relative = shape_errors(fit)
    if scale.residues is not None:
        unit = shapes[scale.floor - 1] ** 2 / np.sum(shapes**2, axis=0)
        scales = scale.residues / np.maximum(unit, 1e-300)
        errors = np.full(modes, _USUAL_FORCE_ERROR) if scale.errors is None else scale.errors
        # near a node the shape at this floor is uncertain, and so is the scale of the whole shape
        errors = np.asarray(errors + 2.0 * (relative + 0.003) / np.sqrt(np.maximum(unit, 1e-300)))
        scales = np.where(errors < 1.0, scales, np.nan)
    return masses_by_orthogonality(shapes, relative, masses, scales, errors)
