"""Inverse of a parametric damper as a table: the drive at which the post-yield force has a given magnitude."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import UserError


@dataclass(frozen=True)
class InverseTable:
    """Post-yield force on a grid of speed and drive, both in equal steps from zero.

    Attributes
    ----------
    forces
        Forces, shape (speeds, drives) [N]; they increase with the drive.
    largest_speed_m_s, largest_drive
        Speed of the last row [m/s] and drive of the last column [A or V].
    """

    forces: FloatArray
    largest_speed_m_s: float
    largest_drive: float


def inverse_table(
    damper: DamperModel,
    *,
    largest_speed_m_s: float = 0.5,
    speeds: int = 101,
    drives: int = 81,
    drive_limit: float | None = None,
) -> InverseTable:
    """Tabulate :meth:`DamperModel.quasi_static_force`.

    Parameters
    ----------
    damper
        The model to be inverted.
    largest_speed_m_s, speeds, drives
        Largest speed [m/s] and numbers of points in speed and drive. The table treats a faster motion as this speed.
    drive_limit
        Largest drive [A or V]; None: that of the damper.

    Raises
    ------
    UserError
        If the damper has no finite drive limit or its force does not rise with the drive.
    """
    limit = damper.drive_limit if drive_limit is None else min(drive_limit, damper.drive_limit)
    if not np.isfinite(limit) or limit <= 0.0:
        raise UserError("damper", "drive_limit", f"is {limit:g}", "give the largest drive of the damper")
    speed = np.linspace(0.0, largest_speed_m_s, speeds)
    # the hysteretic element has its yield force at rest as well, so that the sign of a tiny speed is sufficient
    speed[0] = 1e-9
    drive = np.linspace(0.0, limit, drives)
    forces = np.asarray(damper.quasi_static_force(speed[:, None], drive[None, :]))
    moving = forces[1:]
    if not np.all(moving[:, -1] > moving[:, 0]):
        raise UserError("damper", "force", "does not rise with the drive", "a constant damper has no inverse")
    # a fitted cubic may decrease near an end; the inverse is the smallest drive that gives the force
    return InverseTable(np.maximum.accumulate(forces, axis=1), largest_speed_m_s, float(limit))
