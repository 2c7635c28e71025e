"""The laws of the drive that effects are proportional to: those of the fit itself.

An effect that changes the yield force by a share reads the yield force from reference laws, because the laws of the
base form are solved for afterwards. If the reference differs from the fitted law, the share stands for another force at
each level of the drive. The damper that is written has only the fitted laws, and would then differ from the fit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrpipe.dampers.laws import Law, constant_law
from mrpipe.fitting.engine import Fit, fit

PASSES = 3
"""Numerical technique: largest number of fits until reference and fitted laws agree."""

SAME = 0.01
"""Numerical technique: difference, as a share of the largest value, up to which laws agree."""

MOST_SETTLING = 6
"""Numerical technique: largest number of further fits until the error no longer falls ..."""

SETTLED = 0.02
"""Numerical technique: ... by this share."""

LEVELS = 20
"""Numerical technique: levels of the drive at which laws are compared."""


def own_laws(found: Fit) -> tuple[Law, ...]:
    """Return the fitted laws as reference of effects; a viscosity of zero is replaced by a small positive one."""
    forces, viscosity, *rest = found.laws
    drive = np.linspace(0.0, found.problem.scales.drive, LEVELS)
    if float(np.mean(viscosity(drive))) <= 0.0 and not found.problem.base.form.coupled:
        viscosity = constant_law(0.01 * found.problem.scales.force / max(found.problem.scales.speed, 1e-9))
    return forces, viscosity, *rest


def with_own_laws(found: Fit, *, iterations: int = 6) -> Fit:
    """Return a fit whose effects are proportional to the fitted laws of the drive.

    Parameters
    ----------
    found
        Fit with or without effects.
    iterations
        Largest number of iterations of each search.
    """
    if found.problem.base.form.coupled:
        return found
    for _ in range(PASSES):
        laws = own_laws(found)
        problem = replace(found.problem, reference=laws)
        if not found.problem.terms:
            return replace(found, problem=problem)
        if _alike(laws, found.problem.reference, found.problem.scales.drive):
            break
        found = fit(problem, found.theta, iterations=iterations)
    return found


def with_settled_laws(found: Fit, *, iterations: int = 6) -> Fit:
    """Return a fit whose effects are proportional to the fitted laws, repeated until the error no longer falls.

    With a large effect, laws that change by one percent can still lower the error by half in each repetition, because
    the other parameters follow them.

    Parameters
    ----------
    found
        Fit with or without effects.
    iterations
        Largest number of iterations of each search.
    """
    if found.problem.base.form.coupled or not found.problem.terms:
        return found
    found = _once_more(found, iterations)
    for _ in range(MOST_SETTLING):
        again = _once_more(found, iterations)
        if again.chi_square > (1.0 - SETTLED) * found.chi_square:
            break
        found = again
    return found


def _once_more(found: Fit, iterations: int) -> Fit:
    return fit(replace(found.problem, reference=own_laws(found)), found.theta, iterations=iterations)


def _alike(laws: tuple[Law, ...], others: tuple[Law, ...], limit: float) -> bool:
    drive = np.linspace(0.0, limit, LEVELS)
    pairs = [(np.asarray(law(drive)), np.asarray(other(drive))) for law, other in zip(laws, others, strict=False)]
    return all(float(np.max(np.abs(one - other))) <= SAME * float(np.max(np.abs(one))) for one, other in pairs)
