"""Impact: a floor strikes a bumper or a neighbour when its displacement exceeds a gap."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Separation, amplitude, shape
from mrpipe.effects.structural.contract import STEP_SIGNATURE, StructuralEffect, StructuralForm


@njit(STEP_SIGNATURE, cache=True)
def contact_step(
    position: float, rate: float, state: FloatArray, parameters: FloatArray, dt: float, out: FloatArray
) -> None:
    """Contact of stiffness and damping beyond a gap; parameters: gap [m], kind (0 linear, 1 Hertz), side (0, 1, -1).

    Unit forces: spring, and a dashpot that acts only during compression.
    """
    out[0] = 0.0
    out[1] = 0.0
    side = 1.0 if position > 0.0 else -1.0
    if parameters[2] * side < 0.0:
        return
    inside = abs(position) - parameters[0]
    if inside <= 0.0:
        return
    pressed = inside if parameters[1] == 0.0 else inside * (1e3 * inside) ** 0.5
    out[0] = side * pressed
    if side * rate > 0.0:
        out[1] = rate * pressed / parameters[0]


_GAP = shape(
    "gap", "m", "free travel of the floor before the contact", "stroke", 0.15, 0.99, (0.35, 0.5, 0.65, 0.8, 0.92)
)
_STIFFNESS = amplitude("stiffness", "N/m", "stiffness of the contact", "force/stroke", 0.0, 1e6)
_HERTZ = amplitude("stiffness", "N/m", "secant stiffness of the contact at 1 mm", "force/stroke", 0.0, 1e6)
_DAMPING = amplitude(
    "damping", "N*s/m", "damping of the contact at an indentation equal to the gap", "force/speed", 0.0, 1e6
)


def _form(name: str, summary: str, kind: float, side: float) -> StructuralForm:
    stiffness = _HERTZ if kind == 1.0 else _STIFFNESS
    return StructuralForm(name, summary, (_GAP,), (stiffness, _DAMPING), contact_step, constants=(kind, side))


EFFECT = StructuralEffect(
    name="impact",
    summary="a force that begins when a floor has moved through a gap",
    physics="A floor strikes a bumper, a stop of the table or a neighbour once its displacement exceeds the free gap.",
    remedy="Widen the gap at the named floor or reduce the excitation; declare gap and contact stiffness.",
    residual="Zero up to some displacement of one floor, a steep rise beyond it, and high-frequency bursts in its "
    "acceleration.",
    source="Hunt and Crossley (1975), Jankowski (2005)",
    acts_on="floor",
    places="one",
    forms=(
        _form("two-sided", "k (|x| - gap) beyond the gap", 0.0, 0.0),
        _form("positive-side", "k (x - gap) beyond the gap, one side", 0.0, 1.0),
        _form("negative-side", "k (x + gap) beyond the gap, one side", 0.0, -1.0),
        _form("hertz", "k (|x| - gap)^1.5 beyond the gap", 1.0, 0.0),
        _form("hertz-positive", "k (x - gap)^1.5, one side", 1.0, 1.0),
        _form("hertz-negative", "k (x + gap)^1.5, one side", 1.0, -1.0),
    ),
    separated_by={"cubic-stiffness": Separation("the same motion at half the amplitude: a bumper is not reached")},
)
