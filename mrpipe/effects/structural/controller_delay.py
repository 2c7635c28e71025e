"""Controller delay: the command comes later than the state it answers."""

from __future__ import annotations

from mrpipe.effects.contract import Separation, strength
from mrpipe.effects.structural.contract import StructuralEffect, StructuralForm

_TIME = strength("time", "s", "dead time beyond sampling and filters of the controller", "time", 0.0, 0.2, 0.01)

EFFECT = StructuralEffect(
    name="controller-delay",
    summary="drive or desired force are late for the motion",
    physics="Acquisition, computation, transmission or the current driver take time: the command answers a past state.",
    remedy="Shorten the loop, predict the state over the delay, or declare it in the controller's design.",
    residual="The measured force lags the desired force by a constant time; the loop over velocity opens.",
    source="Agrawal and Yang (1997)",
    acts_on="command",
    forms=(
        StructuralForm("drive-late", "drive(t) = inverse(desired force, motion)(t - T)", (_TIME,), ()),
        StructuralForm("law-late", "desired force(t) = law(state)(t - T)", (_TIME,), ()),
    ),
    separated_by={"delay": Separation("steps of the command at rest: the driver's lag shows without the controller")},
)
