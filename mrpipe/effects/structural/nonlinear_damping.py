"""Nonlinear damping: the damping of a storey grows with its drift or with its speed."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Parameter, Separation, amplitude, shape
from mrpipe.effects.structural.contract import STEP_SIGNATURE, StructuralEffect, StructuralForm


@njit(STEP_SIGNATURE, cache=True)
def drift_step(
    position: float, rate: float, state: FloatArray, parameters: FloatArray, dt: float, out: FloatArray
) -> None:
    """Force v |x/1 mm|^p; parameters: power p."""
    out[0] = rate * abs(1e3 * position) ** parameters[0]


@njit(STEP_SIGNATURE, cache=True)
def speed_step(
    position: float, rate: float, state: FloatArray, parameters: FloatArray, dt: float, out: FloatArray
) -> None:
    """Force v |v/(0.1 m/s)|^(p - 1); parameters: power p."""
    out[0] = rate * abs(10.0 * rate) ** (parameters[0] - 1.0)


def _damping(where: str) -> Parameter:
    return amplitude("damping", "N*s/m", f"added damping coefficient at {where}", "force/speed", 0.0, 1e9)


EFFECT = StructuralEffect(
    name="nonlinear-damping",
    summary="the damping of a storey grows with its drift or with its speed",
    physics="Micro-cracks and joints take part as the drift grows, so that the damping grows with the amplitude; air "
    "and liquids resist with the square of the speed.",
    remedy="Use tests of the amplitude of interest, or declare the damping coefficient over drift or speed.",
    residual="A force in phase with the drift rate that grows faster than it; the damping ratio rises with the "
    "amplitude, while the frequency does not change.",
    source="Jeary (1986), damping that grows with amplitude; Morison et al. (1950), drag",
    acts_on="storey",
    forms=(
        StructuralForm(
            "with-drift",
            "c |d|^p v",
            (shape("power", "1", "power of the drift", "one", 0.5, 4.0, (1.0, 2.0)),),
            (_damping("1 mm of drift (|d/mm|^p)"),),
            drift_step,
        ),
        StructuralForm(
            "quadratic", "c |v| v", (), (_damping("0.1 m/s (|v|/(0.1 m/s))"),), speed_step, constants=(2.0,)
        ),
        StructuralForm(
            "with-speed",
            "c |v|^p sign(v)",
            (shape("power", "1", "power of the speed", "one", 1.3, 4.0, (1.6, 2.5)),),
            (_damping("0.1 m/s (|v|/(0.1 m/s))^(p-1)"),),
            speed_step,
        ),
    ),
    separated_by={
        "joint-friction": Separation(
            "free decay from two amplitudes: friction dominates at small amplitudes, nonlinear damping at large ones"
        ),
        "impact": Separation("the same motion at half the amplitude: a bumper is not reached"),
        "cubic-stiffness": Separation(
            "free decay from a large amplitude: nonlinear damping keeps the frequency, a cubic stiffness shifts it"
        ),
    },
)
