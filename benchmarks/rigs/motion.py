"""What the machine of a rig does in a test: displacement of the rod and commanded drive on the fine clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.ndimage import gaussian_filter1d

from benchmarks.rigs.types import Array


@dataclass(frozen=True)
class Test:
    """A test of a rig.

    Attributes
    ----------
    motion
        `sine`, `triangle`, `random`, `earthquake`.
    amplitude, frequency
        In shares of the rig's stroke and of its frequency.
    drive
        `constant`, `steps`, `half-sine` or `random`.
    level
        Largest drive, as a share of the rig's largest drive.
    repeat_of
        Number of the test whose motion and drive this one repeats, or -1.
    """

    __test__ = False  # not a test case

    name: str
    role: str
    motion: str
    amplitude: float
    frequency: float
    drive: str
    level: float
    repeat_of: int = -1


@dataclass(frozen=True)
class Motion:
    """Displacement, speed, acceleration of the rod and commanded drive, each of shape (n,), SI."""

    test: Test
    step_s: float
    x: Array
    v: Array
    a: Array
    drive: Array


def _plan(rows: list[tuple[str, float, float, str, float]], role: str, first: int) -> list[Test]:
    return [
        Test(f"{first + k:02d}-{row[0]}-{row[3]}", role, *row)  # type: ignore[arg-type]
        for k, row in enumerate(rows)
    ]


SINES = [
    ("sine", 1.0, 1.0, "constant", 0.0),
    ("sine", 1.0, 1.0, "constant", 1.0),
    ("sine", 0.5, 1.0, "constant", 0.5),
    ("sine", 1.0, 1.8, "constant", 0.25),
    ("sine", 0.4, 2.0, "constant", 0.75),
    ("sine", 0.8, 0.5, "constant", 0.5),
    ("sine", 0.2, 1.0, "constant", 1.0),
    ("sine", 0.9, 1.4, "constant", 0.75),
]
CHANGING = [
    ("triangle", 0.9, 0.5, "constant", 0.25),
    ("triangle", 0.3, 0.6, "constant", 1.0),
    ("triangle", 1.0, 1.0, "constant", 0.5),
    ("sine", 1.0, 0.8, "steps", 1.0),
    ("sine", 0.6, 1.5, "steps", 0.75),
    ("triangle", 0.8, 0.7, "steps", 1.0),
    ("sine", 0.9, 1.2, "half-sine", 1.0),
]
RANDOM = [("random", 1.0, 1.0, "constant", 0.5), ("random", 0.9, 1.2, "steps", 1.0)]
UNLIKE = [
    ("random", 1.0, 1.0, "constant", 0.6),
    ("random", 0.9, 1.2, "random", 1.0),
    ("random", 0.7, 1.0, "steps", 0.9),
    ("triangle", 0.85, 0.8, "steps", 1.0),
    ("triangle", 0.6, 1.1, "constant", 0.4),
    ("earthquake", 1.0, 1.0, "constant", 0.8),
    ("earthquake", 0.9, 1.0, "random", 1.0),
]
ALIKE = [
    ("sine", 0.75, 1.2, "constant", 0.4),
    ("sine", 0.95, 0.9, "constant", 0.85),
    ("sine", 0.6, 1.7, "constant", 0.1),
    ("sine", 0.85, 1.0, "steps", 1.0),
    ("triangle", 0.7, 0.7, "constant", 0.6),
    ("triangle", 0.9, 0.6, "steps", 0.9),
    ("sine", 0.8, 1.3, "half-sine", 0.9),
]


def plan(training: str, validation: str, repeats: bool) -> list[Test]:
    """Return the tests of a campaign.

    Parameters
    ----------
    training
        `regular` (sines, triangles, steps of the drive) or `mixed` (random motion too).
    validation
        `unlike` the training (random motion, recorded-earthquake like, other levels) or `alike`.
    repeats
        Whether two of the training tests are made twice.
    """
    tests = _plan(SINES + CHANGING + (RANDOM if training == "mixed" else []), "training", 1)
    if repeats:
        for place in (1, 11):
            of = tests[place]
            tests.append(
                Test(
                    f"{len(tests) + 1:02d}-again",
                    "repeat",
                    of.motion,
                    of.amplitude,
                    of.frequency,
                    of.drive,
                    of.level,
                    place,
                )
            )
    return tests + _plan(UNLIKE if validation == "unlike" else ALIKE, "validation", len(tests) + 1)


def _random_wave(time: Array, low: float, high: float, rng: np.random.Generator) -> Array:
    """Return a sum of 48 sines of random phase between two frequencies [Hz], largest value 1."""
    frequencies = np.sort(rng.uniform(low, high, 48))
    phases = rng.uniform(0.0, 2.0 * np.pi, 48)
    weights = frequencies**-0.7
    wave = sum(w * np.sin(2.0 * np.pi * f * time + p) for f, p, w in zip(frequencies, phases, weights, strict=True))
    return np.asarray(wave / np.max(np.abs(wave)))


def _earthquake(time: Array, frequency: float, rng: np.random.Generator) -> Array:
    """Return noise through a filter after Kanai and Tajimi, in an envelope that rises, stays and fades."""
    h = time[1] - time[0]
    ground, damping = 2.0 * np.pi * 2.0 * frequency, 0.5
    shaped = signal.lsim(
        ([2.0 * damping * ground, ground**2], [1.0, 2.0 * damping * ground, ground**2]),
        rng.standard_normal(time.size), time,
    )[1]  # fmt: skip
    band = signal.butter(2, [0.4 * frequency, 4.0 * frequency], "bandpass", fs=1.0 / h, output="sos")
    shaped = signal.sosfiltfilt(band, shaped)
    s = time / time[-1]
    # without kinks: a kink of the envelope would be a blow of the machine
    shaped *= np.sin(0.5 * np.pi * np.minimum(s / 0.25, 1.0)) ** 2 / (1.0 + (np.maximum(s - 0.5, 0.0) / 0.2) ** 2)
    return np.asarray(shaped / np.max(np.abs(shaped)))


def displacement(test: Test, time: Array, *, stroke: float, speed: float, frequency: float,
                 rng: np.random.Generator) -> Array:  # fmt: skip
    """Return the displacement of the rod [m], shape (n,); its speed stays within that of the training."""
    h = time[1] - time[0]
    f = test.frequency * frequency
    phase = 2.0 * np.pi * f * time
    if test.motion == "sine":
        # the servo adds a little of the third harmonic
        wave = np.sin(phase) + rng.uniform(0.0, 0.02) * np.sin(3.0 * phase + rng.uniform(0.0, 6.0))
    elif test.motion == "triangle":
        wave = gaussian_filter1d(signal.sawtooth(phase + 0.5 * np.pi, 0.5), 0.02 / f / h, mode="nearest")
    elif test.motion == "random":
        wave = _random_wave(time, 0.3 * f, 3.0 * f, rng)
    else:
        wave = _earthquake(time, f, rng)
    ramp = np.clip(time * f / 0.5, 0.0, 1.0)
    x = stroke * test.amplitude * rng.uniform(0.97, 1.0) * wave * ramp**2 * (3.0 - 2.0 * ramp)
    fastest = float(np.max(np.abs(np.gradient(x, h))))
    return x if test.motion in ("sine", "triangle") else x * min(1.0, 0.95 * speed / fastest)


def commanded(test: Test, time: Array, largest: float, frequency: float, rng: np.random.Generator) -> Array:
    """Return the commanded drive, shape (n,)."""
    h = time[1] - time[0]
    top = largest * test.level
    if test.drive == "constant":
        return np.full(time.size, top)
    if test.drive == "half-sine":
        return np.asarray(top * np.abs(np.sin(2.0 * np.pi * test.frequency * frequency * time + rng.uniform(0, np.pi))))
    if test.drive == "steps":
        hold = rng.uniform(0.35, 0.6)
        levels = rng.uniform(0.0, 1.0, int(np.ceil(time[-1] / hold)) + 1)
        # the whole range is seen: a step to nothing after one to the largest, in each half of the test
        for place in (1, len(levels) // 2 + 1):
            levels[place], levels[place + 1] = 1.0, 0.0
        steps = top * levels[np.minimum((time / hold).astype(int), len(levels) - 1)]
        return np.asarray(gaussian_filter1d(steps, 0.0007 / h, mode="nearest"))
    return np.asarray(top * np.clip(0.5 + 0.7 * _random_wave(time, 0.2, 2.5, rng), 0.0, 1.0))


def motion_of(test: Test, number: int, seed: int, *, stroke: float, speed: float, frequency: float, drive: float,
              duration_s: float, step_s: float) -> Motion:  # fmt: skip
    """Return what the machine does in a test; a repeated test has the same command."""
    rng = np.random.default_rng([seed, 11, test.repeat_of if test.repeat_of >= 0 else number])
    time = np.arange(round(duration_s / step_s)) * step_s
    x = displacement(test, time, stroke=stroke, speed=speed, frequency=frequency, rng=rng)
    v = np.gradient(x, step_s)
    u = commanded(test, time, drive, frequency, rng)
    return Motion(test, step_s, x, v, np.gradient(v, step_s), u)
