"""A small shaken frame of the tests' own, by Runge-Kutta: effects in forms that the library does not hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numba import njit

from mrpipe.campaigns.model import Campaign, Recording

RATE, FINE, FLOORS = 100.0, 8, 3
MASSES = np.array([6.0, 5.5, 5.0])
STOREYS = np.array([9000.0, 8000.0, 7000.0])
BRACE = 200.0
DAMPERS = np.array([6.0, 5.0, 4.0])


@njit(cache=True)
def _slope(z: np.ndarray, ground: float, code: int, out: np.ndarray) -> None:
    """State: x (3), v (3), hysteresis of each storey (3), turn of the base times storey height and its rate (2)."""
    x, v = z[:3], z[3:6]
    force = np.zeros(4)
    turn, turn_rate = z[9], z[10]
    moment = 0.0
    for s in range(3):
        d = x[s] - (x[s - 1] if s else 0.0) - turn
        r = v[s] - (v[s - 1] if s else 0.0) - turn_rate
        total = STOREYS[s] * d + DAMPERS[s] * r
        moment += total
        if code == 1:
            # Bouc-Wen hysteresis, n = 2
            h = z[6 + s]
            out[6 + s] = (r - 0.6 * abs(r) * abs(h) * h - 0.4 * r * h * h) / 1.5e-4
            total += (0.5, 0.8, 0.3)[s] * h
        elif code == 2:
            total += 2.0e7 * d**3 * (1.0 + 2e4 * d * d) if s == 1 else 0.0
        elif code == 9:
            # a part of storey 2 yields beyond 2 mm
            h = z[6 + s]
            out[6 + s] = (r - 0.5 * abs(r) * abs(h) * h - 0.5 * r * h * h) / 2e-3
            total += 2.0 * h if s == 1 else 0.0
        elif code == 10:
            total += 1.2e7 * d**3 if s == 2 else 0.0
        elif code == 8:
            # damping that grows with the square of the drift
            total += 2.0e6 * d * d * r if s == 1 else 0.0
        elif code == 6:
            # a law of no family: a storey that sings at a beat of its own
            total += 0.6 * np.sin(40.0 * np.sin(300.0 * d)) if s == 0 else 0.0
        force[s] = total
    for s in range(3):
        load = force[s + 1] - force[s]
        if code in (3, 10) and s == 1 and x[s] > 0.004:
            load -= 3.0e4 * (x[s] - 0.004) + 30.0 * max(v[s], 0.0)
        if code == 7 and s != 1:
            # a brace between the floors 1 and 3, so that the stiffness is not tri-diagonal
            load += BRACE * (x[2] - x[0]) * (1.0 if s == 0 else -1.0)
        out[s] = v[s]
        out[3 + s] = load / MASSES[s] - ground
    if code in (4, 5, 7):
        # an edge that lifts (5) gives up to half of the stiffness, by and by
        lifted = turn - 4e-4 * np.tanh(turn / 4e-4) if code == 5 else 0.0
        out[9], out[10] = turn_rate, (moment - 9.0e4 * (turn - 0.5 * lifted) - 60.0 * turn_rate) / 8.0


@njit(cache=True)
def shake(ground: np.ndarray, dt: float, code: int, every: int) -> tuple[np.ndarray, np.ndarray]:
    z, k = np.zeros(11), np.zeros((4, 11))
    size = (len(ground) - 1) // every + 1
    x, a = np.zeros((size, 3)), np.zeros((size, 3))
    for i in range(len(ground) - 1):
        middle = 0.5 * (ground[i] + ground[i + 1])
        k[:] = 0.0
        _slope(z, ground[i], code, k[0])
        if i % every == 0:
            x[i // every] = z[:3]
            a[i // every] = k[0, 3:6] + ground[i]
        _slope(z + 0.5 * dt * k[0], middle, code, k[1])
        _slope(z + 0.5 * dt * k[1], middle, code, k[2])
        _slope(z + dt * k[2], ground[i + 1], code, k[3])
        z += dt / 6.0 * (k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3])
    return x, a


CODES = {
    "clean": 0,
    "joint-friction": 1,
    "cubic-stiffness": 2,
    "impact": 3,
    "base-rocking": 4,
    "lifting-edge": 5,
    "unknown": 6,
    "braced-rocking": 7,
    "nonlinear-damping": 8,
    "yielding": 9,
    "impact and cubic-stiffness": 10,
}


def frame_campaign(effect: str, seed: int = 0) -> Campaign:
    """Return two training tests and a validation test of random and sweeping ground motion, noise of accelerometers."""
    rng = np.random.default_rng(seed)
    dt = 1.0 / (RATE * FINE)
    recordings = []
    for name, role, kind, seconds, level in (
        ("random-1", "training", "random", 30.0, 0.5),
        ("sweep-1", "training", "sweep", 30.0, 0.25),
        ("random-2", "validation", "random", 20.0, 0.4),
    ):
        time = np.arange(int(seconds / dt)) * dt
        if kind == "sweep":
            motion = np.sin(2.0 * np.pi * (1.0 * time + 0.5 * 10.0 / seconds * time**2))
        else:
            tones = rng.uniform(0.8, 12.0, 120)
            motion = np.sum(np.sin(2.0 * np.pi * tones[:, None] * time + rng.uniform(0, 7, (120, 1))), axis=0) / 8.0
        ground = level * motion * np.clip(np.minimum(time, seconds - 8.0 - time) / 2.0, 0.0, 1.0)
        x, a = shake(ground, dt, CODES[effect], FINE)
        size = len(x) - 1
        channels = {"ground_acceleration": ground[::FINE][:size] + 0.004 * rng.standard_normal(size)}
        for k in range(FLOORS):
            channels[f"floor_acceleration_{k + 1}"] = a[:size, k] + 0.004 * rng.standard_normal(size) + 0.02
            if k != 2:
                channels[f"floor_displacement_{k + 1}"] = x[:size, k] + 1e-5 * rng.standard_normal(size) + 3e-4
        clock = np.arange(size) / RATE
        recordings.append(Recording(name, role, RATE, clock, channels, ((0, size),), kind, {}))
    return Campaign(f"own-{effect}", "shear-frame", Path("nowhere"), tuple(recordings), floor_masses_kg=tuple(MASSES))
