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


def _closed_form(plant: Plant) -> float:
    """Return g [N/m] with the loss 1/nu; for a single mode, which has no optimal loss, the critical g."""
    modes = plant.modes
    return _critical(plant) if modes.is_single else 1.0 / (LOSS * modes.nu)


def _critical(plant: Plant) -> float:
    """Return g [N/m] with which a free vibration of the target mode ends after half a cycle: half of k_0.

    From an extremum X a mode of modal stiffness k_0 moves about g X/k_0, so that the next extremum is -X (1 - 2 g/k_0).
    A g of k_0 or more holds it at its extremum.
    """
    return 0.5 * plant.modes.modal_stiffness


def _scale(plant: Plant) -> float:
    """Return the middle of the search for g [N/m]: the closed form, at most the g that holds the mode."""
    return min(_closed_form(plant), plant.modes.modal_stiffness)


def _candidates(plant: Plant) -> Mapping[str, Gains]:
    """Return g with the optimal equivalent loss: by closed form, where the loss is 1/nu, and by complex eigenvalue.

    The optimum may be where the friction would hold the target mode at its extremum, or there may be none. The exact g
    is then the one with which a free vibration ends after half a cycle.
    """
    closed, critical = _closed_form(plant), _critical(plant)
    if plant.modes.is_single:
        return {"closed-form": Gains(alpha_n_m=closed), "exact": Gains(alpha_n_m=closed)}

    target = exact.target_mode(plant.bare, plant.position, plant.modes)

    def ratio(g: float) -> float:
        return exact.stable_ratio(target.equivalent(complex(0.0, LOSS * g)))

    best = exact.best_gain(ratio, 4.0 * closed).gain
    holds = best >= plant.modes.modal_stiffness
    return {"closed-form": Gains(alpha_n_m=closed), "exact": Gains(alpha_n_m=critical if holds else best)}


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
            lambda plant: (0.05 * _scale(plant), 4.0 * _scale(plant)),
        ),
    ),
    signs={"alpha_n_m": 1.0},
    needs=frozenset({"damper-force", "drive-limit"}),
    candidates=_candidates,
    assess=_assess,
)
