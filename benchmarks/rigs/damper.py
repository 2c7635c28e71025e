"""A rig: a damper of one base form with planted effects, its answer to a motion, and the strength of its effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from benchmarks.rigs import effects as fx
from benchmarks.rigs.bases import BASES, draw_parameters
from benchmarks.rigs.effects import Planted, Scales
from benchmarks.rigs.kernel import LINEAR, POLYNOMIAL, SATURATING, integrate
from benchmarks.rigs.motion import Motion
from benchmarks.rigs.types import Array, Table

RECORD_CODES = range(fx.OFFSET_TEST, fx.SKEW_FILTER + 1)
"""Effects that act on whole records."""


@dataclass(frozen=True)
class Rig:
    """A damper on its bench.

    Attributes
    ----------
    base, numbers
        Base form and its numbers, shape (6,).
    yield_law, viscous_law
        Laws of the drive, see :mod:`benchmarks.rigs.kernel`.
    lag_s
        Time constant of the drive [s].
    scales, frequency_hz
        Largest values of the motion and drive; frequency that the tests are multiples of.
    planted
        Effects.
    """

    base: str
    numbers: Array
    yield_law: Array
    viscous_law: Array
    lag_s: float
    scales: Scales
    frequency_hz: float
    planted: tuple[Planted, ...] = ()

    def described(self) -> Table:
        """Return the rig as plain values."""
        return {
            "base": self.base, "numbers": self.numbers.tolist(), "yield_law": self.yield_law.tolist(),
            "viscous_law": self.viscous_law.tolist(), "lag_s": self.lag_s, "stroke_m": self.scales.stroke,
            "speed_m_s": self.scales.speed, "yield_force_n": self.scales.force, "drive": self.scales.drive,
            "frequency_hz": self.frequency_hz,
        }  # fmt: skip


def draw_rig(base: str, names: Sequence[str], rng: np.random.Generator, test_s: float) -> Rig:
    """Draw a rig: force from 100 N to 1 MN, stroke from 4 to 60 mm, drive from 1 to 5 A."""
    force = float(np.exp(rng.uniform(np.log(100.0), np.log(1e6))))
    stroke = float(np.exp(rng.uniform(np.log(0.004), np.log(0.06))))
    frequency = float(rng.uniform(1.0, 2.0))
    speed = 2.0 * np.pi * 1.8 * frequency * stroke
    drive = float(rng.uniform(1.0, 5.0))
    idle = force * rng.uniform(0.08, 0.25)
    # the knee of a saturated driver can only be seen where the damper's own law does not bend
    kind = LINEAR if "saturation" in names else int(rng.integers(3))
    bend = {LINEAR: 0.0, SATURATING: rng.uniform(0.6, 1.2), POLYNOMIAL: rng.uniform(-0.3, 0.6)}[kind]
    full = force * rng.uniform(0.1, 0.4) / speed
    share = rng.uniform(0.3, 0.8)
    scales = Scales(stroke, speed, force, drive, test_s)
    return Rig(
        base,
        draw_parameters(base, rng, stroke=stroke, speed=speed, force=force),
        np.array([kind, idle, force - idle, drive, bend]),
        np.array([full * share, full * (1.0 - share), drive]),
        float(rng.uniform(0.004, 0.03)),
        scales,
        frequency,
        tuple(fx.draw_effect(name, scales, rng) for name in names),
    )


def _lagged(values: Array, time_constant: float, step: float) -> Array:
    """Return the answer of a first-order lag that has settled at the first value."""
    keep = np.exp(-step / max(time_constant, 1e-9))
    result, _ = signal.lfilter([1.0 - keep], [1.0, -keep], values, zi=np.array([keep * values[0]]))
    return np.asarray(result)


def _late(values: Array, time_s: float, step: float) -> Array:
    time = np.arange(values.size) * step
    return np.interp(time - time_s, time, values)


def drive_of(rig: Rig, command: Array, step: float) -> Array:
    """Return the lagged drive: driver, dead time, lags."""
    u = command
    for item in rig.planted:
        n = item.numbers
        if item.code == fx.SATURATION and n[0] > 0.0:
            limit = n[2] - n[0]
            u = u / (1.0 + (np.maximum(u, 0.0) / limit) ** n[1]) ** (1.0 / n[1])
        elif item.code == fx.DELAY_CASCADE:
            for _ in range(3):
                u = _lagged(u, n[0] / 3.0, step)
        elif item.code == fx.DELAY_DEAD:
            u = _lagged(_late(u, n[0] * (1.0 - n[1]), step), n[0] * n[1], step)
    return _lagged(u, rig.lag_s, step)


def _at_load_cell(rig: Rig, force: Array, motion: Motion, draw: float) -> Array:
    """Return the force as its channel gives it; `draw` is the test's own standard normal number."""
    time = np.arange(force.size) * motion.step_s
    for item in rig.planted:
        n = item.numbers
        if item.code == fx.OFFSET_TEST:
            force = force + n[0] * draw
        elif item.code == fx.OFFSET_DRIVE:
            force = force + n[0] * (np.maximum(motion.drive, 0.0) / n[2]) ** n[1]
        elif item.code == fx.OFFSET_WARMING:
            force = force + n[0] * (1.0 - np.exp(-time / n[1]))
        elif item.code == fx.SKEW_SHIFT:
            force = _late(force, n[0], motion.step_s)
        elif item.code == fx.SKEW_FILTER and n[0] > 4.0 * motion.step_s:
            # an amplifier of second order that delays low frequencies by n[0]
            corner = np.sqrt(2.0) / n[0] / (2.0 * np.pi)
            b, a = signal.butter(2, corner, fs=1.0 / motion.step_s)
            force = signal.lfilter(b, a, force, zi=signal.lfilter_zi(b, a) * force[0])[0]
    return force


