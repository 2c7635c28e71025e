"""Decentralised bang-bang control (McClamroch and Gavin 1995; Jansen and Dyke 2000)."""

from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.gains import Gains
from mrpipe.control.kernel import DRIVE_LIMIT, LAW_SIGNATURE, MEASURED_FORCE, S_REQUEST
from mrpipe.control.law import Law
from mrpipe.control.laws._switching import (
    C_ABSOLUTE_VELOCITY,
    CORNER,
    CORNER_SHARE,
    absolute_velocity,
    integration_numbers,
)


@njit(LAW_SIGNATURE, cache=True)
def bang_bang(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Command the largest drive while the damper takes energy from the absolute motion of its floor."""
    velocity = absolute_velocity(numbers, layout, state, measured)
    state[S_REQUEST] = numbers[DRIVE_LIMIT] if velocity * measured[MEASURED_FORCE] > 0.0 else 0.0
    return 0.0


LAW = Law(
    name="bang-bang",
    summary="largest drive where the damper takes energy out of the absolute motion of its floor",
    source="McClamroch and Gavin (1995), Proc. American Control Conf.; Jansen and Dyke (2000), J. Eng. Mech. 126(8)",
    force=bang_bang,
    output="drive",
    c_body="""\
    const double velocity = absolute_velocity(state, measured);
    state[S_REQUEST] = velocity * measured[MEASURED_FORCE] > 0.0 ? numbers[DRIVE_LIMIT] : 0.0;
    return 0.0;
""",
    c_helpers=C_ABSOLUTE_VELOCITY,
    gains=(CORNER,),
    signs={"corner_rad_s": 1.0},
    needs=frozenset({"floor-accelerations", "damper-force", "drive-limit"}),
    candidates=lambda plant: {"exact": Gains(corner_rad_s=CORNER_SHARE * plant.modes.omega_0)},
    numbers=integration_numbers,
    memory=2,
)
