"""An effect that may combine all its forms: what remains then is no error of its form."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.structure.candidates import Fitted, Surroundings, columns_of, scales_of
from mrpipe.tracing.structure.fit import Design, solve


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


def gain_beyond(
    columns: FloatArray, further: Fitted, design: Design, about: Surroundings
) -> tuple[FloatArray, FloatArray]:
    """Return the residuals of a fit of columns, without and with a further effect, shape (n, 2 b) each.

    Parameters
    ----------
    columns
        Columns of :func:`projected_variants`.
    further
        The further effect.
    design
        Linear frame with the records.
    about
        Scales of the structure and decision thresholds.
    """
    own = design.project([columns_of(further, record, about) for record in design.spectra])
    return solve(design, columns).residual, solve(design, np.concatenate([columns, own])).residual
