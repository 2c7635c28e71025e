"""Functions that the linear laws share: f = c v + k x (4.14), clipped where it would add energy (P2 (22))."""

from __future__ import annotations

from collections.abc import Mapping

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control import exact, limits
from mrpipe.control.gains import Gains
from mrpipe.control.kernel import GAIN_C, GAIN_K, LAW_SIGNATURE, S_V, S_X
from mrpipe.control.law import Assessment, GainRange, Plant
from mrpipe.control.linearisation import clipped_force, clipped_linear_stiffness


@njit(LAW_SIGNATURE, cache=True)
def linear_force(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Return f = c v + k x (4.11), (4.14)."""
    return numbers[GAIN_C] * state[S_V] + numbers[GAIN_K] * state[S_X]


C_BODY = "    return numbers[GAIN_C] * state[S_V] + numbers[GAIN_K] * state[S_X];\n"

VISCOSITY = GainRange("c_n_s_m", "viscosity", lambda plant: (0.02 * _scale(plant), 4.0 * _scale(plant)))
POSITIVE_STIFFNESS = GainRange(
    "k_n_m", "positive stiffness", lambda plant: (0.0, plant.static_stiffness_n_m), optional=True
)
NEGATIVE_STIFFNESS = GainRange(
    # beyond the static stiffness too, because the clipped force is never active and so cannot destabilise the structure
    "k_n_m",
    "negative stiffness",
    lambda plant: (-2.5 * plant.static_stiffness_n_m, 0.0),
    optional=True,
)


def _scale(plant: Plant) -> float:
    return limits.optimal_viscosity(plant.modes)


def linear_candidates(plant: Plant, k: float) -> Mapping[str, Gains]:
    """Return c by closed form (P2 and thesis) and for the largest exact damping, at a given stiffness k [N/m]."""
    modes = plant.modes
    closed, target = limits.optimal_viscosity(modes, k), exact.target_mode(plant.bare, plant.position, modes)

    def ratio(c: float) -> float:
        # the equivalent of the clipped law does not show that a single mode can be damped critically
        if k < 0.0 and not modes.is_single:
            # unclipped negative stiffness can make the structure unstable, so the clipped law is optimised
            H = clipped_linear_stiffness(c, k, modes.omega_0)
            return exact.stable_ratio(target.equivalent(H))
        return exact.stable_ratio(target.linear(c, k))

    best = exact.best_gain(ratio, 4.0 * limits.optimal_viscosity(modes))
    thesis = {} if modes.is_single else {"closed-form-thesis": Gains(limits.optimal_viscosity_thesis(modes, k), k)}
    return {"closed-form": Gains(closed, k), **thesis, "exact": Gains(best.gain, k)}


def linear_assessment(plant: Plant, gains: Gains) -> Assessment:
    """Return the damping of f = c v + k x by closed form, complex eigenvalue, and equivalent of the clipped law."""
    modes, c, k = plant.modes, gains.c_n_s_m, gains.k_n_m
    without, with_frame = (exact.exact_damping(item, plant.position, modes, c, k) for item in (plant.bare, plant.frame))
    clipped = float("nan")
    if k:
        H = clipped_linear_stiffness(c, k, modes.omega_0)
        clipped = exact.exact_equivalent(plant.bare, plant.position, modes, H).damping_ratio
    return Assessment(
        limits.damping_estimate(modes, k, c * modes.omega_0),
        without.damping_ratio,
        with_frame.damping_ratio,
        clipped,
        with_frame.unstable_pole,
    )


def linear_in_harmonic_motion(gains: Gains, x: FloatArray, v: FloatArray, _: float) -> FloatArray:
    """Return the clipped force of f = c v + k x."""
    return clipped_force(gains.c_n_s_m, gains.k_n_m, x, v)
