"""Definition of a control law: one entry with its gains, calibration, checks, compiled force and C code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from mrpipe.artifacts import FloatArray
from mrpipe.control.gains import Gains
from mrpipe.errors import UserError

if TYPE_CHECKING:
    from mrpipe.control.limits import LimitingModes
    from mrpipe.control.lqg import Observer, Weights
    from mrpipe.structures import Frame

Need = Literal["network", "observer", "floor-accelerations", "damper-force", "drive-limit"]
"""Needs that a law may have in addition to the motion of the damper.

`network`: the trained reference network. `observer`: a state observer, which reads all accelerometers.
`floor-accelerations`: the accelerometers of ground and floors. `damper-force`: a load cell at the damper.
`drive-limit`: the largest drive of the damper.
"""


@dataclass(frozen=True)
class GainRange:
    """One free gain of a law.

    Attributes
    ----------
    name
        With its unit, such as `c_n_s_m`.
    meaning
        In a few words.
    bounds
        From a plant to the smallest and largest value that a search for the best gain should try.
    optional
        The gain may be 0.
    """

    name: str
    meaning: str
    bounds: Callable[[Plant], tuple[float, float]]
    optional: bool = False


@dataclass(frozen=True)
class Plant:
    """Plant for which a law is calibrated.

    Attributes
    ----------
    frame, bare
        The structure, with and without its own damping.
    position
        Connectivity vector w of the damper, shape (n,).
    modes
        Limiting modes of the target.
    static_stiffness_n_m
        Of the structure at the damper: the limit of negative stiffness.
    stiffness_n_m
        Stiffness k at which laws with stiffness are calibrated, by law.
    weights
        Of laws that are designed by an optimum.
    """

    frame: Frame
    bare: Frame
    position: FloatArray
    modes: LimitingModes
    static_stiffness_n_m: float
    stiffness_n_m: Mapping[str, float]
    weights: Weights


@dataclass(frozen=True)
class Assessment:
    """Damping of the target mode under a law at its gains; NaN where a law has no such number.

    Attributes
    ----------
    damping_ratio_estimate
        Closed form P2 (7).
    damping_ratio_exact, damping_ratio_with_frame
        Complex eigenvalue of the frame without and with its own damping. Friction by its equivalent (4.24).
    damping_ratio_clipped
        Of the equivalent of the clipped law.
    unstable_pole_1_s
        Largest real part of the poles of the unclipped loop.
    """

    damping_ratio_estimate: float = float("nan")
    damping_ratio_exact: float = float("nan")
    damping_ratio_with_frame: float = float("nan")
    damping_ratio_clipped: float = float("nan")
    unstable_pole_1_s: float = float("nan")


HarmonicForce = Callable[[Gains, FloatArray, FloatArray, float], FloatArray]
"""From gains, displacement (n,) [m], velocity (n,) [m/s] and amplitude [m] to the desired force (n,) [N]."""


def no_candidates(_: Plant) -> Mapping[str, Gains]:
    """Return no calibrated gains: for laws without gains."""
    return {}


def no_assessment(_: Plant, __: Gains) -> Assessment:
    """Return no damping: for laws that have no linear equivalent."""
    return Assessment()


def no_numbers(_: Gains, __: FloatArray | None, ___: float) -> FloatArray:
    """Return no further numbers for the compiled law."""
    import numpy as np

    return np.zeros(0)


@dataclass(frozen=True)
class Law:
    """One control law.

    Attributes
    ----------
    name
        As on the command line; the file's name with hyphens.
    summary
        One line.
    source
        Equation of the thesis or paper.
    force
        Compiled with :data:`~mrpipe.control.kernel.LAW_SIGNATURE`: numbers, layout, state and measurements to the
        desired force [N] before clipping. A law that commands the drive writes it into `state[S_REQUEST]`.
    c_body
        The same as the body of the C function `double law(double *state, const double *measured)`.
    c_helpers
        C functions that `c_body` calls.
    output
        `force`: the inverse of the damper turns the force into a drive. `drive`: the law commands the drive, and the
        force that it returns is only reported.
    gains
        Its free gains.
    needs
        Needs of the law in addition to the motion of the damper.
    candidates
        From a plant to gains by source: `closed-form`, `exact` and more.
    assess
        From a plant and gains to the damping that they give.
    signs
        Gain -> +1 or -1: the sign that it must have where it is not 0.
    harmonic_force
        Desired force in harmonic motion; None where the law depends on more than the motion of the damper.
    linear
        f = c v + k x, clipped: the law has no memory and may act in continuous time.
    tuned_gain
        The gain that is scaled to make up for a damper that gives other forces than its model; empty: none.
    observer
        From frame, position, weights and sample time to the observer of the law.
    numbers
        From gains, position and sample time to further numbers, found at `numbers[layout[AT_LAW]]`.
    memory
        Places in the state from `state[layout[STATE_LAW]]` on.
    """

    name: str
    summary: str
    source: str
    force: Any
    c_body: str
    c_helpers: str = ""
    output: Literal["force", "drive"] = "force"
    gains: tuple[GainRange, ...] = ()
    needs: frozenset[Need] = frozenset()
    candidates: Callable[[Plant], Mapping[str, Gains]] = no_candidates
    assess: Callable[[Plant, Gains], Assessment] = no_assessment
    signs: Mapping[str, float] = field(default_factory=dict)
    harmonic_force: HarmonicForce | None = None
    linear: bool = False
    tuned_gain: str = ""
    observer: Callable[[Frame, FloatArray, Weights, float], Observer] | None = None
    numbers: Callable[[Gains, FloatArray | None, float], FloatArray] = no_numbers
    memory: int = 0

    @property
    def gain_names(self) -> tuple[str, ...]:
        """Names of its free gains."""
        return tuple(gain.name for gain in self.gains)

    @property
    def calibrated(self) -> bool:
        """Whether there is something to calibrate: gains, a network or an observer."""
        return bool(self.gains) or bool({"network", "observer"} & self.needs)

    def check(self, gains: Gains) -> None:
        """Refuse gains that the law does not have, or of the wrong sign.

        Raises
        ------
        UserError
            Naming the gain.
        """
        where = f"calibrate.{self.name}"
        known = self.gain_names
        for name, value in gains.items():
            if value == 0.0:
                continue
            if name not in known:
                raise UserError(
                    where, name, f"law {self.name} has no such gain", f"it has: {', '.join(known) or 'none'}"
                )
            sign = self.signs.get(name)
            if sign is not None and value * sign < 0.0:
                raise UserError(where, name, f"is {value:g}", f"law {self.name} needs a {_SIGNS[sign]} {name}")

    def scaled(self, gains: Gains, factor: float) -> Gains:
        """Return gains with the tuned one times a factor; unchanged where the law has none."""
        if not self.tuned_gain:
            return gains
        return gains.changed(**{self.tuned_gain: factor * gains[self.tuned_gain]})

    def gains_as_json(self, gains: Gains) -> dict[str, float]:
        """Return the gains that the law has, keys with units."""
        return {name: gains.get(name, 0.0) for name in self.gain_names}


_SIGNS = {1.0: "positive", -1.0: "negative"}
