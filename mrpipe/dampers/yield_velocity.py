"""Yield velocity of biviscous models, which grows with the drive.

The viscosity before yield is approximately constant. The velocity at which the damper yields therefore grows with the
yield force, and with the drive u: v_y = v (r + (1 - r) (1 - q) |u/u_max|^p). An effect that reduces the yield force by
the share q, such as warm fluid, reduces the growing part by the same share.
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
BEND = shape("bend", "1", "exponent with which the yield velocity grows with the drive", "one", 0.3, 3.0, (1.0,))
LARGEST_DRIVE = constant("largest_drive", "drive", "drive for which the yield velocity is given", "drive")


@njit(float64(float64, float64, float64, float64, float64, float64), cache=True)
def yield_velocity(velocity: float, drive: float, loss: float, rest: float, bend: float, largest: float) -> float:
    """Return v_y = velocity (rest + (1 - rest) (1 - loss) |drive/largest|^bend) [m/s]."""
    if rest == 1.0:
        return velocity
    return velocity * max(rest + (1.0 - rest) * (1.0 - loss) * (abs(drive) / largest) ** bend, 0.5 * rest)


def growth_of(values: Values) -> tuple[float, float, float]:
    """Return share at zero drive, power and largest drive; by default the yield velocity is constant."""
    return values.get("rest_share", 1.0), values.get("bend", 1.0), values.get("largest_drive", 1.0)


def width_of(values: Values, at: Strength) -> FloatArray:
    """Return the yield velocity [m/s] at these drives."""
    rest, bend, largest = growth_of(values)
    growth = np.maximum(rest + (1.0 - rest) * (np.abs(at.drive) / largest) ** bend, 0.5 * rest)
    return np.asarray(values["yield_velocity"] * growth, dtype=np.float64)
