"""Gains and switch of a controller for a damper that gives other forces than the model it was calibrated with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from mrpipe.artifacts import FloatArray
from mrpipe.control.gains import Gains
from mrpipe.control.law import Law
from mrpipe.control.linearisation import equivalent_stiffness
from mrpipe.tracing.loop.augmented import ForceInUse

FACTORS = (0.5, 2.0)
"""Gains move within these factors; where that does not do, the residual force decides and not the gain: it stays."""


def realised_force(law: Law, gains: Gains, damper: ForceInUse, amplitude_m: float) -> Callable[..., FloatArray]:
    """Return the force over displacement and velocity that a damper makes of a law: never less than its residual."""
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
    """Return Im H [N/m] of what the damper makes of a law in harmonic motion (4.21)."""
    return equivalent_stiffness(realised_force(law, gains, damper, amplitude_m), amplitude_m, omega).imag


def gain_factor(
    law: Law, gains: Gains, before: ForceInUse, after: ForceInUse, omega: float, amplitude_m: float
) -> float:
    """Return the factor on the tuned gain with which the new damper has the equivalent damping of the old one.

    The best equivalent damping depends on the frame alone (4.13), (4.25). A law that was calibrated for it stays so if
    its gain makes up for the other force of the damper. Stiffness is kept.

    Parameters
    ----------
    law, gains
        What is tuned; the law must have a force in harmonic motion.
    before, after
        Forces of the damper that the gains were calibrated for, and of the one at hand.
    omega, amplitude_m
        Of the motion at the damper.
    """
    wanted = equivalent_loss(law, gains, before, omega, amplitude_m)

    def excess(factor: float) -> float:
        return equivalent_loss(law, law.scaled(gains, factor), after, omega, amplitude_m) - wanted

    low, high = FACTORS
    if excess(low) * excess(high) >= 0.0:
        return 1.0
    return float(brentq(excess, low, high, xtol=1e-4))


def switch_threshold(old_n: float, before: ForceInUse, after: ForceInUse, speed_m_s: float) -> float:
    """Return the desired force [N] below which the drive is 0: it keeps its ratio to the residual force."""
    return old_n * after.residual_n(speed_m_s) / max(before.residual_n(speed_m_s), 1e-12)
