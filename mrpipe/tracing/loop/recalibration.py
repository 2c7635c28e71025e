"""Gains and switch force of a controller, for a damper whose forces differ from those of the calibration model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from mrpipe.artifacts import FloatArray
from mrpipe.control.gains import Gains
from mrpipe.control.law import Law
from mrpipe.control.linearisation import equivalent_stiffness
from mrpipe.tracing.loop.augmented import ForceInUse
from mrpipe.tracing.rules import LoopRules


def realised_force(law: Law, gains: Gains, damper: ForceInUse, amplitude_m: float) -> Callable[..., FloatArray]:
    """Return the force [N] of a damper under a law as a function of x [m] and v [m/s]; at least the residual force."""
    demand = law.harmonic_force
    if demand is None:
        raise ValueError(f"law {law.name} has no force in harmonic motion")

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        wanted = demand(gains, x, v, amplitude_m)
        speed = np.abs(v)
        size = np.clip(np.abs(wanted), damper.smallest_n(speed), damper.largest_n(speed))
        return np.asarray(np.sign(v) * size)

    return force


def equivalent_loss(law: Law, gains: Gains, damper: ForceInUse, omega: float, amplitude_m: float) -> float:
    """Return Im H [N/m] of the force of the damper under a law in harmonic motion (4.21)."""
    return equivalent_stiffness(realised_force(law, gains, damper, amplitude_m), amplitude_m, omega).imag


def gain_factor(
    law: Law,
    gains: Gains,
    before: ForceInUse,
    after: ForceInUse,
    omega: float,
    amplitude_m: float,
    most: float = LoopRules().most_gain,
) -> float:
    """Return the factor on the tuned gain with which the new damper has the same equivalent damping as the old one.

    The best equivalent damping depends on the frame only (4.13), (4.25). A calibrated law stays calibrated if its gain
    compensates the changed force of the damper. The equivalent stiffness is not changed.

    Parameters
    ----------
    law, gains
        Law and its calibrated gains; the law must have a force in harmonic motion.
    before, after
        Forces of the damper that the gains were calibrated for, and of the damper with its effects.
    omega, amplitude_m
        Angular frequency [rad/s] and amplitude [m] of the motion at the damper.
    most
        Largest factor, and inverse of the smallest one; the gain is kept if no factor in this range restores the
        equivalent damping.
    """
    wanted = equivalent_loss(law, gains, before, omega, amplitude_m)

    def excess(factor: float) -> float:
        return equivalent_loss(law, law.scaled(gains, factor), after, omega, amplitude_m) - wanted

    low, high = 1.0 / most, most
    if excess(low) * excess(high) >= 0.0:
        return 1.0
    return float(brentq(excess, low, high, xtol=1e-4))


def switch_threshold(old_n: float, before: ForceInUse, after: ForceInUse, speed_m_s: float) -> float:
    """Return the desired force [N] below which the drive is 0; its ratio to the residual force is kept."""
    return old_n * after.residual_n(speed_m_s) / max(before.residual_n(speed_m_s), 1e-12)
