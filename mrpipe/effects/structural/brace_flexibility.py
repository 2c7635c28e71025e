"""Brace flexibility: a spring between damper and floor, so that the damper moves less than the floor."""

from __future__ import annotations

from mrpipe.effects.contract import Separation, strength
from mrpipe.effects.structural.contract import StructuralEffect, StructuralForm

EFFECT = StructuralEffect(
    name="brace-flexibility",
    summary="the damper's rod lags the floor by the stretch of its brace",
    physics="Brace, rod ends and load cell stretch under the damper's force: its rod moves less than the floor.",
    remedy="Stiffen the brace, or measure the damper's own displacement; declare the brace's stiffness.",
    residual="The damper's loop is sheared: the floor moves further than the rod, by an amount proportional to the "
    "damper force.",
    source="Constantinou et al. (1998), damper in series with its brace (Maxwell)",
    acts_on="damper-rod",
    forms=(
        StructuralForm(
            "spring",
            "rod = floor - compliance x force",
            (strength("compliance", "m/N", "stretch of the brace per newton", "stroke/force", 0.0, 3.0, 0.01),),
            (),
        ),
    ),
    separated_by={
        "backlash": Separation(
            "slow small triangles at two currents: play is of one size, a brace stretches with the force", ("reversal",)
        ),
    },
)
