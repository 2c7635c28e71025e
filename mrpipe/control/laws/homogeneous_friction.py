"""Modulated homogeneous friction (Inaudi 1997; Jansen and Dyke 2000)."""

from __future__ import annotations

import math
from collections.abc import Mapping

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control import exact
from mrpipe.control.gains import Gains
from mrpipe.control.kernel import DRIVE_LIMIT, GAIN_ALPHA, LAW_SIGNATURE, MEASURED_FORCE, S_AMPLITUDE, S_REQUEST
from mrpipe.control.law import Assessment, GainRange, Law, Plant
from mrpipe.control.limits import damping_estimate

LOSS = 4.0 / math.pi
"""Loss of a friction force g X in harmonic motion of amplitude X, divided by g."""


@njit(LAW_SIGNATURE, cache=True)
def homogeneous_friction(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Command the largest drive while the damper force is below g |P|, P the last extremum of the displacement."""
    level = numbers[GAIN_ALPHA] * state[S_AMPLITUDE]
    state[S_REQUEST] = numbers[DRIVE_LIMIT] if level > abs(measured[MEASURED_FORCE]) else 0.0
    return 0.0


def _candidates(plant: Plant) -> Mapping[str, Gains]:
    """Return g with the optimal equivalent loss: by closed form, where the loss is 1/nu, and by complex eigenvalue."""

    def ratio(g: float) -> float:
        answer = exact.exact_equivalent(plant.bare, plant.position, plant.modes, complex(0.0, LOSS * g))
        return exact.stable_ratio(answer)

    closed = 1.0 / (LOSS * plant.modes.nu)
    return {
        "closed-form": Gains(alpha_n_m=closed),
        "exact": Gains(alpha_n_m=exact.best_gain(ratio, 4.0 * closed).gain),
    }


def _assess(plant: Plant, gains: Gains) -> Assessment:
    H = complex(0.0, LOSS * gains.alpha_n_m)
    without, with_frame = (
        exact.exact_equivalent(item, plant.position, plant.modes, H) for item in (plant.bare, plant.frame)
    )
    return Assessment(
        damping_estimate(plant.modes, H.real, H.imag),
        without.damping_ratio,
        with_frame.damping_ratio,
        unstable_pole_1_s=with_frame.unstable_pole,
    )


LAW = Law(
    name="homogeneous-friction",
    summary="friction in proportion to the last extremum of the displacement, with force feedback",
    source="Inaudi (1997), Earthquake Eng. Struct. Dyn. 26, 361-376; Jansen and Dyke (2000), J. Eng. Mech. 126(8)",
    force=homogeneous_friction,
    output="drive",
    c_body="""\
    const double level = numbers[GAIN_ALPHA] * state[S_AMPLITUDE];
    state[S_REQUEST] = level > fabs(measured[MEASURED_FORCE]) ? numbers[DRIVE_LIMIT] : 0.0;
    return 0.0;
""",
    gains=(
        GainRange(
            "alpha_n_m",
            "friction force over the last extremum",
            lambda plant: (0.05 / (LOSS * plant.modes.nu), 4.0 / (LOSS * plant.modes.nu)),
        ),
    ),
    signs={"alpha_n_m": 1.0},
    needs=frozenset({"damper-force", "drive-limit"}),
    candidates=_candidates,
    assess=_assess,
)
