"""Simulated force of a damper at constant speed and drive, which inverses of a damper with effects need."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import FORCE, Chain, run_chain

SPEED_SHARES = (0.0, 0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0)
"""Speeds at which the force is simulated, as shares of the largest speed."""

DRIVES = 11
"""Number of drives at which the force is simulated, from 0 to the limit."""

STEP_S = 2e-3
"""Longest time step of these simulations [s]."""

HALF_PERIOD_S = 0.5
"""Longest duration of one stroke [s]. A drive is held for two strokes before the force is taken, so that lags decay."""


def held_force(chain: Chain, speed: float, drive: float, before: float, stroke_m: float, half_period_s: float) -> float:
    """Return the mean post-yield force [N] over two half periods at constant speed, after the drive has changed.

    Parameters
    ----------
    chain
        Steps of the damper.
    speed
        Speed in both directions in turn [m/s].
    drive, before
        Drive at which the force is taken, and drive that was held before it [A or V].
    stroke_m
        Half the largest peak-to-peak displacement [m].
    half_period_s
        Longest time in one direction [s].
    """
    half = min(half_period_s, 2.0 * stroke_m / speed)
    dt = min(STEP_S, half / 40.0)
    # the drive changes at a reversal, after two half periods in which a memory of the drive can build up
    change = 2.0 * np.ceil(half_period_s / half) * half
    time = np.arange(0.0, change + 2.0 * half_period_s + half, dt)
    turns = time / half
    ramp = np.abs(np.mod(turns, 2.0) - 1.0)
    out = np.mod(turns, 2.0) < 1.0
    x, v = speed * half * (0.5 - ramp), np.where(out, speed, -speed)
    force = run_chain(chain, x, v, np.zeros_like(x), np.where(time < change, before, drive), dt)[:, FORCE]
    # around the middle of the stroke springs cancel, and the lag of the drive has decayed there
    part = (time > change + 0.2 * half_period_s) & (time < change + 2.0 * half_period_s) & (np.abs(ramp - 0.5) < 0.3)
    moved = force * np.sign(v)
    return 0.5 * float(np.mean(moved[part & out]) + np.mean(moved[part & ~out]))


def steady_force(
    chain: Chain, velocity: FloatArray | float, drive: FloatArray | float, stroke_m: float, drive_limit: float
) -> FloatArray:
    """Return the post-yield force [N] of a chain at constant speeds and drives, which broadcast against each other.

    The force is simulated on a coarse grid and interpolated linearly.
    """
    speed, u = np.broadcast_arrays(np.abs(np.asarray(velocity, dtype=np.float64)), np.asarray(drive, dtype=np.float64))
    fastest = max(float(speed.max()), 1e-9)
    limit = drive_limit if np.isfinite(drive_limit) else max(float(u.max()), 1e-9)
    speeds = np.array([max(share, 1e-3) * fastest for share in SPEED_SHARES])
    drives = np.linspace(0.0, limit, DRIVES) if float(np.ptp(u)) > 0.0 else np.array([float(u.flat[0])])
    grid = np.array(
        [[held_force(chain, float(s), float(d), float(d), stroke_m, HALF_PERIOD_S) for d in drives] for s in speeds]
    )
    if len(drives) == 1:
        found = np.interp(speed, speeds, grid[:, 0])
    else:
        place = np.clip(u / limit * (DRIVES - 1), 0.0, DRIVES - 1.0)
        left = np.minimum(place.astype(np.int64), DRIVES - 2)
        columns = np.stack([np.interp(speed.ravel(), speeds, column) for column in grid.T])
        index = np.arange(speed.size)
        part = (place - left).ravel()
        found = columns[left.ravel(), index] * (1.0 - part) + columns[left.ravel() + 1, index] * part
        found = found.reshape(speed.shape)
    return np.asarray(np.sign(velocity) * found, dtype=np.float64)
