"""Linear towers of six floors that shear, bend or both, shaken at the ground: responses by modal superposition."""

from __future__ import annotations

import numpy as np
from scipy import linalg, signal

from mrpipe.artifacts import FloatArray
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
    for name, role, seconds, level in (
        ("a", "training", 40.0, 0.5),
        ("b", "training", 40.0, 0.8),
        ("c", "validation", 30.0, 0.6),
    ):
        size = int(seconds * RATE)
        band = signal.butter(4, [1.0, 30.0], "bandpass", fs=RATE, output="sos")
        ground = level * signal.sosfilt(band, rng.standard_normal(size)) * signal.windows.tukey(size, 0.4)
        omega = 2.0 * np.pi * np.fft.rfftfreq(size, 1.0 / RATE)[:, None]
        modal = -(shapes.T @ MASSES) / (squared - omega**2 + 2j * 0.015 * np.sqrt(squared) * omega)
        relative = -(omega**2) * modal * np.fft.rfft(ground)[:, None] @ shapes.T
        absolute = np.fft.irfft(relative, size, axis=0) + ground[:, None]
        seen = ground + noise * rng.standard_normal(size)
        moved = absolute + noise * rng.standard_normal((size, FLOORS))
        found.append(FrameRecord(name, role, "random", RATE, seen, moved, {}, {}, {}))
    return found
