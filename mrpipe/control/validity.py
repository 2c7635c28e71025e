"""Where calibrated gains may not hold: forces that the damper cannot give, and the static limit of the stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.control.calibration import Calibration
from mrpipe.control.gains import Gains
from mrpipe.control.law import Law
from mrpipe.control.laws import law_named
from mrpipe.words import in_percent

_RESIDUAL_SHARE = 0.3
"""Share of the needed force above which the force without drive limits a law."""


@dataclass(frozen=True)
class ForceDemand:
    """Largest force of a law in harmonic motion, and the forces of the damper at the peak speed of this motion.

    Attributes
    ----------
    amplitude_m
        Amplitude of the motion of the damper [m].
    needed_n
        Largest force of the law [N].
    residual_n, largest_n
        Force of the damper without drive and at the drive limit [N].
    """

    amplitude_m: float
    needed_n: float
    residual_n: float
    largest_n: float

    @property
    def exceeds_damper(self) -> bool:
        """Whether the law needs more force than the damper gives."""
        return self.needed_n > self.largest_n

    @property
    def limited_by_residual(self) -> bool:
        """Whether the force without drive is a large part of the needed force."""
        return self.residual_n > _RESIDUAL_SHARE * self.needed_n

    def as_json(self) -> dict[str, Any]:
        """Return what `mrpipe calibrate --json` prints."""
        return {
            "amplitude_m": self.amplitude_m,
            "needed_force_n": self.needed_n,
            "residual_force_n": self.residual_n,
            "largest_force_n": self.largest_n,
            "exceeds_damper": self.exceeds_damper,
            "limited_by_residual_force": self.limited_by_residual,
        }

    def warnings(self, law: str) -> list[str]:
        """Return warnings about the law of this name, one sentence each."""
        said = []
        if self.exceeds_damper:
            said.append(f"{law}: needs {self.needed_n:.0f} N, but the damper gives at most {self.largest_n:.0f} N")
        if self.limited_by_residual:
            said.append(
                f"{law}: the residual force of {self.residual_n:.0f} N is "
                f"{in_percent(self.residual_n / self.needed_n)} of the {self.needed_n:.0f} N needed at "
                f"{1e3 * self.amplitude_m:.1f} mm: the residual force limits the law, not the largest force"
            )
        return said


def force_demands(
    calibration: Calibration, *, amplitude_m: float, residual_force_n: float, largest_force_n: float
) -> dict[str, ForceDemand]:
    """Return law -> demand of the laws that define a force in harmonic motion.

    Parameters
    ----------
    calibration
        Calibration of all laws.
    amplitude_m
        Amplitude of the damper at which the forces are compared [m].
    residual_force_n, largest_force_n
        Force of the damper at the peak speed of this amplitude [N], without drive and at the drive limit.
    """
    needed = {
        law: needed_force(law_named(law), item.gains, amplitude_m, calibration.modes.omega_0)
        for law, item in calibration.laws.items()
    }
    return {
        law: ForceDemand(amplitude_m, force, residual_force_n, largest_force_n)
        for law, force in needed.items()
        if force > 0.0
    }


def needed_force(law: Law, gains: Gains, amplitude_m: float, omega: float) -> float:
    """Return the largest force [N] of a law in harmonic motion; 0 if the law defines no harmonic force."""
    if law.harmonic_force is None:
        return 0.0
    phase = np.linspace(0.0, 2.0 * np.pi, 1441)
    x, v = amplitude_m * np.sin(phase), amplitude_m * omega * np.cos(phase)
    return float(np.max(np.abs(law.harmonic_force(gains, x, v, amplitude_m))))


def validity_warnings(calibration: Calibration, demands: Mapping[str, ForceDemand]) -> list[str]:
    """Return warnings about the calibrated laws, one sentence each.

    Parameters
    ----------
    calibration
        Calibration of all laws.
    demands
        Forces that the laws need, from :func:`force_demands`.
    """
    said = []
    limit = calibration.static_stiffness_n_m
    for law, item in calibration.laws.items():
        negative = law_named(law).negative_stiffness(item.gains)
        if negative > limit:
            said.append(
                f"{law}: negative stiffness of {-negative:.0f} N/m is beyond the static limit of {-limit:.0f} N/m at "
                f"the damper; unclipped, its fastest pole is {item.unstable_pole_1_s:+.2f} rad/s"
            )
        elif negative > 0.9 * limit:
            said.append(
                f"{law}: negative stiffness is at {in_percent(negative / limit)} of the static limit of "
                f"{-limit:.0f} N/m"
            )
        said += demands[law].warnings(law) if law in demands else []
    return said
