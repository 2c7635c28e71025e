"""Commanded motions and currents of a bench test on the fine clock, and how the servo distorts them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import gaussian_filter1d

from mrpipe.artifacts import FloatArray
from mrpipe.laboratory.options import CustomTest, Servo

MotionKind = Literal["sine", "triangle", "random", "earthquake", "dwell", "hold"]
CurrentKind = Literal["constant", "half-sine", "steps", "random"]


_ORDERED = CustomTest(name="")
"""Source of the defaults, so that tests and settings have the same ones."""


@dataclass(frozen=True)
class BenchTest:
    """Test of a plan.

    Attributes
    ----------
    name, role
        Name and role, as in campaign.yaml.
    motion
        `sine`, `triangle`, `random`, `earthquake`; `dwell` (a slow sine about several positions in turn); `hold`
        (a sine that pauses).
    amplitude_m
        Amplitude [m]; for random motions the largest displacement.
    frequency_hz
        Frequency of the motion [Hz]; for random motions the upper end of the band.
    current
        `constant`, `half-sine` (|sin|, at the frequency of the motion), `steps`, `random`.
    current_a
        Level, amplitude, or largest value of the current [A].
    duration_s
        Duration [s]; 0: that of `cycles` and the soft start.
    repeat_of
        Name of the test that this test repeats with the same command.
    pause_s
        Pause in the middle of the test (hold), or time between steps of the current [s].
    middle_m
        Position about which the test moves [m].
    later
        Whether the test was made after the others. Shares of effects then refer to the other tests.
    """

    name: str
    role: str
    motion: MotionKind
    amplitude_m: float
    frequency_hz: float
    current: CurrentKind = _ORDERED.current
    current_a: float = _ORDERED.current_a
    duration_s: float = 0.0
    repeat_of: str = _ORDERED.repeat_of
    pause_s: float = _ORDERED.pause_s
    middle_m: float = _ORDERED.middle_m
    later: bool = _ORDERED.later


def smooth_start(time: FloatArray, length: float) -> FloatArray:
    """Return a weight that rises from 0 to 1 over `length` seconds, twice differentiable."""
    s = np.clip(time / length, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def _harmonic(test: BenchTest, servo: Servo, time: FloatArray, rng: np.random.Generator) -> FloatArray:
    phase = rng.uniform(0.0, 2.0 * np.pi)
    angle = 2.0 * np.pi * test.frequency_hz * time + phase
    shape = 2.0 / np.pi * np.arcsin(np.sin(angle)) if test.motion == "triangle" else np.sin(angle)
    for order in (2, 3):
        share, shift = servo.harmonic_share * rng.standard_normal(), rng.uniform(0.0, 2.0 * np.pi)
        shape = shape + share * np.sin(order * angle + shift)
    return np.asarray(shape * test.amplitude_m * (1.0 + servo.amplitude_error * rng.standard_normal()))


def _band(time: FloatArray, low: float, high: float, rng: np.random.Generator, slope: float) -> FloatArray:
    """Return a sum of sines with random phases between two frequencies; spectrum f^-slope, largest value 1."""
    length = float(time[-1] - time[0])
    count = int(np.clip((high - low) * length * 1.5, 12, 90))
    frequencies = np.sort(rng.uniform(low, high, count))
    phases = rng.uniform(0.0, 2.0 * np.pi, count)
    total = np.zeros_like(time)
    for frequency, phase in zip(frequencies, phases, strict=True):
        total += frequency**-slope * np.sin(2.0 * np.pi * frequency * time + phase)
    return np.asarray(total / np.abs(total).max())


def displacement_of(test: BenchTest, servo: Servo, time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the motion of the actuator [m] on the fine clock, shape (n,)."""
    start = smooth_start(time, min(1.25 / test.frequency_hz, 0.2 * float(time[-1])))
    if test.motion in ("sine", "triangle"):
        x = _harmonic(test, servo, time, rng)
    elif test.motion == "random":
        x = test.amplitude_m * _band(time, 0.15, test.frequency_hz, rng, 0.8)
    elif test.motion == "earthquake":
        envelope = (time / (0.2 * time[-1])) ** 2 * np.exp(2.0 * (1.0 - time / (0.2 * time[-1])))
        raw = np.minimum(envelope, 1.0) * _band(time, 0.4, test.frequency_hz, rng, 1.2)
        x = test.amplitude_m * raw / np.abs(raw).max()
    elif test.motion == "dwell":
        places = np.array([-0.6, 0.6, 0.0, -0.3, 0.3]) * test.amplitude_m
        step = places[np.minimum((time / time[-1] * places.size).astype(int), places.size - 1)]
        fine = float(time[1] - time[0])
        x = gaussian_filter1d(step, 0.15 / fine, mode="nearest")
        x = x + 0.3 * test.amplitude_m * np.sin(2.0 * np.pi * test.frequency_hz * time)
    else:
        moving = np.ones_like(time)
        moving[np.abs(time - 0.55 * time[-1]) < 0.5 * test.pause_s] = 0.0
        fine = float(time[1] - time[0])
        speed = gaussian_filter1d(moving, 0.05 / fine, mode="nearest")
        angle = 2.0 * np.pi * test.frequency_hz * np.cumsum(speed) * fine
        x = test.amplitude_m * np.sin(angle + rng.uniform(0.0, 2.0 * np.pi))
    fine = float(time[1] - time[0])
    return np.asarray(gaussian_filter1d((x + test.middle_m) * start, servo.smoothing_s / fine, mode="nearest"))


def current_of(
    test: BenchTest, time: FloatArray, velocity: FloatArray, phase_spread: float, rng: np.random.Generator
) -> FloatArray:
    """Return the coil current [A] on the fine clock; the phase of |sin| is drawn about that of the velocity."""
    if test.current == "constant":
        return np.full(time.size, test.current_a)
    if test.current == "half-sine":
        middle = time >= 0.5 * time[-1]
        turn = np.exp(-2j * np.pi * test.frequency_hz * time[middle])
        # the phase of the velocity: |sin| then follows |v|, as an emulated viscous damper's current does
        phase = float(np.angle(np.sum(velocity[middle] * turn))) + 0.5 * np.pi
        phase += rng.uniform(-phase_spread, phase_spread)
        return np.asarray(test.current_a * np.abs(np.sin(2.0 * np.pi * test.frequency_hz * time + phase)))
    fine = float(time[1] - time[0])
    if test.current == "steps":
        count = int(np.ceil(time[-1] / test.pause_s)) + 1
        levels = rng.uniform(0.0, 1.0, count)
        # at least one step to 0 and one to the largest current, so that residual and peak force are recorded
        levels[count // 3], levels[count // 3 - 1] = 0.0, 1.0
        edges = (np.arange(count) + rng.uniform(-0.25, 0.25, count)) * test.pause_s
        index = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, count - 1)
        return np.asarray(gaussian_filter1d(test.current_a * levels[index], 0.0008 / fine, mode="nearest"))
    wave = _band(time, 0.2, 3.0, rng, 0.5)
    return np.asarray(test.current_a * np.clip(0.45 + 0.75 * wave, 0.0, 1.0))
