"""Yielding: a storey is elastic up to a drift, and yields beyond it."""

from __future__ import annotations

from mrpipe.effects.contract import Parameter, Separation, amplitude, shape
from mrpipe.effects.structural.contract import StructuralEffect, StructuralForm
from mrpipe.effects.structural.joint_friction import slipping_step


def _yield_drift(upper: float) -> Parameter:
    return shape("yield_drift", "m", "drift at which the storey yields", "stroke", 0.2, upper, (0.3, 0.5))


_FORCE = amplitude("force", "N", "force of the part of a storey that yields", "force", 0.0, 10.0)

EFFECT = StructuralEffect(
    name="yielding",
    summary="a storey yields beyond an elastic drift, and dissipates energy only then",
    physics="Columns, connections or braces yield beyond an elastic drift: a part of the stiffness becomes hysteretic.",
    remedy="Use smaller drifts, or declare yield drift and force of the named storeys.",
    residual="A hysteresis loop over the drift of one storey in the largest motions only; the stiffness falls and the "
    "damping rises beyond a drift.",
    source="Iwan (1966), elastic-plastic element in parallel with an elastic one; Bouc (1967), Wen (1976)",
    acts_on="storey",
    # the law is that of a slipping joint; a joint slips at drifts that are small compared with the largest one
    forms=(
        StructuralForm(
            "elastic-plastic",
            "F clip(drift since reversal / d_y)",
            (_yield_drift(1.0),),
            (_FORCE,),
            slipping_step,
            2,
            constants=(1.0,),
        ),
        StructuralForm(
            "gradual-yield",
            "four elastic-plastic springs with limits of 1/2 to 4 d_y",
            (_yield_drift(0.6),),
            (_FORCE,),
            slipping_step,
            5,
            constants=(4.0,),
        ),
    ),
    separated_by={
        "joint-friction": Separation("the same motion at a tenth of the amplitude: a joint still slips there"),
        "cubic-stiffness": Separation(
            "free decay from a large amplitude: yielding damps the large cycles, a softening stiffness does not"
        ),
        "nonlinear-damping": Separation(
            "free decay from a large amplitude: yielding lowers the frequency, nonlinear damping does not"
        ),
    },
)
