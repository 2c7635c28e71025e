"""A small rig of the tests' own: a Bouc-Wen damper with a shape of effect that no file of the library holds."""

from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.signals.prepared import PreparedTest

RATE = 500.0


@njit
def hysteresis(x: np.ndarray, yield_displacement: float) -> np.ndarray:
    """Integrate dz/dx = (1 - z |z| sign) / x_y in fine Euler steps: another route than the library's closed form."""
    z = np.zeros(len(x))
    for index in range(1, len(x)):
        step = (x[index] - x[index - 1]) / 20.0
        value = z[index - 1]
        for _ in range(20):
            value += (step - 0.5 * abs(step) * value * abs(value) - 0.5 * step * value * value) / yield_displacement
        z[index] = value
    return z


@njit
def dahl(x: np.ndarray, yield_displacement: float) -> np.ndarray:
    """Integrate dz/dx = (1 - z sign) / x_y in fine Euler steps."""
    z = np.zeros(len(x))
    for index in range(1, len(x)):
        step = (x[index] - x[index - 1]) / 20.0
        value = z[index - 1]
        for _ in range(20):
            value += (step - abs(step) * value) / yield_displacement
        z[index] = value
    return z


@njit
def play(x: np.ndarray, gap: float) -> np.ndarray:
    y = np.empty_like(x)
    y[0] = x[0]
    for index in range(1, len(x)):
        y[index] = min(max(y[index - 1], x[index] - gap / 2), x[index] + gap / 2)
    return y


def force_of(x: np.ndarray, v: np.ndarray, a: np.ndarray, i: np.ndarray, t: np.ndarray, effect: str) -> np.ndarray:
    """Return the true force: lag 100 1/s, quadratic in current, and one effect in a form of its own."""
    dt = 1.0 / RATE
    u = np.empty_like(i)
    u[0] = i[0]
    for k in range(1, len(i)):
        slope = (i[k] - i[k - 1]) / (100.0 * dt)
        u[k] = i[k] - slope + (u[k - 1] - i[k - 1] + slope) * np.exp(-100.0 * dt)
    planted = effect.split("+")
    if "remanence" in planted:
        memory = np.maximum.accumulate(u)
        u = u + 0.12 * np.sqrt(np.maximum(memory - u, 0.0) * 3.0)
    rod = play(x, 1.2e-4) if "backlash" in planted else x
    rod = play(x, 6e-4) if "wide-backlash" in planted else rod
    moved = v if rod is x else np.gradient(rod, dt)
    z = dahl(rod, 3.7e-4) if "dahl" in planted else hysteresis(rod, 3.7e-4)
    yield_force = 20.0 + 8.0 * u + 14.0 * u**2
    if "pinching" in planted:
        yield_force = yield_force * (1.0 - 0.25 / np.cosh(x / 2.2e-3))
    if "rounded" in planted:
        z = 0.2 * z + 0.8 * np.tanh(moved / 0.008)
    force = yield_force * z + (50.0 + 75.0 * u) * moved
    if "accumulator" in planted:
        force = force + 1400.0 * x * (1.0 + 4.0 * x)
    if "end-stop" in planted:
        force = force + 3e7 * np.maximum(x - 8.2e-3, 0.0) ** 2
    if "soft-stop" in planted:
        pressed = np.maximum(np.abs(x) - 7.5e-3, 0.0)
        force = force + 3e5 * pressed**1.5 * (np.sign(x) + 0.8 * v)
    if effect == "unknown-in-time":
        force = force + 8.0 * np.sin(2 * np.pi * 7.3 * t)
    if effect == "unknown-in-place":
        force = force + 9.0 * np.sin(2 * np.pi * x / 2.3e-3)
    return force


def campaign(effect: str, seed: int = 0) -> list[PreparedTest]:
    """Return a dozen training tests, a repeat of two, and four validation tests of other motions."""
    rng = np.random.default_rng(seed)
    plans = [
        ("training", "sine", 5, 1.0, 0.0), ("training", "sine", 10, 1.3, 2.0), ("training", "sine", 10, 0.6, 3.0),
        ("training", "triangle", 8, 0.5, 1.0), ("training", "triangle", 10, 1.0, 2.5),
        ("training", "sine", 6, 2.0, 1.5), ("training", "steps", 10, 0.8, 3.0), ("training", "steps", 6, 1.3, 2.0),
        ("training", "half-sine", 9, 1.1, 3.0), ("repeat", "sine", 10, 1.3, 2.0), ("repeat", "steps", 10, 0.8, 3.0),
        ("validation", "sine", 8, 0.9, 1.0), ("validation", "steps", 9, 1.1, 2.5),
        ("validation", "half-sine", 8, 1.4, 2.5), ("validation", "triangle", 7, 0.8, 2.0),
    ]  # fmt: skip
    tests = []
    t = np.arange(int(3.0 * RATE)) / RATE
    for number, (role, kind, amplitude, frequency, current) in enumerate(plans):
        phase = 2 * np.pi * frequency * t
        wave = np.sin(phase)
        if kind == "triangle":
            wave = sum((-1) ** k * np.sin((2 * k + 1) * phase) / (2 * k + 1) ** 2 for k in range(4)) * 8 / np.pi**2
        x = 1e-3 * amplitude * wave
        v = np.gradient(x, 1 / RATE)
        a = np.gradient(v, 1 / RATE)
        drive = np.full_like(t, current)
        if kind == "steps":
            drive = current * ((t / 0.37).astype(int) % 3) / 2.0
        if kind == "half-sine":
            drive = current * np.abs(np.sin(0.9 * phase + 0.4))
        force = force_of(x, v, a, drive, t, effect) + 0.5 * rng.standard_normal(len(t))
        measured = x + 4e-6 * rng.standard_normal(len(t))
        period = RATE / frequency
        cycles = np.round(np.arange(1, 3.0 * frequency) * period).astype(np.int64)
        tests.append(
            PreparedTest(
                f"{number:02d}-{kind}", role, RATE, t, x, v, a, drive, force, measured, force, cycles, "A", "periodic"
            )
        )
    return tests
