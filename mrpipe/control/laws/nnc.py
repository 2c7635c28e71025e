"""Neural model reference control: a network that gives the force of friction with negative stiffness."""

from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import LAW_SIGNATURE, LAW_SPACING, NETWORK_LAW, evaluate
from mrpipe.control.law import Law
from mrpipe.control.laws._friction import (
    FRICTION,
    friction_assessment,
    friction_candidates,
    friction_in_harmonic_motion,
)


@njit(LAW_SIGNATURE, cache=True)
def network_force(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Return the output of the reference network (thesis 4.3.4)."""
    return evaluate(numbers, layout, state, layout[NETWORK_LAW], numbers[LAW_SPACING])


LAW = Law(
    name="nnc",
    summary="neural network trained to give the force of fdns",
    source="thesis (4.26) to (4.30); P3 (20)",
    force=network_force,
    c_body="    return evaluate(state, layout[NETWORK_LAW], numbers[LAW_SPACING]);\n",
    gains=(FRICTION,),
    signs={"alpha_n_m": 1.0},
    needs=frozenset({"network"}),
    candidates=friction_candidates,
    assess=friction_assessment,
    harmonic_force=friction_in_harmonic_motion,
    tuned_gain="alpha_n_m",
)
