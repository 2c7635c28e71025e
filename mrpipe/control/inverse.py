"""The inverse of a parametric damper as a table: the drive at which the post-yield force has a given size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import UserError


@dataclass(frozen=True)
class InverseTable:
    """Post-yield force over speed and drive, both from zero in equal steps.

    Attributes
    ----------
    forces
        Shape (speeds, drives) [N], rising along the drive.
    largest_speed_m_s, largest_drive
        Of the last row and column (m/s; A or V).
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
        Range in speed and number of points; faster motion is treated as that speed.
    drive_limit
        Largest drive; that of the damper if left out.

    Raises
    ------
    UserError
        If the damper has no finite drive limit or its force does not rise with the drive.
    """
    limit = damper.drive_limit if drive_limit is None else min(drive_limit, damper.drive_limit)
    if not np.isfinite(limit) or limit <= 0.0:
        raise UserError("damper", "drive_limit", f"is {limit:g}", "give the largest drive the damper takes")
    speed = np.linspace(0.0, largest_speed_m_s, speeds)
    # the hysteresis carries its yield force at rest too: the sign of a tiny speed is enough
    speed[0] = 1e-9
    drive = np.linspace(0.0, limit, drives)
    forces = np.asarray(damper.quasi_static_force(speed[:, None], drive[None, :]))
    moving = forces[1:]
    if not np.all(moving[:, -1] > moving[:, 0]):
        raise UserError("damper", "force", "does not rise with the drive", "a constant damper has no inverse")
    # a fitted cubic may sag near an end; the inverse takes the smallest drive that gives the force
    return InverseTable(np.maximum.accumulate(forces, axis=1), largest_speed_m_s, float(limit))
