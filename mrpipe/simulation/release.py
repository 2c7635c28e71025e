"""The state from which a structure is released into a free decay: its calibrated mode."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.limits import STILL, moving_modes, separated
from mrpipe.errors import UserError
from mrpipe.structures import Frame, natural_modes


def calibrated_shape(frame: Frame, position: FloatArray, omega_0: float) -> FloatArray:
    """Return the mode of unit modal mass, shape (n,), that moves a damper and is nearest in frequency.

    Parameters
    ----------
    frame
        The structure.
    position
        Connectivity vector of the damper, shape (n,).
    omega_0
        Frequency for which the damper is calibrated [rad/s].
    """
    found = natural_modes(frame)
    shapes = separated(position, found.angular_frequencies, found.mode_shapes)
    moving = np.array(moving_modes(position, shapes)) - 1
    return np.asarray(shapes[:, moving[np.argmin(np.abs(found.angular_frequencies[moving] - omega_0))]])


def top_amplitude(frame: Frame, shape: FloatArray, setting: str) -> float:
    """Return the amplitude of a mode at the top.

    Parameters
    ----------
    frame, shape
        Structure and mode, shape (n,).
    setting
        Setting of the section `simulate.excitation` that needs it, for the message.

    Raises
    ------
    UserError
        If the mode does not move the top in the direction of the ground motion.
    """
    top = float(shape[frame.top])
    if abs(top) <= STILL * float(np.max(np.abs(shape))):
        raise UserError(
            "simulate.excitation",
            setting,
            f"the mode of the damper does not move the top, {frame.names[frame.top]}, in the direction of the ground "
            "motion",
            "give the direction of the damper (direction_deg), or place it in this direction",
        )
    return top


def released(frame: Frame, position: FloatArray, omega_0: float, amplitude_m: float, top_m: float | None) -> FloatArray:
    """Return displacements and velocities, shape (2n,), of the calibrated mode at rest in its largest displacement.

    Parameters
    ----------
    frame, position, omega_0
        As in :func:`calibrated_shape`.
    amplitude_m
        Displacement of the damper without `top_m` [m].
    top_m
        Displacement of the top [m]; None: the damper has `amplitude_m`.

    Raises
    ------
    UserError
        If `top_m` is given and the mode does not move the top.
    """
    shape = calibrated_shape(frame, position, omega_0)
    if top_m is None:
        side = -1.0 if shape[frame.top] < 0.0 else 1.0
        scale = side * amplitude_m / abs(float(position @ shape))
    else:
        scale = top_m / top_amplitude(frame, shape, "release_top_m")
    return np.concatenate([scale * shape, np.zeros(frame.floors)])
