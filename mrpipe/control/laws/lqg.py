"""Linear-quadratic Gaussian control, clipped by the damper."""

from __future__ import annotations

from mrpipe.control.law import Law
from mrpipe.control.laws._regulator import C_BODY, C_OBSERVE, regulator_assessment, regulator_force
from mrpipe.control.lqg import frame_regulator_gain, lqg_observer

LAW = Law(
    name="lqg",
    summary="clipped linear-quadratic Gaussian control with a state observer",
    source="thesis appendix E",
    force=regulator_force,
    c_body=C_BODY,
    c_helpers=C_OBSERVE,
    needs=frozenset({"observer", "floor-accelerations", "observer-force"}),
    assess=lambda plant, _: regulator_assessment(
        plant, frame_regulator_gain(plant.frame, plant.position, plant.weights)
    ),
    observer=lqg_observer,
)
