"""Clipped-optimal control with feedback of the damper force (Dyke et al. 1996)."""

from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import DRIVE_LIMIT, LAW_SIGNATURE, MEASURED_FORCE, S_REQUEST
from mrpipe.control.law import Law
from mrpipe.control.laws._regulator import C_OBSERVE, observe, regulator_assessment
from mrpipe.control.lqg import frame_regulator_gain, lqg_observer


@njit(LAW_SIGNATURE, cache=True)
def clipped_optimal(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Command the largest drive while the force of the regulator has the sign of the damper force and is larger."""
    force = measured[MEASURED_FORCE]
    wanted = observe(numbers, layout, state, measured, force)
    state[S_REQUEST] = numbers[DRIVE_LIMIT] if (wanted - force) * force > 0.0 else 0.0
    return wanted


LAW = Law(
    name="clipped-optimal",
    summary="largest drive where the regulator wants more force than the damper gives, with force feedback",
    source="Dyke, Spencer, Sain and Carlson (1996), Smart Mater. Struct. 5, 565-575; v = Vmax H((fc - f) f)",
    force=clipped_optimal,
    output="drive",
    c_body="""\
    const double force = measured[MEASURED_FORCE], wanted = observe(state, measured, force);
    state[S_REQUEST] = (wanted - force) * force > 0.0 ? numbers[DRIVE_LIMIT] : 0.0;
    return wanted;
""",
    c_helpers=C_OBSERVE,
    needs=frozenset({"observer", "floor-accelerations", "damper-force", "drive-limit"}),
    assess=lambda plant, _: regulator_assessment(
        plant, frame_regulator_gain(plant.frame, plant.position, plant.weights)
    ),
    observer=lqg_observer,
)
