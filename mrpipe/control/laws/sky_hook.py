"""Sky-hook damping: viscous damping of the absolute motion (Karnopp, Crosby and Harwood 1974)."""

from __future__ import annotations

from collections.abc import Mapping

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.gains import Gains
from mrpipe.control.kernel import GAIN_C, LAW_SIGNATURE
from mrpipe.control.law import Law, Plant
from mrpipe.control.laws._linear import VISCOSITY, linear_candidates
from mrpipe.control.laws._switching import (
    C_ABSOLUTE_VELOCITY,
    CORNER,
    CORNER_SHARE,
    absolute_velocity,
    integration_numbers,
)


@njit(LAW_SIGNATURE, cache=True)
def sky_hook(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Return f = c v_absolute; clipping sets it to zero where it would add energy to the relative motion."""
    return numbers[GAIN_C] * absolute_velocity(numbers, layout, state, measured)


def _candidates(plant: Plant) -> Mapping[str, Gains]:
    """Return c of viscous damping and the corner frequency of the integration."""
    corner = CORNER_SHARE * plant.modes.omega_0
    found = linear_candidates(plant, 0.0)
    return {source: found[source].changed(corner_rad_s=corner) for source in ("closed-form", "exact")}


LAW = Law(
    name="sky-hook",
    summary="viscous damping of the absolute motion of the damper's floor",
    source="Karnopp, Crosby and Harwood (1974), J. Eng. Ind. 96, 619-626",
    force=sky_hook,
    c_body="    return numbers[GAIN_C] * absolute_velocity(state, measured);\n",
    c_helpers=C_ABSOLUTE_VELOCITY,
    gains=(VISCOSITY, CORNER),
    signs={"c_n_s_m": 1.0, "corner_rad_s": 1.0},
    needs=frozenset({"floor-accelerations"}),
    candidates=_candidates,
    numbers=integration_numbers,
    memory=2,
)
