"""A rival without a name: any linear force with memory of the motion.

The library contains named effects only. A force that none of them describes would get the name of the most similar
effect. Named effects therefore compete with the general linear viscoelastic force, whose strength is proportional to
the drive: a sum of Maxwell elements (Prony series) with stiffnesses that are not negative, which can approximate every
passive linear memory (Christensen, Theory of Viscoelasticity, 1982). The names count as proven only if the named
effects predict tests left out better than this force does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.parameters import Scales
from mrpipe.dampers.plant import CURRENT, FIRST, FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Values, amplitude
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.rivals.other_base_forms import HOPELESS, ITERATIONS, Unseen
from mrpipe.tracing.bench.selection.select import fit_on_draft_tests
from mrpipe.words import listed

RELAXATION_TIMES = tuple(float(item) for item in np.geomspace(0.02, 12.0, 5))
"""Numerical technique: relaxation times of the elements, in units of stroke over speed. They differ by factors of five,
and range from a hundredth of the shortest half period to several of the longest periods of usual bench tests.
"""


@njit(STEP_SIGNATURE, cache=True)
def maxwell_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: stiffness for each unit of the drive [N/m/drive], relaxation time [s]. State: extension [m]."""
    if wire[FIRST] > 0.5:
        state[0] = 0.0
    keep = np.exp(-dt / parameters[1])
    state[0] = keep * state[0] + wire[VELOCITY] * parameters[1] * (1.0 - keep)
    wire[FORCE] += parameters[0] * state[0] * wire[CURRENT]


def linear_memory(scales: Scales) -> Effect:
    """Return the linear memory as an effect for a fit; it is not in the library and is never named.

    Parameters
    ----------
    scales
        Scales of the campaign, which determine the relaxation times.
    """
    times = [item * scales.of("stroke/speed") for item in RELAXATION_TIMES]
    names = [f"stiffness_{place}" for place in range(len(times))]

    def steps(values: Values) -> list[Step]:
        return [
            Step(f"maxwell-{place}", Phase.FORCE_EFFECT, maxwell_step, np.array([values[name], times[place]]), 1)
            for place, name in enumerate(names)
        ]

    form = EffectForm(
        "prony",
        "F + u sum k_i e_i, e_i' = v - e_i/tau_i",
        tuple(amplitude(name, "N/m/drive", "stiffness of an element", "force/stroke/drive") for name in names),
        steps,
        {name: place for place, name in enumerate(names)},
    )
    return Effect(
        name="linear memory",
        summary="any linear force with memory of the motion, times the drive",
        physics="Viscoelasticity in its general linear form.",
        remedy="Run sweeps of the frequency at several strokes and constant drives.",
        source="Christensen 1982, Theory of Viscoelasticity",
        acts_on="force",
        forms=(form,),
    )


def without_beaten_names(named: NamedEffects, unseen: Unseen, jobs: int = 1) -> NamedEffects:
    """Return the named effects; without names, and the reason, if the linear memory predicts as well as they do.

    Effects that are not named become further terms, whose cause is not proven. The reason is empty if the names hold.

    Parameters
    ----------
    named
        Named effects, and further terms.
    unseen
        Comparison on tests that were left out.
    jobs
        Threads.
    """
    selection, declared = named.selection, named.declared
    alone = selection.with_named_alone.chosen
    if not named.places or alone.chi_square <= selection.noise:
        return named
    small = fit_on_draft_tests(alone)
    rival = with_linear_memory(small, declared)
    if rival.chi_square > HOPELESS * small.chi_square:
        return named
    rival = with_linear_memory(alone, declared, rival)
    if rival.chi_square > HOPELESS * alone.chi_square or unseen.better(rival, alone, jobs):
        return named
    effects = [term.effect.name for term in alone.problem.terms[declared:]]
    verb = "lowers" if len(effects) == 1 else "lower"
    reason = (
        f"no effect is named: {listed(effects)} {verb} the error, but a linear memory of the motion, which has "
        "no name in the library, predicts tests that were left out as well or better"
    )
    return replace(named.without_names(range(len(named.places))), reason=reason)


def with_linear_memory(found: Fit, declared: int, start: Fit | None = None) -> Fit:
    """Return the fit with the linear memory in place of its named effects.

    Parameters
    ----------
    found
        Base form with declared terms and named effects.
    declared
        Number of declared terms, which are kept.
    start
        A fit of the same model to a share of the tests; None: the search starts from `found`.
    """
    effect = linear_memory(found.problem.scales)
    problem = replace(found.problem, terms=(*found.problem.terms[:declared], Term(effect, effect.forms[0])))
    values = [*found.term_values[:declared], {}]
    theta = start_of(problem, found.base_values, values) if start is None else start.theta
    return fit(problem, theta, iterations=ITERATIONS)
