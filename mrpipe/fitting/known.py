"""Base forms that were fitted to the same tests before; a later fit starts from their parameters.

`identify-damper` fits every base form with equal weights; the tracing fits them with weights by noise. The optimum of
the first fit is close to that of the second, so a search from there needs no grid of starting points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mrpipe.artifacts import Artifact, FloatArray
from mrpipe.dampers.model import DamperModel, read_damper
from mrpipe.fitting.engine import start_of
from mrpipe.fitting.problem import Problem

Known = Mapping[str, DamperModel]
"""Name -> base form as it was fitted to the same tests before."""

FITTED, RANKED = "forms", "ranked"
"""Groups of `damper.h5`: base forms fitted to all samples, and all of them fitted to a share of the samples."""


def read_known(artifact: Artifact) -> dict[str, DamperModel]:
    """Return name -> base form in a `damper.h5`; the one fitted to all samples if the file has both."""
    names = {name: f"{group}/{name}" for group in (RANKED, FITTED) for name in artifact.members(group)}
    return {name: read_damper(artifact, group) for name, group in names.items()}


def known_start(
    problem: Problem,
    known: Known | None,
    shared: Mapping[str, float] | None = None,
    terms: Sequence[Mapping[str, float]] = (),
) -> tuple[Problem, FloatArray] | None:
    """Return the problem, and the start from a known fit of its base form; None if there is no such fit.

    The searched parameters are taken by name: those of the form, the lag of the drive, and the scale of a law that
    saturates. A coupled form reads the known laws of the drive.

    Parameters
    ----------
    problem
        Problem to be fitted.
    known
        Base forms by name, fitted to the same tests.
    shared
        Parameter -> value that replaces the known one.
    terms
        Start values of the effects of the problem; None: each effect begins at its first start.
    """
    form = problem.base.form
    model = (known or {}).get(form.name)
    if model is None or model.form_file != form.file:
        return None
    if form.coupled:
        problem = replace(problem, reference=tuple(model.law(block) for block in form.blocks))
    values = {**model.parameters, **(shared or {})}
    return problem, start_of(problem, values, [*terms, *[{}] * (len(problem.terms) - len(terms))])
