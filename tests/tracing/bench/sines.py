"""A small sound campaign of sines, exactly of the declared base form, and ways to harm single tests of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mrpipe.signals.prepared import PreparedTest
from tests.tracing.bench.rig import RATE, force_of

PLAN = (
    ("training", 6, 1.0, 0.0), ("training", 9, 1.5, 0.5), ("training", 8, 1.0, 1.0), ("training", 6, 2.0, 1.5),
    ("training", 9, 1.0, 1.5), ("training", 5, 1.5, 1.0), ("validation", 7, 1.2, 0.0), ("validation", 8, 1.4, 0.5),
    ("validation", 6, 1.7, 1.0), ("validation", 8, 1.1, 1.5),
)  # fmt: skip
"""Role, amplitude [mm], frequency [Hz] and current [A] of each test."""


def recorded(
    name: str, role: str, x: np.ndarray, current: float, seed: int, effect: str = "none", noise_n: float = 0.5
) -> PreparedTest:
    """Record one test of the rig with a motion [m] and a constant current [A]."""
    rng = np.random.default_rng(seed)
    t = np.arange(len(x)) / RATE
    v = np.gradient(x, 1 / RATE)
    a = np.gradient(v, 1 / RATE)
    drive = np.full_like(t, current)
    force = force_of(x, v, a, drive, t, effect) + noise_n * rng.standard_normal(len(t))
    measured = x + 1e-6 * rng.standard_normal(len(t))
    return PreparedTest(
        name, role, RATE, t, x, v, a, drive, force, measured, force, np.array([], dtype=np.int64), "A", "periodic"
    )


def sines(effect: str = "none", seconds: float = 3.0) -> list[PreparedTest]:
    """Return six training and four validation tests at four currents."""
    t = np.arange(int(seconds * RATE)) / RATE
    return [
        recorded(f"{k}-{role}", role, 1e-3 * amplitude * np.sin(2 * np.pi * frequency * t), current, k, effect)
        for k, (role, amplitude, frequency, current) in enumerate(PLAN)
    ]


def scaled(test: PreparedTest, factor: float) -> PreparedTest:
    """Return the test with its force multiplied."""
    return replace(test, force_n=factor * test.force_n, force_raw_n=factor * test.force_raw_n)


def late(test: PreparedTest, seconds: float) -> PreparedTest:
    """Return the test with its force recorded late."""
    shift = round(seconds * RATE)
    return replace(test, force_n=np.roll(test.force_n, shift), force_raw_n=np.roll(test.force_raw_n, shift))


def exchanged(test: PreparedTest) -> PreparedTest:
    """Return the test with the columns of force [N] and displacement [m] exchanged, at plausible magnitudes."""
    ratio = np.std(test.force_raw_n) / np.std(test.displacement_raw_m)
    force, x = ratio * test.displacement_raw_m, test.force_raw_n / ratio
    return replace(test, force_n=force, force_raw_n=force, displacement_m=x, displacement_raw_m=x)


def stuck(test: PreparedTest, seconds: float = 0.4) -> PreparedTest:
    """Return the test with its displacement stuck for a while in the middle."""
    begin, length = len(test.time_s) // 2, round(seconds * RATE)
    x = test.displacement_raw_m.copy()
    x[begin : begin + length] = x[begin]
    return replace(test, displacement_m=x, displacement_raw_m=x)


def cut(test: PreparedTest, seconds: float = 0.2) -> PreparedTest:
    """Return the test without a piece in its middle, the clock restamped."""
    begin, length = len(test.time_s) // 2, round(seconds * RATE)
    keep = np.r_[0:begin, begin + length : len(test.time_s)]
    names = [
        "displacement_m",
        "velocity_m_s",
        "acceleration_m_s2",
        "drive",
        "force_n",
        "displacement_raw_m",
        "force_raw_n",
    ]
    return replace(test, time_s=test.time_s[: len(keep)], **{name: getattr(test, name)[keep] for name in names})


def dead_load_cell(test: PreparedTest) -> PreparedTest:
    """Return the test with nothing but noise about 37 N as force."""
    force = 37.0 + 0.5 * np.random.default_rng(len(test.name)).standard_normal(len(test.force_n))
    return replace(test, force_n=force - 37.0, force_raw_n=force - 37.0, force_offset_n=37.0)


def harmed(
    tests: list[PreparedTest], places: tuple[int, ...], harm: Callable[[PreparedTest], PreparedTest]
) -> list[PreparedTest]:
    """Return the campaign with some of its tests harmed."""
    return [harm(test) if k in places else test for k, test in enumerate(tests)]