def respond(rig: Rig, motion: Motion, draw: float = 0.0) -> Array:
    """Return the force at the load cell [N], shape (n,), without noise."""
    within = [item for item in rig.planted if item.code not in RECORD_CODES]
    codes = np.array([item.code for item in within], dtype=np.int64)
    values = np.array([item.numbers for item in within]).reshape(len(within), fx.NUMBERS)
    force = integrate(
        BASES.index(rig.base), rig.numbers, rig.yield_law, rig.viscous_law, codes, values, 5e-3 * rig.scales.speed,
        motion.x, motion.v, motion.a, drive_of(rig, motion.drive, motion.step_s), motion.step_s,
    )  # fmt: skip
    return _at_load_cell(rig, force, motion, draw)


def offset_draws(count: int, seed: int) -> Array:
    """Return each test's own number: the shift of its zero in standard deviations."""
    return np.random.default_rng([seed, 5]).standard_normal(count)


def share_of(rig: Rig, place: int, motions: Sequence[Motion], draws: Array) -> float:
    """Return the RMS of what one effect changes over the RMS of the force without it."""
    return _share(rig, _without(rig, place, motions, draws), motions, draws)


def _without(rig: Rig, place: int, motions: Sequence[Motion], draws: Array) -> list[Array]:
    less = replace(rig, planted=rig.planted[:place] + rig.planted[place + 1 :])
    return [respond(less, motion, draw) for motion, draw in zip(motions, draws, strict=True)]


def _share(rig: Rig, reference: Sequence[Array], motions: Sequence[Motion], draws: Array) -> float:
    changed = sum(
        float(np.sum((respond(rig, motion, draw) - force) ** 2))
        for motion, draw, force in zip(motions, draws, reference, strict=True)
    )
    return float(np.sqrt(changed / sum(float(np.sum(force**2)) for force in reference)))


def scaled(rig: Rig, place: int, share: float, motions: Sequence[Motion], draws: Array) -> Rig:
    """Return the rig with the strength of one effect such that it reaches a share of the force, as far as it can."""
    item = rig.planted[place]
    reference = _without(rig, place, motions, draws)

    def at(strength: float) -> Rig:
        return replace(rig, planted=(*rig.planted[:place], item.with_strength(strength), *rig.planted[place + 1 :]))

    low, high, strength = 0.0, item.strongest, min(float(item.numbers[0]), item.strongest)
    for attempt in range(20):
        reached = _share(at(strength), reference, motions, draws)
        if abs(reached / share - 1.0) < 0.02 or low > 0.995 * item.strongest:
            break
        if reached < share:
            low = strength
        else:
            high = strength
        guess = strength * float(np.clip(share / max(reached, 1e-9), 0.1, 10.0))
        # in proportion first, because most shares are; then by halves
        strength = guess if low < guess < high and attempt < 6 else 0.5 * (low + high)
    return at(min(strength, item.strongest))
