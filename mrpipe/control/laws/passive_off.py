"""Passive-off: the damper without drive."""

from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import LAW_SIGNATURE, S_REQUEST
from mrpipe.control.law import Law


@njit(LAW_SIGNATURE, cache=True)
def no_drive(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Command no drive."""
    state[S_REQUEST] = 0.0
    return 0.0


LAW = Law(
    name="passive-off",
    summary="no drive",
    source="thesis chapter 5",
    force=no_drive,
    output="drive",
    c_body="    state[S_REQUEST] = 0.0;\n    return 0.0;\n",
)
