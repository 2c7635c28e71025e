"""Checks that loops with one damper and with several have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mrpipe.artifacts import require_parameter_set
from mrpipe.effects.damper import require_damper
from mrpipe.errors import UserError
from mrpipe.simulation.settings import SimulateSettings
from mrpipe.structures import Frame

if TYPE_CHECKING:
    from mrpipe.simulation.loop import LoopOptions


def check_loop(frame: Frame, options: LoopOptions) -> None:
    """Check the masses of the structure and the times of the loop.

    Raises
    ------
    UserError
        If the mass is singular, or a delay or time constant negative.
    """
    if options.delay_s < 0.0 or options.driver_time_constant_s < 0.0:
        raise UserError("simulate", "delay_s or driver_time_constant_s", "is negative", "give 0 or more seconds")
    if np.linalg.matrix_rank(frame.mass) < frame.floors:
        raise UserError(f"frame {frame.name}", "mass", "is singular", "every degree of freedom needs a positive mass")


def require_models(settings: SimulateSettings) -> None:
    """Refuse a damper or a frame of the section `simulate` that is not there, before stages are built for it.

    Raises
    ------
    UserError
        If there is no such artifact, parameter set or file; the message names the setting.
    """
    require_damper(settings.damper, "simulate.damper")
    if settings.frame != "identified":
        require_parameter_set("frames", settings.frame, "simulate.frame", "identified")
