"""Maximum energy dissipation (McClamroch and Gavin 1995; Jansen and Dyke 2000)."""

from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import DRIVE_LIMIT, LAW_SIGNATURE, MEASURED_FORCE, S_REQUEST, S_V
from mrpipe.control.law import Law


@njit(LAW_SIGNATURE, cache=True)
def energy_dissipation(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Command the largest drive while the damper takes energy from the relative motion: v f > 0."""
    state[S_REQUEST] = numbers[DRIVE_LIMIT] if state[S_V] * measured[MEASURED_FORCE] > 0.0 else 0.0
    return 0.0


LAW = Law(
    name="energy-dissipation",
    summary="largest drive where the damper takes energy out of the relative motion",
    source="McClamroch and Gavin (1995), Proc. American Control Conf.; Jansen and Dyke (2000), J. Eng. Mech. 126(8)",
    force=energy_dissipation,
    output="drive",
    c_body="""\
    state[S_REQUEST] = state[S_V] * measured[MEASURED_FORCE] > 0.0 ? numbers[DRIVE_LIMIT] : 0.0;
    return 0.0;
""",
    needs=frozenset({"damper-force", "drive-limit"}),
)
