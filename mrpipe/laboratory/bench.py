"""The bench of the virtual rig: servo, damper, sensors; one campaign from a plan."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns import TestFile
from mrpipe.laboratory.damper import (
    FineMotion,
    FineResponse,
    TrueDamper,
    calibrate_strength,
    effect_share,
    respond,
)
from mrpipe.laboratory.motion import BenchTest, current_of, displacement_of
from mrpipe.laboratory.options import BenchRig

CHANNELS = {
    "displacement": ("x", "mm"),
    "acceleration": ("a", "m/s^2"),
    "drive": ("i", "A"),
    "force": ("F", "N"),
}
_KNOCK_FREQUENCY_HZ, _KNOCK_DECAY_S, _KNOCK_SHARE = 145.0, 0.008, 0.25
_CALIBRATION_TESTS = 24
_CALIBRATION_SAMPLES = 1_500_000


@dataclass(frozen=True)
class BenchRecord:
    """Recorded campaign and its truth, before they are written."""

    tests: list[TestFile]
    truth: dict[str, Any]
    damper: TrueDamper


def fine_motion(test: BenchTest, rig: BenchRig, seed: int) -> FineMotion:
    """Return the motion of the machine in a test; a test and its repeat have the same command."""
    key = zlib.crc32((test.repeat_of or test.name).encode())
    rng = np.random.default_rng([seed, key])
    step = 1.0 / (rig.sampling_rate_hz * rig.fine_steps)
    samples = round(test.duration_s * rig.sampling_rate_hz)
    time = np.arange(samples * rig.fine_steps, dtype=np.float64) * step
    x = displacement_of(test, rig.servo, time, rng)
    v = np.asarray(np.gradient(x, step), dtype=np.float64)
    current = current_of(test, time, v, rig.current_phase_spread_rad, rng)
    own = np.random.default_rng([seed, zlib.crc32(test.name.encode()), 7])
    return FineMotion(test.name, test.role, step, x, v, np.gradient(v, step), current, float(own.standard_normal()))


def noise(size: int, deviation: float, colour: str, rate_hz: float, rng: np.random.Generator) -> FloatArray:
    """Return noise of a standard deviation, shape (size,)."""
    white = rng.standard_normal(size)
    if colour == "white":
        return deviation * white
    keep = float(np.exp(-2.0 * np.pi * 8.0 / rate_hz))
    start = rng.standard_normal() * keep
    shaped, _ = signal.lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, zi=np.array([start]))
    return np.asarray(deviation * shaped)


def _knocks(response: FineResponse, step: float) -> FloatArray:
    """Return the ringing acceleration that each closure of the play excites [m/s2], on the fine clock."""
    if not np.any(response.knock):
        return np.zeros(response.force.size)
    time = np.arange(0.0, 6.0 * _KNOCK_DECAY_S, step)
    ring = np.exp(-time / _KNOCK_DECAY_S) * np.sin(2.0 * np.pi * _KNOCK_FREQUENCY_HZ * time)
    pulses = response.knock * _KNOCK_SHARE * 2.0 * np.pi * _KNOCK_FREQUENCY_HZ
    return np.asarray(signal.fftconvolve(pulses, ring)[: pulses.size])


def _recorded(
    test: BenchTest,
    motion: FineMotion,
    response: FineResponse,
    rig: BenchRig,
    offsets: FloatArray,
    rng: np.random.Generator,
) -> tuple[TestFile, float]:
    sensors, every = rig.sensors, rig.fine_steps
    truth = {
        "displacement": motion.displacement[::every],
        "acceleration": (motion.acceleration + _knocks(response, motion.step_s))[::every],
        "drive": motion.current[::every],
        "force": response.force[::every],
    }
    deviations = (
        sensors.displacement_noise_m,
        sensors.acceleration_noise_m_s2,
        sensors.current_noise_a,
        sensors.force_noise_n,
    )
    columns, disturbed = {}, 0.0
    for (quantity, exact), deviation, offset in zip(truth.items(), deviations, offsets, strict=True):
        error = noise(exact.size, deviation, sensors.colour, rig.sampling_rate_hz, rng)
        if quantity == "force":
            disturbed = float(np.sum(error**2))
        scale = 1e3 if quantity == "displacement" else 1.0
        columns[CHANNELS[quantity][0]] = scale * (exact + offset + error)
    about = {"excitation": test.motion, "current": test.current, "current_a": test.current_a}
    details: dict[str, Any] = {"frequency_hz": test.frequency_hz, "amplitude_m": test.amplitude_m, "about": about}
    if test.repeat_of:
        details["repeat_of"] = test.repeat_of
    return TestFile(test.name, test.role, columns, details), disturbed


def _spread(motions: Sequence[FineMotion], count: int) -> list[FineMotion]:
    training = [motion for motion in motions if motion.role != "validation"] or list(motions)
    # a stride that shares no factor with the five frequencies of Table 2.1
    places = np.unique(np.linspace(0, len(training) - 1, min(count, len(training))).round().astype(int))
    return [training[place] for place in places]


def record_bench(
    damper: TrueDamper,
    tests: Sequence[BenchTest],
    rig: BenchRig,
    rng: np.random.Generator,
    progress: Progress = no_progress,
    jobs: int = 1,
) -> BenchRecord:
    """Record a campaign.

    Parameters
    ----------
    damper
        True damper. The strength of an effect with a `strength_share` is scaled so that the effect has this share on
        the training tests.
    tests
        Tests of the campaign.
    rig
        Servo, sensors, clock.
    rng
        Random generator; it gives one seed, from which the generators of all tests are derived.
    progress
        Called with the completed share and a text.
    jobs
        Number of threads; the result does not depend on it.

    Raises
    ------
    UserError
        If no strength gives the share of an effect.
    """
    seed = int(rng.integers(2**62))
    motions = [fine_motion(test, rig, seed) for test in tests]
    damper = calibrated(damper, _at_first(tests, motions))
    sensors = rig.sensors
    draw = np.random.default_rng([seed, 1]).standard_normal(4)
    offsets = draw * np.array(
        [
            sensors.displacement_offset_m,
            sensors.acceleration_offset_m_s2,
            sensors.current_offset_a,
            sensors.force_offset_n,
        ]
    )
    parts = _Shares(damper)

    def recorded(number: int) -> tuple[TestFile, float, float, FloatArray]:
        test, motion = tests[number], motions[number]
        response = respond(damper, motion)
        own = np.random.default_rng([seed, 2, number])
        file, error = _recorded(test, motion, response, rig, offsets, own)
        return file, error, float(np.sum(response.force[:: rig.fine_steps] ** 2)), parts.of(motion, response.force)

    files, disturbed, total = [], 0.0, 0.0
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        for test, (file, error, power, part) in zip(tests, pool.map(recorded, range(len(tests))), strict=True):
            files.append(file)
            parts.add(part)
            if test.role == "validation":
                disturbed += error
                total += power
            progress(len(files) / len(tests), test.name)
    truth = {
        "damper": damper.name,
        "parameters": damper.numbers(),
        "effects": [
            {**item.described(), "share_of_force_rms": share}
            for item, share in zip(damper.effects, parts.shares(), strict=True)
        ],
        "offsets": dict(zip(CHANNELS, offsets.tolist(), strict=True)),
        "noise_floor_nrmse": float(np.sqrt(disturbed / total)) if total > 0.0 else None,
        "seed": seed,
    }
    return BenchRecord(files, truth, damper)


def _at_first(tests: Sequence[BenchTest], motions: Sequence[FineMotion]) -> list[FineMotion]:
    """Return the motions to which shares of effects refer; later tests are excluded, so that the damper is the same."""
    first = [motion for test, motion in zip(tests, motions, strict=True) if not test.later]
    return first or list(motions)


class _Shares:
    """Share of each effect in the force, summed over the tests."""

    def __init__(self, damper: TrueDamper) -> None:
        effects = damper.effects
        self._without = [damper.with_effects(effects[:k] + effects[k + 1 :]) for k in range(len(effects))]
        self._sums = np.zeros((2, len(effects)))

    def of(self, motion: FineMotion, force: FloatArray) -> FloatArray:
        """Return sums over a test, whose force with all effects is `force`, for each effect, shape (2, effects).

        The sums are those of the squared change by the effect and of the squared force without it.
        """
        plain = [respond(damper, motion).force for damper in self._without]
        return np.array([[np.sum((force - item) ** 2) for item in plain], [np.sum(item**2) for item in plain]])

    def add(self, sums: FloatArray) -> None:
        """Add the sums of one test."""
        self._sums += sums

    def shares(self) -> list[float]:
        """Return the ratio of the RMS of each effect to the RMS of the force without it."""
        change, force = self._sums
        return [float(value) for value in np.sqrt(change / np.maximum(force, 1e-300))]


def calibrated(damper: TrueDamper, motions: Sequence[FineMotion]) -> TrueDamper:
    """Return the damper with the strengths of all effects that are given as shares, computed one after the other."""
    long = sum(motion.force_samples for motion in motions) > _CALIBRATION_SAMPLES
    some = _spread(motions, _CALIBRATION_TESTS) if long else list(motions)
    for index, effect in enumerate(damper.effects):
        wanted = effect.strength_share
        if wanted is None:
            continue
        asked = wanted
        for _ in range(3 if long else 1):
            damper = calibrate_strength(damper, index, some, share=asked)
            if long:
                # a part of the tests is simulated, with a target that gives the share over all tests
                asked *= wanted / effect_share(damper, index, motions)
                if abs(asked / wanted - 1.0) < 0.01:
                    break
    return damper


def calibrated_on(
    damper: TrueDamper, tests: Sequence[BenchTest], rig: BenchRig, rng: np.random.Generator
) -> TrueDamper:
    """Return the damper that :func:`record_bench` uses for the same arguments, without a recording."""
    if all(effect.strength_share is None for effect in damper.effects):
        return damper
    seed = int(rng.integers(2**62))
    first = [test for test in tests if not test.later] or tests
    return calibrated(damper, [fine_motion(test, rig, seed) for test in first])
