"""Cubic stiffness: columns stiffen (membrane forces) or soften (gravity, thin clamps) with drift."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Parameter, Separation, amplitude, shape
from mrpipe.effects.structural.contract import STEP_SIGNATURE, StructuralEffect, StructuralForm


@njit(STEP_SIGNATURE, cache=True)
def power_step(
    position: float, rate: float, state: FloatArray, parameters: FloatArray, dt: float, out: FloatArray
) -> None:
    """Force x |x/1 mm|^(p - 1); parameters: power p, sign."""
    out[0] = parameters[1] * position * abs(1e3 * position) ** (parameters[0] - 1.0)


def _stiffness(power: str) -> Parameter:
    meaning = f"added secant stiffness at 1 mm of drift (|d/mm|^{power})"
    return amplitude("stiffness", "N/m", meaning, "force/stroke", 0.0, 1e9)


_POWER = shape("power", "1", "power of the drift", "one", 1.6, 5.0, (2.4, 3.6))

EFFECT = StructuralEffect(
    name="cubic-stiffness",
    summary="the stiffness of a storey changes with the square of its drift",
    physics="A large drift stretches columns that are clamped at both ends, which stiffens them; soft clamps and "
    "gravity soften.",
    remedy="Use smaller drifts, or declare the cubic coefficient of the named storeys.",
    residual="A cubic curve over the drift of one storey; the natural frequency changes with the amplitude.",
    source="Duffing (1918)",
    acts_on="storey",
    forms=(
        StructuralForm("cubic", "k3 d^3", (), (_stiffness("2"),), power_step, constants=(3.0, 1.0)),
        StructuralForm("softening", "-k3 d^3", (), (_stiffness("2"),), power_step, constants=(3.0, -1.0)),
        StructuralForm("power", "k |d|^p sign(d)", (_POWER,), (_stiffness("(p-1)"),), power_step, constants=(1.0,)),
        StructuralForm(
            "softening-power", "-k |d|^p sign(d)", (_POWER,), (_stiffness("(p-1)"),), power_step, constants=(-1.0,)
        ),
    ),
    separated_by={
        "impact": Separation(
            "the same motion at half the amplitude: a bumper is not reached, while a cubic force falls to an eighth"
        ),
        "joint-friction": Separation(
            "free decay from two amplitudes: a cubic stiffness shifts the frequency, friction ends the decay"
        ),
    },
)
