"""Choice of effects and of the equations in which they are judged: those of the storeys, or those of modes.

The modes of a structure that bends are fitted to its records without any effect, so that an effect changes them. Once
effects are chosen, their forces are subtracted, the modes are fitted again, and effects are chosen again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.tracing.structure.base import FrameProblem
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.rounds import FrameSelection
from mrpipe.tracing.structure.spectra import Spectra


def choice(
    problem: FrameProblem, choose: Callable[[FrameProblem], FrameSelection]
) -> tuple[FrameProblem, FrameSelection]:
    """Return the chosen effects, and the problem with the equations in which they were judged.

    If nothing is missing in the equations of modes, effects are sought in those of the storeys, because modes that
    were left out may leave a residual that is smaller than the noise of each line.

    Parameters
    ----------
    problem
        Spectra of the records, in the equations of the storeys.
    choose
        Selection of effects on a problem.
    """
    modal = problem.in_modes(problem.training)
    found = choose(modal)
    if modal.modal is None:
        return problem, found
    if not found.structured:
        return problem, choose(problem)
    if not found.chosen:
        return modal, found
    again = modal.in_modes(without_effects(problem.training, found))
    if again.modal is None:
        return modal, found
    better = choose(again)
    if better.share(better.remaining) < found.share(found.remaining):
        return modal, found
    return again, better


def without_effects(spectra: Sequence[Spectra], selection: FrameSelection) -> tuple[Spectra, ...]:
    """Return spectra whose storey forces do not contain the forces of the chosen effects.

    Parameters
    ----------
    spectra
        Spectra of the records on which the effects were chosen.
    selection
        The chosen effects.
    """
    model = model_of(selection.design, selection.chosen, selection.about)
    columns = [model.columns(item) for item in spectra]
    return tuple(
        item if own is None else replace(item, target=item.target - np.tensordot(model.amplitudes, own.lines, axes=1))
        for item, own in zip(spectra, columns, strict=True)
    )
