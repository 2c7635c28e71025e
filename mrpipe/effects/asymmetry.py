"""Asymmetry: the damper pulls harder than it pushes."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    CURRENT,
    FORCE,
    HYSTERESIS,
    HYSTERETIC_FORCE,
    STEP_SIGNATURE,
    VELOCITY,
    VISCOUS_FORCE,
    Phase,
    Step,
)
from mrpipe.effects.contract import Effect, EffectForm, Values, amplitude


@njit(STEP_SIGNATURE, cache=True)
def asymmetry_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, kind (0 yield, 1 viscous, 2 both, 3 constant, 4 with drive)."""
    kind = parameters[1]
    if kind == 0.0:
        force = abs(wire[HYSTERETIC_FORCE])
    elif kind == 1.0:
        force = abs(wire[VISCOUS_FORCE])
    elif kind == 2.0:
        force = abs(wire[HYSTERETIC_FORCE] + wire[VISCOUS_FORCE])
    elif kind == 3.0:
        force = abs(wire[HYSTERESIS])
    elif kind == 4.0:
        force = abs(wire[HYSTERESIS]) * wire[CURRENT]
    else:
        force = abs(wire[VELOCITY])
    wire[FORCE] += parameters[0] * force


def _one(value: float, kind: float) -> Step:
    return Step("asymmetry", Phase.FORCE_EFFECT, asymmetry_step, np.array([value, kind]))


def _yield(values: Values) -> list[Step]:
    return [_one(values["share"], 0.0)]


def _viscous(values: Values) -> list[Step]:
    return [_one(values["share"], 1.0)]


def _both(values: Values) -> list[Step]:
    return [_one(values["share"], 2.0)]


def _own(values: Values) -> list[Step]:
    return [_one(values["friction"], 3.0), _one(values["friction_rate"], 4.0), _one(values["drag"], 5.0)]


_SHARE = amplitude("share", "1", "half the difference of the two directions over their mean", "one", -0.9, 0.9)

EFFECT = Effect(
    name="asymmetry",
    summary="forces differ between the two directions of motion",
    physics="Piston areas differ between the chambers, a seal drags one way, or the rod leaves on one side.",
    remedy="Test both ways round in the machine; if it turns with the damper it is the damper's, else the machine's.",
    source="differences of the chambers of a single-rod damper",
    acts_on="force",
    forms=(
        EffectForm("yield", "F + s |alpha z|", (_SHARE,), _yield, {"share": 0}),
        EffectForm("viscous", "F + s |c v|", (_SHARE,), _viscous, {"share": 0}),
        EffectForm("both", "F + s |alpha z + c v|", (_SHARE,), _both, {"share": 0}),
        EffectForm(
            "own-coefficients",
            "F + |z| (a + b u) + c |v|",
            (
                amplitude("friction", "N", "difference at no drive", "force", -2.0, 2.0),
                amplitude("friction_rate", "N/drive", "its change with the drive", "force/drive", -2.0, 2.0),
                amplitude("drag", "N*s/m", "difference of the viscosities", "force/speed", -2.0, 2.0),
            ),
            _own,
            {"friction": 0, "friction_rate": 1, "drag": 2},
        ),
    ),
    separated_by={"offset": "constant drive at several speeds; rest at several drives"},
)
