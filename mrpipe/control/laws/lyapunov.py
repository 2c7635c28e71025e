"""Control based on Lyapunov stability theory (Leitmann 1994; Jansen and Dyke 2000)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numba import njit
from scipy.linalg import solve_continuous_lyapunov

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.gains import Gains
from mrpipe.control.kernel import DRIVE_LIMIT, LAW_SIGNATURE, MEASURED_FORCE, S_REQUEST
from mrpipe.control.law import Law, Plant
from mrpipe.control.laws._regulator import C_OBSERVE, observe
from mrpipe.control.lqg import Observer, Weights, lqg_observer, state_weight
from mrpipe.errors import UserError
from mrpipe.structures import Frame, state_space


@njit(LAW_SIGNATURE, cache=True)
def lyapunov_drive(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Command the largest drive while the damper force decreases V = z'P z/2: z'P B f > 0."""
    force = measured[MEASURED_FORCE]
    direction = observe(numbers, layout, state, measured, force)
    state[S_REQUEST] = numbers[DRIVE_LIMIT] if direction * force > 0.0 else 0.0
    return 0.0


def lyapunov_observer(frame: Frame, position: FloatArray, weights: Weights, dt: float) -> Observer:
    """Return the observer of LQG whose output is z'P B, with A'P + P A = -Q.

    Raises
    ------
    UserError
        If the structure has no damping, because then no P exists.
    """
    _check_damped(frame)
    space = state_space(frame, position)
    P = solve_continuous_lyapunov(space.A.T, -state_weight(frame, weights))
    return replace(lqg_observer(frame, position, weights, dt), gain=-np.asarray(space.B[:, 1] @ P))


def _check_damped(frame: Frame) -> None:
    if float(np.max(np.linalg.eigvals(state_space(frame).A).real)) > -1e-9:
        raise UserError(
            "control law", "lyapunov", "the structure has an undamped mode", "identify its damping or take another law"
        )


def _candidates(plant: Plant) -> Mapping[str, Gains]:
    """Check that the structure is damped; return no gains, because the law has none."""
    _check_damped(plant.frame)
    return {}


LAW = Law(
    name="lyapunov",
    summary="largest drive where the damper force lowers a Lyapunov function of the state",
    source="Leitmann (1994), J. Intell. Mater. Syst. Struct. 5, 842-846; Jansen and Dyke (2000), J. Eng. Mech. 126(8)",
    force=lyapunov_drive,
    output="drive",
    c_body="""\
    const double force = measured[MEASURED_FORCE];
    state[S_REQUEST] = observe(state, measured, force) * force > 0.0 ? numbers[DRIVE_LIMIT] : 0.0;
    return 0.0;
""",
    c_helpers=C_OBSERVE,
    needs=frozenset({"observer", "floor-accelerations", "damper-force", "drive-limit"}),
    candidates=_candidates,
    observer=lyapunov_observer,
)
