"""Yield velocity of biviscous models, which grows with the drive.

The viscosity before yield is about constant, so the velocity at which the damper yields grows with the yield force,
therefore with the drive u: v_y = v (r + (1 - r) (1 - q) |u/u_max|^p). An effect that takes the share q of the
yield force away, such as warm fluid, lowers the growing part with it.
"""

from __future__ import annotations

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import Strength
from mrpipe.dampers.parameters import Values, constant, shape

REST = shape(
    "rest_share", "1", "yield velocity without drive over that at the largest drive", "one", 0.02, 2.0, (0.3, 1.0)
)
BEND = shape("bend", "1", "power of the drive that the yield velocity grows with", "one", 0.3, 3.0, (1.0,))
LARGEST_DRIVE = constant("largest_drive", "drive", "drive at which the yield velocity is given", "drive")


@njit(float64(float64, float64, float64, float64, float64, float64), cache=True)
def yield_velocity(velocity: float, drive: float, loss: float, rest: float, bend: float, largest: float) -> float:
    """Return v_y = velocity (rest + (1 - rest) (1 - loss) |drive/largest|^bend) [m/s]."""
    if rest == 1.0:
        return velocity
    return velocity * max(rest + (1.0 - rest) * (1.0 - loss) * (abs(drive) / largest) ** bend, 0.5 * rest)


def growth_of(values: Values) -> tuple[float, float, float]:
    """Return share at rest, power and largest drive; the yield velocity is constant where they are left out."""
    return values.get("rest_share", 1.0), values.get("bend", 1.0), values.get("largest_drive", 1.0)


def width_of(values: Values, at: Strength) -> FloatArray:
    """Return the yield velocity [m/s] at these drives."""
    rest, bend, largest = growth_of(values)
    growth = np.maximum(rest + (1.0 - rest) * (np.abs(at.drive) / largest) ** bend, 0.5 * rest)
    return np.asarray(values["yield_velocity"] * growth, dtype=np.float64)
