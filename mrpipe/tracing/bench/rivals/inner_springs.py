"""Springs inside a base form, which the race leaves out.

The race leaves all springs of base forms to the effect `accumulator`, because both describe the same physics. A spring
inside the damper, such as k0 of the modified Bouc-Wen model, follows an inner element and not the rod. A spring across
the damper therefore replaces it only in part.
"""

from __future__ import annotations

from dataclasses import replace

from mrpipe.dampers.library import base_form
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.reference import with_own_laws
from mrpipe.tracing.bench.rivals.other_base_forms import Unseen
from mrpipe.tracing.bench.selection.select import Selection

ITERATIONS = 25
"""Numerical technique: largest number of steps of the fit with the springs."""


def with_inner_springs(selection: Selection, limit: float, least_gain: float, unseen: Unseen, jobs: int) -> Selection:
    """Return the selection with the springs inside its base form, if it predicts tests left out better with them.

    Parameters
    ----------
    selection
        Named effects with their fit.
    limit
        Springs are tried only if the chi-square exceeds this.
    least_gain
        Share of the chi-square that they must remove.
    unseen
        Comparison on tests left out.
    jobs
        Threads.
    """
    chosen = selection.chosen
    found = _with_springs(chosen) if chosen.chi_square > limit else None
    if found is None or found.chi_square > (1.0 - least_gain) * chosen.chi_square:
        return selection
    return replace(selection, chosen=found) if unseen.better(chosen, found, jobs) else selection


def _with_springs(found: Fit) -> Fit | None:
    """Return the fit with the springs that its base form has inside; None if it has none."""
    base = found.problem.base
    whole = base_form(base.form.name, base.form.file)
    inner = tuple(p for p in whole.searched if p.name in whole.springs and p not in base.form.parameters)
    if not inner:
        return None
    form = replace(base.form, parameters=(*base.form.parameters, *inner))
    problem = replace(found.problem, base=replace(base, form=form))
    springs = {p.name: p.start_values(problem.scales)[0] for p in inner}
    start = start_of(problem, {**found.base_values, **springs}, found.term_values)
    return with_own_laws(fit(problem, start, iterations=ITERATIONS))
