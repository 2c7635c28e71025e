"""True damper: base parameters, planted effects, and the strength that gives an effect its share of the force."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray, IntArray, load_parameter_set
from mrpipe.errors import UserError
from mrpipe.laboratory.coefficient_effects import OFFSET_PER_TEST
from mrpipe.laboratory.effects import CHANNEL_SKEW_CONSTANT, SENSOR_CODES, Planted, packed
from mrpipe.laboratory.kernel import BASE, run_damper


@dataclass(frozen=True)
class TrueDamper:
    """Damper with its undeclared effects.

    Attributes
    ----------
    base
        Parameters in the order of :data:`~mrpipe.laboratory.kernel.BASE`, shape (11,), SI.
    effects
        Planted effects.
    name
        Name of the base set.
    """

    base: FloatArray
    effects: tuple[Planted, ...] = ()
    name: str = "set-c"

    def with_effects(self, effects: Sequence[Planted]) -> TrueDamper:
        """Return the damper with other effects."""
        return replace(self, effects=tuple(effects))

    def numbers(self) -> dict[str, float]:
        """Return the base parameters by name."""
        return dict(zip(BASE, self.base.tolist(), strict=True))


@dataclass(frozen=True)
class FineMotion:
    """Motion and current of one test on the fine clock, shape (n,), SI; `offset_draw` is drawn for each test."""

    name: str
    role: str
    step_s: float
    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    current: FloatArray
    offset_draw: float = 0.0

    @property
    def force_samples(self) -> int:
        """Number of fine samples."""
        return int(self.displacement.size)


@dataclass(frozen=True)
class FineResponse:
    """Force at the load cell and closures of the play, shape (n,)."""

    force: FloatArray
    knock: FloatArray


def damper_from_set(name: str) -> TrueDamper:
    """Return the damper of a parameter set in configs/dampers (or a YAML file), without effects.

    Raises
    ------
    UserError
        If the set is missing or is not a simplified Bouc-Wen set.
    """
    values = load_parameter_set("dampers", name)
    missing = [key for key in BASE if key not in values.values]
    if missing:
        raise UserError(f"damper {name}", f"parameters.{missing[0]}", "is missing", "a set of (2.1) to (2.4) expected")
    return TrueDamper(np.array([values.scalar(key) for key in BASE]), (), values.name)


def draw_damper(rng: np.random.Generator, around: TrueDamper, spread: float = 0.2) -> TrueDamper:
    """Return a damper whose parameters differ from those of another by random factors.

    All coefficients of alpha have the same factor, and n is not changed.
    """
    base = around.base.copy()
    base[:4] *= np.exp(spread * rng.standard_normal())
    base[4:6] *= np.exp(spread * rng.standard_normal(2))
    yielding = np.exp(0.5 * spread * rng.standard_normal())
    base[6:9] *= yielding
    tilt = 1.0 + 0.3 * spread * rng.standard_normal()
    base[7], base[8] = base[7] * tilt, base[8] * (2.0 - tilt)
    base[10] *= np.exp(spread * rng.standard_normal())
    return TrueDamper(base, around.effects, f"{around.name}, varied")


def packed_for(damper: TrueDamper, offset_draw: float) -> tuple[IntArray, FloatArray]:
    """Return codes (k,) and numbers (k, 8) of the effects for one test; `offset_draw` is the offset of this test."""
    codes, values = packed(damper.effects)
    for row in np.flatnonzero(codes == OFFSET_PER_TEST):
        values[row, 1] = offset_draw
    return codes, values


def respond(damper: TrueDamper, motion: FineMotion) -> FineResponse:
    """Return the response of the damper to a motion, without noise."""
    codes, values = packed_for(damper, motion.offset_draw)
    force, knock, _ = run_damper(
        damper.base,
        codes,
        values,
        motion.displacement,
        motion.velocity,
        motion.acceleration,
        motion.current,
        motion.step_s,
    )
    for item in damper.effects:
        if item.form.code in SENSOR_CODES:
            force = _skewed(force, item, motion.step_s)
    return FineResponse(force, knock)


def _skewed(force: FloatArray, effect: Planted, step_s: float) -> FloatArray:
    """Return the force as a delayed channel records it: with a pure delay, or with the filter of another amplifier."""
    if effect.strength <= 0.0:
        return force
    if effect.form.code == CHANNEL_SKEW_CONSTANT:
        time = np.arange(force.size) * step_s
        return np.asarray(np.interp(time - effect.strength, time, force))
    # a Bessel filter of order two delays low frequencies by norm / (2 pi f)
    b, a = signal.bessel(2, 1.0 / (2.0 * np.pi * effect.strength), norm="delay", fs=1.0 / step_s)
    start = signal.lfilter_zi(b, a) * force[0]
    return np.asarray(signal.lfilter(b, a, force, zi=start)[0])


def effect_share(damper: TrueDamper, index: int, motions: Sequence[FineMotion]) -> float:
    """Return the ratio of the RMS of an effect to the RMS of the force without it, pooled over tests."""
    without = damper.with_effects([item for place, item in enumerate(damper.effects) if place != index])
    return _share(damper, motions, [respond(without, motion).force for motion in motions])


def _share(damper: TrueDamper, motions: Sequence[FineMotion], reference: Sequence[FloatArray]) -> float:
    change = sum(
        float(np.sum((respond(damper, motion).force - force) ** 2))
        for motion, force in zip(motions, reference, strict=True)
    )
    return float(np.sqrt(change / sum(float(np.sum(force**2)) for force in reference)))


def calibrate_strength(
    damper: TrueDamper,
    index: int,
    motions: Sequence[FineMotion],
    *,
    share: float | None = None,
    tolerance: float = 0.01,
) -> TrueDamper:
    """Return the damper with the strength of one effect at which the effect has its share of the RMS force.

    Parameters
    ----------
    damper
        Damper with the effect, whose `strength_share` is the target.
    index
        Index of the effect.
    motions
        Motions of the tests over which the share is pooled.
    share
        Share of the force that the effect shall have; None: the `strength_share` of the effect.
    tolerance
        Relative tolerance of the share.

    Raises
    ------
    UserError
        If no strength gives the share on these tests.
    """
    effect = damper.effects[index]
    wanted = effect.strength_share if share is None else share
    if wanted is None:
        return damper
    others = list(damper.effects)
    without = damper.with_effects(others[:index] + others[index + 1 :])
    reference = [respond(without, motion).force for motion in motions]

    def share_of(strength: float) -> float:
        changed = damper.with_effects([*others[:index], effect.with_strength(strength), *others[index + 1 :]])
        return _share(changed, motions, reference)

    strength = solve_strength(share_of, wanted, abs(effect.strength), effect.form.strongest, tolerance)
    if strength is None:
        raise UserError(
            f"effect {effect.name} ({effect.form.form})",
            "strength_share",
            f"{wanted:g} cannot be reached on these tests",
            "choose a smaller share, or tests that excite the effect",
        )
    return damper.with_effects([*others[:index], effect.with_strength(strength), *others[index + 1 :]])


def solve_strength(
    share_at: Callable[[float], float], wanted: float, guess: float, strongest: float, tolerance: float
) -> float | None:
    """Return the strength by bracketing and regula falsi on logarithms; None if it cannot be reached."""
    low, high = 0.0, 0.0
    low_share, high_share = 0.0, 0.0
    strength = min(guess, strongest) or 1e-6
    for _ in range(40):
        share = share_at(strength)
        if abs(share / wanted - 1.0) < tolerance:
            return strength
        if share < wanted:
            low, low_share = strength, share
        else:
            high, high_share = strength, share
        if high == 0.0:
            if strength >= strongest:
                return None
            grow = np.clip(1.2 * wanted / max(share, 1e-12), 1.3, 30.0)
            strength = min(strength * float(grow), strongest)
        elif low == 0.0:
            shrink = np.clip(0.9 * wanted / share, 1e-3, 0.8)
            strength *= float(shrink)
        elif low_share > 0.0:
            part = np.log(wanted / low_share) / np.log(high_share / low_share)
            strength = float(low * (high / low) ** np.clip(part, 0.05, 0.95))
        else:
            strength = 0.5 * (low + high)
    return strength
