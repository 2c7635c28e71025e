"""A sound campaign of a hysteretic damper as arrays, into which faults are planted."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

from mrpipe.campaigns.plausibility import TestArrays

RATE = 1000.0


def hysteretic_force(
    displacement: np.ndarray, velocity: np.ndarray, drive: float | np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the force [N] of a Bouc-Wen element with a yield force that grows with the drive, and viscous damping."""
    element, elements = 0.0, []
    for step in (np.diff(displacement, prepend=displacement[0]) / 1e-3).tolist():
        element += step * (1.0 - element**2 * (element * step > 0.0))
        element = min(max(element, -1.0), 1.0)
        elements.append(element)
    force = (20.0 + 80.0 * drive) * np.asarray(elements) + (150.0 + 80.0 * drive) * velocity + 200.0 * displacement
    return force + 0.5 * rng.standard_normal(displacement.size)


def sound_tests(count: int = 10, *, seed: int = 0, random: bool = False) -> list[TestArrays]:
    """Return tests of four drives, two strokes and two frequencies; every third one is a validation test."""
    rng = np.random.default_rng(seed)
    time = np.arange(4000) / RATE
    tests = []
    for index in range(count):
        drive, amplitude, frequency = (
            0.5 * (index % 4),
            (5e-3, 8e-3)[(index // 4) % 2],
            (1.0, 1.0, 2.0)[(index // 4) % 3],
        )
        if random:
            band = butter(2, [0.5, 2.0 * frequency], "bandpass", fs=RATE, output="sos")
            noise = sosfiltfilt(band, rng.standard_normal(time.size))
            displacement = noise / np.std(noise) * 0.5 * amplitude
        else:
            displacement = amplitude * np.sin(2.0 * np.pi * frequency * time)
        force = hysteretic_force(displacement, np.gradient(displacement, time), drive, rng)
        tests.append(
            TestArrays(
                name=f"T{index}",
                time_s=time,
                displacement_m=displacement + 1e-5 * rng.standard_normal(time.size),
                drive=drive + 3e-3 * rng.standard_normal(time.size),
                force_n=force,
                role="training" if index % 3 else "validation",
            )
        )
    return tests
