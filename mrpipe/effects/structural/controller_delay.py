"""Controller delay: the command is based on a past state."""

from __future__ import annotations

from mrpipe.effects.contract import Separation, strength
from mrpipe.effects.structural.contract import StructuralEffect, StructuralForm

_TIME = strength("time", "s", "dead time beyond sampling and filters of the controller", "time", 0.0, 0.2, 0.01)

EFFECT = StructuralEffect(
    name="controller-delay",
    summary="drive or desired force lag the motion",
    physics="Acquisition, computation, transmission or the current driver take time, so that the command is based on "
    "a past state.",
    remedy="Reduce the delay, predict the state over the delay, or include it in the design of the controller.",
    residual="The measured force lags the desired force by a constant time, which opens the loop over velocity.",
    source="Agrawal and Yang (1997)",
    acts_on="command",
    forms=(
        StructuralForm("drive-late", "drive(t) = inverse(desired force, motion)(t - T)", (_TIME,), ()),
        StructuralForm("law-late", "desired force(t) = law(state)(t - T)", (_TIME,), ()),
    ),
    separated_by={
        "delay": Separation("steps of the command at rest show the lag of the driver without the controller")
    },
)
