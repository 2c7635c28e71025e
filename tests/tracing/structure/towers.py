"""Linear towers of six floors that shear, bend or both, shaken at the ground: responses by modal superposition."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import linalg, signal

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.tracing.structure.records import FrameRecord

RATE = 200.0
FLOORS = 6
MASSES = np.linspace(1.1, 0.9, FLOORS) * 2000.0
LOWEST_HZ = 2.5


def shearing() -> FloatArray:
    """Return the stiffness of a shear frame whose storeys soften towards the top, shape (n, n)."""
    drift = np.eye(FLOORS) - np.eye(FLOORS, k=-1)
    return np.asarray(drift.T @ np.diag(np.linspace(1.0, 0.7, FLOORS)) @ drift)


def bending() -> FloatArray:
    """Return the stiffness of a cantilever beam of finite elements with condensed rotations, shape (n, n)."""
    element = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    whole = np.zeros((2 * FLOORS + 2, 2 * FLOORS + 2))
    for k in range(FLOORS):
        whole[2 * k : 2 * k + 4, 2 * k : 2 * k + 4] += element
    moved, turned = slice(2, None, 2), slice(3, None, 2)
    rest = np.linalg.solve(whole[turned, turned], whole[turned, moved])
    return np.asarray(whole[moved, moved] - whole[moved, turned] @ rest)


def stiffness_of(kind: str) -> FloatArray:
    """Return the stiffness of a tower [N/m], scaled to its lowest frequency; kind: shear, wall, wall and frame."""
    parts = {"shear": [shearing()], "wall": [bending()], "wall and frame": [shearing(), bending()]}[kind]
    one = np.ones(FLOORS)
    total = np.sum([item * np.linalg.solve(item, one)[-1] for item in parts], axis=0)
    lowest = linalg.eigh(total, np.diag(MASSES), eigvals_only=True)[0]
    return np.asarray(total * (2.0 * np.pi * LOWEST_HZ) ** 2 / lowest)


def tower_records(kind: str, noise: float = 0.005) -> list[FrameRecord]:
    """Return two training records and a validation record, with white noise of all accelerometers [m/s2]."""
    rng = np.random.default_rng(17)
    squared, shapes = linalg.eigh(stiffness_of(kind), np.diag(MASSES))
    found = []
    for name, role, kind, level in (
        ("a", "training", "random", 0.6),
        ("b", "training", "sweep", 0.5),
        ("c", "validation", "random", 0.5),
    ):
        size = int(40.0 * RATE)
        band = signal.butter(2, [1.0, 40.0], "bandpass", fs=RATE, output="sos")
        ground = level * signal.sosfilt(band, rng.standard_normal(size))
        if kind == "sweep":
            ground = level * signal.chirp(np.arange(size) / RATE, 1.0, size / RATE, 40.0)
        ground *= signal.windows.tukey(size, 0.4)
        omega = 2.0 * np.pi * np.fft.rfftfreq(size, 1.0 / RATE)[:, None]
        modal = -(shapes.T @ MASSES) / (squared - omega**2 + 2j * 0.015 * np.sqrt(squared) * omega)
        relative = -(omega**2) * modal * np.fft.rfft(ground)[:, None] @ shapes.T
        absolute = np.fft.irfft(relative, size, axis=0) + ground[:, None]
        seen = ground + noise * rng.standard_normal(size)
        moved = absolute + noise * rng.standard_normal((size, FLOORS))
        found.append(FrameRecord(name, role, kind, RATE, seen, moved, {}, {}, {}))
    return found


POSITIONS = {"x": [0.3, 0.4], "y1": [-3.6, 0.2], "y2": [3.6, -0.3]}
"""Sensors of the eccentric building on each floor: x and y from the centre of mass [m]."""

ECCENTRICITY_M = (0.5, 0.25)
"""Centre of stiffness of the eccentric building, from the centre of mass."""


def eccentric_building() -> Campaign:
    """Return the campaign of a linear building of three floors that translates and turns; two training tests."""
    rng, floors, radius_2 = np.random.default_rng(23), 3, 8.0
    masses = np.full(floors, 2000.0)
    ex, ey = ECCENTRICITY_M
    storey = np.array([[1.0, 0.0, -ey], [0.0, 1.4, 1.4 * ex], [-ey, 1.4 * ex, 1.6 * radius_2 + ey**2 + 1.4 * ex**2]])
    drift = np.eye(floors) - np.eye(floors, k=-1)
    chain = drift.T @ np.diag([1.0, 0.9, 0.7]) @ drift
    inertia = np.diag(np.kron(masses, [1.0, 1.0, radius_2]))
    squared, shapes = linalg.eigh(np.kron(chain, storey), inertia)
    squared *= (2.0 * np.pi * LOWEST_HZ) ** 2 / squared[0]
    tests = []
    for name, role, level in (("a", "training", 0.5), ("b", "training", 0.8), ("c", "validation", 0.6)):
        size = int(40.0 * RATE)
        band = signal.butter(4, [1.0, 20.0], "bandpass", fs=RATE, output="sos")
        ground = level * signal.sosfilt(band, rng.standard_normal((2, size))) * signal.windows.tukey(size, 0.4)
        acting = np.kron(np.ones((floors, 1)), np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]))
        omega = 2.0 * np.pi * np.fft.rfftfreq(size, 1.0 / RATE)
        modal = -(shapes.T @ inertia @ acting) @ np.fft.rfft(ground)
        modal /= squared[:, None] - omega**2 + 0.03j * np.sqrt(squared)[:, None] * omega
        moved = np.fft.irfft(-(omega**2) * (shapes @ modal), size, axis=1) + acting @ ground
        channels = {"ground_acceleration_x": ground[0], "ground_acceleration_y": ground[1]}
        for k in range(floors):
            x, y, turn = moved[3 * k : 3 * k + 3]
            for sensor, (right, up) in POSITIONS.items():
                seen = x - up * turn if sensor == "x" else y + right * turn
                channels[f"floor_acceleration_{k + 1}_{sensor}"] = seen
        channels = {key: item + 0.005 * rng.standard_normal(size) for key, item in channels.items()}
        tests.append(Recording(name, role, RATE, np.arange(size) / RATE, channels, ((0, size),), "random", {}))
    declared = {"frame": {"sensor_positions_m": POSITIONS}}
    return Campaign("eccentric", "shear-frame", Path(), tuple(tests), floor_masses_kg=tuple(masses), declared=declared)


BUMPED_FLOOR, GAP_M, BUMPER_N_M = 4, 0.0025, 4.0e5
"""Floor of the wall that hits a bumper on one side, its clearance [m], and the stiffness of the bumper [N/m]."""


def bumped_wall(noise: float = 0.002) -> list[FrameRecord]:
    """Return records of a wall whose floor hits a bumper: two for training, one for validation.

    The linear wall is integrated exactly over steps in which ground and bumper act constantly.
    """
    rng, fine, n = np.random.default_rng(31), 5, FLOORS
    stiffness = stiffness_of("wall")
    squared, shapes = linalg.eigh(stiffness, np.diag(MASSES))
    damping = np.diag(MASSES) @ shapes @ np.diag(0.03 * np.sqrt(squared)) @ shapes.T @ np.diag(MASSES)
    inverse = np.diag(1.0 / MASSES)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
    inputs = np.zeros((2 * n, 2))
    inputs[n:, 0], inputs[n + BUMPED_FLOOR - 1, 1] = -1.0, -1.0 / MASSES[BUMPED_FLOOR - 1]
    whole = linalg.expm(np.block([[state, inputs], [np.zeros((2, 2 * n + 2))]]) / (RATE * fine))
    found = []
    for name, role, level in (("a", "training", 0.5), ("b", "training", 0.9), ("c", "validation", 0.7)):
        size = int(30.0 * RATE)
        band = signal.butter(4, [1.0, 35.0], "bandpass", fs=RATE * fine, output="sos")
        ground = level * signal.sosfilt(band, rng.standard_normal(size * fine)) * signal.windows.tukey(size * fine, 0.4)
        moved, z = np.zeros((size, n)), np.zeros(2 * n)
        for k, acceleration in enumerate(ground):
            force = BUMPER_N_M * max(z[BUMPED_FLOOR - 1] - GAP_M, 0.0)
            if k % fine == 0:
                moved[k // fine] = state[n:] @ z + inputs[n:, 1] * force
            z = whole[: 2 * n, : 2 * n] @ z + whole[: 2 * n, 2 * n :] @ (acceleration, force)
        seen = ground[::fine] + noise * rng.standard_normal(size)
        found.append(
            FrameRecord(name, role, "random", RATE, seen, moved + noise * rng.standard_normal((size, n)), {}, {}, {})
        )
    return found
