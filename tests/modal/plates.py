"""Virtual buildings whose floors are plates that move in two directions and turn, under ground motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrpipe.modal.records import FrameTest, FrameTests, Place
from tests.modal.towers import Tower, respond

COLUMNS = ((-9.0, -6.0), (9.0, -6.0), (-9.0, 6.0), (9.0, 6.0))
"""Positions of the columns of every storey [m]."""
SENSORS = {"x": (0.0, 4.0), "y1": (-8.0, 0.0), "y2": (8.0, 0.0)}
"""Directions and positions of the sensors of a floor [m]."""


def building(rng, floors):
    """Return a building with random masses and column stiffnesses, so that all motions are coupled."""
    stiffness, mass = np.zeros((3 * floors, 3 * floors)), []
    for floor in range(floors):
        plate = rng.uniform(60e3, 100e3)
        mass += [plate, plate, plate * rng.uniform(50.0, 80.0)]
        storey = np.zeros((3, 3))
        for px, py in COLUMNS:
            for row in ((1.0, 0.0, -py), (0.0, 1.0, px)):
                storey += rng.uniform(4.5e6, 9.9e6) * np.outer(row, row)
        own, below = slice(3 * floor, 3 * floor + 3), slice(3 * floor - 3, 3 * floor)
        stiffness[own, own] += storey
        if floor:
            stiffness[below, below] += storey
            stiffness[own, below] -= storey
            stiffness[below, own] -= storey
    return Tower(np.array(mass), stiffness, rng.uniform(0.006, 0.018, 3 * floors))


def shaken(tower, rng, rate, duration_s, noise=0.02):
    """Return a test under ground motion in both directions; the sensors of each floor have no declared positions."""
    floors, dt = tower.mass.size // 3, 1.0 / (4.0 * rate)
    # constant over two samples of the records, so that little motion lies beyond their band
    ground = np.repeat(rng.standard_normal((int(duration_s * rate / 2.0), 2)), 8, axis=0)
    axes = np.array([np.tile([1.0, 0.0, 0.0], floors), np.tile([0.0, 1.0, 0.0], floors)])
    rows = np.zeros((floors * len(SENSORS), 3 * floors))
    for floor in range(floors):
        for index, (name, (px, py)) in enumerate(SENSORS.items()):
            motion = (1.0, 0.0, -py) if name.startswith("x") else (0.0, 1.0, px)
            rows[len(SENSORS) * floor + index, 3 * floor : 3 * floor + 3] = motion
    seen = ((respond(tower, -(ground @ (axes * tower.mass)), dt) + ground @ axes) @ rows.T)[::4]
    seen = seen + noise * seen.std(axis=0) * rng.standard_normal(seen.shape)
    x, y = ground[::4].T
    places = tuple(Place(floor, name) for floor in range(1, floors + 1) for name in SENSORS)
    test = FrameTest(
        "quake", "random", rate, x, seen, (False,) * len(places), direction="x", places=places,
        further_inputs=((Place(0, "y"), y),),
    )  # fmt: skip
    return FrameTests((test,), (), np.full(floors, np.nan), Path("plates"))
