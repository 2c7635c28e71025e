"""Gains and switch of a controller for a damper that gives other forces than the model it was calibrated with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from mrpipe.artifacts import FloatArray
from mrpipe.control.controller import Gains
from mrpipe.control.linearisation import clipped_force, equivalent_stiffness
from mrpipe.tracing.loop.augmented import ForceInUse

LAWS_WITH_GAINS = ("vd", "vdps", "vdns", "fdns", "nnc")
"""Laws whose gain follows the damper; a regulator and a constant drive do not know it."""

FACTORS = (0.5, 2.0)
"""Gains move within these factors; where that does not do, the residual force decides and not the gain: it stays."""


def realised_force(law: str, gains: Gains, damper: ForceInUse, amplitude_m: float) -> Callable[..., FloatArray]:
    """Return the force over displacement and velocity that a damper makes of a law: never less than its residual."""

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        if law in ("fdns", "nnc"):
            wanted = gains.alpha_n_m * (np.sign(v) * amplitude_m - x)
        else:
            wanted = clipped_force(gains.c_n_s_m, gains.k_n_m, x, v)
        speed = np.abs(v)
        size = np.clip(np.abs(wanted), damper.smallest_n(speed), damper.largest_n(speed))
        return np.asarray(np.sign(v) * size)

    return force


def equivalent_loss(law: str, gains: Gains, damper: ForceInUse, omega: float, amplitude_m: float) -> float:
    """Return Im H [N/m] of what the damper makes of a law in harmonic motion (4.21)."""
    return equivalent_stiffness(realised_force(law, gains, damper, amplitude_m), amplitude_m, omega).imag


def gain_factor(
    law: str, gains: Gains, before: ForceInUse, after: ForceInUse, omega: float, amplitude_m: float
) -> float:
    """Return the factor on c (or alpha) with which the new damper has the equivalent damping the old one had.

    Which equivalent damping is best is a matter of the frame alone (4.13), (4.25): a law that was calibrated for it
    stays so if its gain makes up for what the damper gives beside. Stiffness stays.

    Parameters
    ----------
    before, after
        Forces of the damper that the gains were calibrated for, and of the one at hand.
    omega, amplitude_m
        Of the motion at the damper.
    """
    wanted = equivalent_loss(law, gains, before, omega, amplitude_m)

    def excess(factor: float) -> float:
        return equivalent_loss(law, scaled(law, gains, factor), after, omega, amplitude_m) - wanted

    low, high = FACTORS
    if excess(low) * excess(high) >= 0.0:
        return 1.0
    return float(brentq(excess, low, high, xtol=1e-4))


def scaled(law: str, gains: Gains, factor: float) -> Gains:
    """Return gains with c (or alpha) times a factor."""
    if law in ("fdns", "nnc"):
        return replace(gains, alpha_n_m=factor * gains.alpha_n_m)
    return replace(gains, c_n_s_m=factor * gains.c_n_s_m)


def switch_threshold(old_n: float, before: ForceInUse, after: ForceInUse, speed_m_s: float) -> float:
    """Return the desired force [N] below which the drive is 0: it keeps its ratio to the residual force."""
    return old_n * after.residual_n(speed_m_s) / max(before.residual_n(speed_m_s), 1e-12)
