"""Brace flexibility: a spring between damper and floor, so that the damper moves less than the floor."""

from __future__ import annotations

from mrpipe.effects.contract import Separation, strength
from mrpipe.effects.structural.contract import StructuralEffect, StructuralForm

EFFECT = StructuralEffect(
    name="brace-flexibility",
    summary="the rod of the damper moves less than the floor, because the brace stretches",
    physics="Brace, rod ends and load cell stretch under the damper force, so that the rod moves less than the floor.",
    remedy="Stiffen the brace, or measure the displacement at the damper; declare the stiffness of the brace.",
    residual="The loop of the damper is sheared: the floor moves further than the rod, by an amount proportional to "
    "the damper force.",
    source="Constantinou et al. (1998), damper in series with its brace (Maxwell)",
    acts_on="damper-rod",
    forms=(
        StructuralForm(
            "spring",
            "rod = floor - compliance x force",
            (strength("compliance", "m/N", "elongation of the brace per newton", "stroke/force", 0.0, 3.0, 0.01),),
            (),
        ),
    ),
    separated_by={
        "backlash": Separation(
            "slow small triangles at two currents: play is constant, while a brace stretches in proportion to the "
            "force",
            ("reversal",),
        ),
    },
)
