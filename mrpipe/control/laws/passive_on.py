"""Passive-on: the damper at its largest drive."""

from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import DRIVE_LIMIT, LAW_SIGNATURE, S_REQUEST
from mrpipe.control.law import Law


@njit(LAW_SIGNATURE, cache=True)
def full_drive(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Command the largest drive."""
    state[S_REQUEST] = numbers[DRIVE_LIMIT]
    return 0.0


LAW = Law(
    name="passive-on",
    summary="largest drive",
    source="thesis chapter 5",
    force=full_drive,
    output="drive",
    needs=frozenset({"drive-limit"}),
    c_body="    state[S_REQUEST] = numbers[DRIVE_LIMIT];\n    return 0.0;\n",
)
