"""A small noise-free bench for these tests: Bouc-Wen hysteresis (n = 2, gamma = beta) in its closed form."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.networks.assembly import History, join
from mrpipe.signals.prepared import PreparedTest

RATE = 1000.0


def force_of(displacement: FloatArray, velocity: FloatArray, current: FloatArray) -> FloatArray:
    """Damper set C without driver lag: hysteresis advanced exactly in displacement."""
    limit = np.sqrt(3000.0 / 2460.0)
    stiffness = 3000.0 / limit
    hysteresis = np.zeros(len(displacement))
    for index in range(1, len(displacement)):
        step = displacement[index] - displacement[index - 1]
        before = hysteresis[index - 1]
        if before * step < 0.0:
            linear = before + stiffness * step
            if linear * before > 0.0:
                hysteresis[index] = linear
                continue
            step -= np.sign(step) * min(abs(step), abs(before) / stiffness)
            before = 0.0
        bounded = np.clip(before, -1.0 + 1e-12, 1.0 - 1e-12)
        hysteresis[index] = np.tanh(np.arctanh(bounded) + stiffness * step)
    yielding = 19.92 + 5.03 * current + 20.03 * current**2 - 1.785 * current**3
    return yielding * limit * hysteresis + (50.0 + 75.0 * current) * velocity


def bench_test(
    name: str, frequency: float, current: float, *, half_sine: bool = False, role: str = "training", cycles: int = 3
) -> PreparedTest:
    """One periodic test of 5 mm."""
    time = np.arange(round((cycles + 1.5) / frequency * RATE)) / RATE
    phase = 2.0 * np.pi * frequency * time
    displacement = 5e-3 * np.sin(phase)
    velocity = 5e-3 * 2.0 * np.pi * frequency * np.cos(phase)
    drive = current * np.abs(np.cos(phase)) if half_sine else np.full(len(time), current)
    force = force_of(displacement, velocity, drive)
    ups = np.flatnonzero((displacement[:-1] <= 0.0) & (displacement[1:] > 0.0)) + 1
    return PreparedTest(
        name=name,
        role=role,
        sampling_rate_hz=RATE,
        time_s=time,
        displacement_m=displacement,
        velocity_m_s=velocity,
        acceleration_m_s2=-((2.0 * np.pi * frequency) ** 2) * displacement,
        drive=drive,
        force_n=force,
        displacement_raw_m=displacement,
        force_raw_n=force,
        cycles=ups.astype(np.int64),
        drive_unit="A",
    )


def bench_tests(role: str = "training", frequencies: tuple[float, ...] = (1.0, 1.8)) -> list[PreparedTest]:
    """Constant and half-sine current at a few frequencies."""
    return [
        bench_test(f"{kind}-{current:g}A-{frequency:g}Hz", frequency, current, half_sine=kind == "half", role=role)
        for kind in ("constant", "half")
        for current in (0.0, 2.0, 4.0)
        for frequency in frequencies
    ]


def bench_history(role: str = "training", frequencies: tuple[float, ...] = (1.0, 1.8)) -> History:
    """The same, joined at 200 Hz."""
    return join(bench_tests(role, frequencies), cycles=3, sampling_rate_hz=200.0)
