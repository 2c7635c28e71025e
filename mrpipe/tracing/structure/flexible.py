"""An effect with a free combination of all its forms, so that the remaining residual is not an error of its form."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.tracing.structure.candidates import Fitted, Placed, Surroundings, columns_of, scales_of
from mrpipe.tracing.structure.fit import Design, solve
from mrpipe.tracing.structure.spectra import Spectra

LINEAR = 1e-6
"""Numerical technique: a force counts as linear if half the motion causes half of it with this relative error."""


def variants(fitted: Fitted, design: Design) -> list[Fitted]:
    """Return an effect at its place, as it was fitted, with changed parameters, and in its other forms.

    One parameter of the fitted form after another takes its start values; the other forms take all of theirs.

    Parameters
    ----------
    fitted
        The effect.
    design
        Linear frame with the records; the start values depend on their scales.
    """
    placed = fitted.placed
    scales = scales_of(design.spectra, placed)
    found = [fitted]
    for place, parameter in enumerate(placed.form.searched):
        for value in parameter.start_values(scales):
            numbers = fitted.numbers.copy()
            numbers[place] = value
            found.append(Fitted(placed, numbers))
    for form in placed.effect.forms:
        if form is placed.form:
            continue
        starts = itertools.product(*(item.start_values(scales) for item in form.searched))
        found += [Fitted(replace(placed, form=form), np.array(start, dtype=np.float64)) for start in starts]
    return found


def projected_variants(chosen: Sequence[Fitted], design: Design, about: Surroundings) -> FloatArray:
    """Return the columns of all variants of effects, minus their projection onto the linear frame, (k, n, 2 b).

    The rotation of a base changes the force of every storey. A frame that bends distributes it in another way than a
    shear frame, so each storey has a separate amplitude.
    """
    found = []
    for item in itertools.chain.from_iterable(variants(one, design) for one in chosen):
        columns = design.project([columns_of(item, record, about) for record in design.spectra])
        if item.placed.effect.acts_on == "base":
            storeys = np.eye(columns.shape[1])
            columns = (columns[:, None] * storeys[None, :, :, None]).reshape(-1, *columns.shape[1:])
        found.append(columns)
    return np.concatenate(found)


def gain_beyond(columns: FloatArray, further: FloatArray, design: Design) -> tuple[FloatArray, FloatArray]:
    """Return the residuals of a fit of columns, without and with further ones, shape (n, 2 b) each.

    Parameters
    ----------
    columns, further
        Projected columns, shape (k, n, 2 b).
    design
        Linear frame with the records.
    """
    without = solve(design, columns).residual if len(columns) else design.residual
    return without, solve(design, np.concatenate([columns, further])).residual if len(further) else without


def linear_amplitudes(fitted: Fitted, spectra: Sequence[Spectra], about: Surroundings) -> BoolArray:
    """Return which amplitudes of an effect multiply a force that is linear in the motion, shape (k,).

    Parameters
    ----------
    fitted
        The effect. Its force is linear if half the motion causes half the force.
    spectra
        The records.
    about
        Scales of the structure and decision thresholds.
    """
    found = []
    for item in spectra:
        values = {field.name: 0.5 * getattr(item.motion, field.name) for field in fields(item.motion)}
        full = columns_of(fitted, item, about).lines
        half = columns_of(fitted, replace(item, motion=replace(item.motion, **values)), about).lines
        error, size = (np.linalg.norm(lines.reshape(len(full), -1), axis=1) for lines in (half - 0.5 * full, full))
        found.append(error <= LINEAR * size)
    return np.asarray(np.all(found, axis=0))


def is_linear(placed: Placed, design: Design, about: Surroundings) -> bool:
    """Return whether a form is linear in the motion, judged at its first start values.

    Parameters
    ----------
    placed
        The form. Those of storeys and floors are nonlinear by definition.
    design
        Linear frame with the records.
    about
        Scales of the structure and decision thresholds.
    """
    if placed.effect.acts_on != "base":
        return False
    scales = scales_of(design.spectra, placed)
    numbers = np.array([item.start_values(scales)[0] for item in placed.form.searched])
    return bool(np.all(linear_amplitudes(Fitted(placed, numbers), design.spectra, about)))


def parts_of(fitted: Fitted, design: Design, about: Surroundings) -> tuple[FloatArray, FloatArray]:
    """Return the projected columns of an effect that are linear in the motion, and the others, shape (k, n, 2 b) each.

    Parameters
    ----------
    fitted
        The effect. Only the rotation of a base has linear columns.
    design
        Linear frame with the records.
    about
        Scales of the structure and decision thresholds.
    """
    columns = design.project([columns_of(fitted, item, about) for item in design.spectra])
    if fitted.placed.effect.acts_on != "base":
        return columns[:0], columns
    linear = linear_amplitudes(fitted, design.spectra, about)
    return columns[linear], columns[~linear]
