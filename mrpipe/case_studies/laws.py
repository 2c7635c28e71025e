"""The laws that the base-isolated building and the tower are run under."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mrpipe.case_studies.lqg import SampledController
from mrpipe.case_studies.run import BinghamDevice, Controller
from mrpipe.errors import UserError

LAWS = ("vd", "vdns", "fdns", "lqg", "lqg-clipped", "passive-off", "passive-on")
"""VD, VDNS, FDNS with MR dampers; LQG with ideal actuators, and clipped on the MR dampers; constant voltages."""


PASSIVE = ("passive-off", "passive-on")
"""Laws with a constant voltage."""


def constant_voltage(law: str, device: BinghamDevice) -> float:
    """Return the voltage [V] of a law of :data:`PASSIVE`."""
    return 0.0 if law == "passive-off" else device.highest_voltage


def unknown_law(law: str, structure: str) -> UserError:
    """Return the error for a law that is not in :data:`LAWS`; `structure` as in "the tower"."""
    return UserError("--law", law, f"is not a law of {structure}", f"known: {', '.join(LAWS)}")


def require_known(laws: Sequence[str], structure: str) -> None:
    """Raise UserError if one of the laws is not in :data:`LAWS`."""
    for law in laws:
        if law not in LAWS:
            raise unknown_law(law, structure)


@dataclass(frozen=True)
class LawGains:
    """Gains of the laws with MR dampers, and the damping ratio for which they were calibrated.

    Attributes
    ----------
    viscous
        Viscosity c of vd [N s/m].
    negative_stiffness, negative_viscous
        Stiffness k_d [N/m] and viscosity c [N s/m] of vdns.
    friction
        Gain alpha of fdns [N/m].
    damping_ratio
        Damping ratio of the calibrated mode under ideal vd [1].
    """

    viscous: float
    negative_stiffness: float
    negative_viscous: float
    friction: float
    damping_ratio: float


def controller_of(
    law: str, damper: Controller, gains: LawGains, observer: SampledController, structure: str
) -> Controller:
    """Return the controller of a law of :data:`LAWS`.

    Parameters
    ----------
    law
        Name of the law.
    damper
        Controller with the MR damper and its inverse, whose law is replaced.
    gains, observer
        Gains of the laws, and the controller of LQG.
    structure
        Name of the structure in messages, such as "the tower".

    Raises
    ------
    UserError
        If the law does not exist.
    """
    if law == "vd":
        return replace(damper, viscous=gains.viscous)
    if law == "vdns":
        return replace(damper, viscous=gains.negative_viscous, stiffness=gains.negative_stiffness)
    if law == "fdns":
        return replace(damper, law="friction", friction=gains.friction)
    if law == "lqg":
        return Controller("lqg", "active", observer=observer)
    if law == "lqg-clipped":
        return replace(damper, law="lqg", observer=observer)
    if law in PASSIVE:
        volts = constant_voltage(law, damper.device)
        return Controller("constant", "bingham", voltage=volts, device=damper.device, dampers=damper.dampers)
    raise unknown_law(law, structure)
