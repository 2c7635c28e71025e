"""Definition of a control law: one entry with its gains, calibration, checks, compiled force and C code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from mrpipe.artifacts import FloatArray
from mrpipe.control.gains import Gains
from mrpipe.errors import UserError

if TYPE_CHECKING:
    from mrpipe.control.limits import LimitingModes
    from mrpipe.control.lqg import Observer, Weights
    from mrpipe.structures import Frame

Need = Literal["network", "observer", "floor-accelerations", "damper-force", "observer-force", "drive-limit"]
"""Needs that a law may have in addition to the motion of the damper.

`network`: the trained reference network. `observer`: a state observer, which reads all accelerometers.
`floor-accelerations`: the accelerometers of ground and floors. `damper-force`: a load cell at the damper.
`observer-force`: the same for the observer alone, which can take the desired force in its place.
`drive-limit`: the largest drive of the damper.
"""


@dataclass(frozen=True)
class GainRange:
    """Free gain of a law.

    Attributes
    ----------
    name
        Name with its unit, such as `c_n_s_m`.
    meaning
        Meaning in a few words.
    bounds
        Function from a plant to the smallest and the largest value in a search for the best gain.
    optional
        Whether the gain may be 0.
    softens
        Whether the gain is a negative stiffness of the device, whatever its sign.
    """

    name: str
    meaning: str
    bounds: Callable[[Plant], tuple[float, float]]
    optional: bool = False
    softens: bool = False


@dataclass(frozen=True)
class Plant:
    """Plant for which a law is calibrated.

    Attributes
    ----------
    frame, bare
        Structure with and without its inherent damping.
    position
        Connectivity vector w of the damper, shape (n,).
    modes
        Limiting modes of the target.
    static_stiffness_n_m
        Static stiffness of the structure at the damper [N/m], which is the limit of negative stiffness.
    stiffness_n_m
        Law -> stiffness k for which a law with stiffness is calibrated [N/m].
    weights
        Weights of the laws that are optimal regulators.
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
        Damping ratio by the closed form P2 (7).
    damping_ratio_exact, damping_ratio_with_frame
        Damping ratio by the complex eigenvalue of the frame without and with inherent damping. Friction is replaced by
        its equivalent (4.24).
    damping_ratio_clipped
        Damping ratio of the equivalent of the clipped law.
    unstable_pole_1_s
        Largest real part of the poles of the loop without clipping [1/s].
    """

    damping_ratio_estimate: float = float("nan")
    damping_ratio_exact: float = float("nan")
    damping_ratio_with_frame: float = float("nan")
    damping_ratio_clipped: float = float("nan")
    unstable_pole_1_s: float = float("nan")


HarmonicForce = Callable[[Gains, FloatArray, FloatArray, float], FloatArray]
"""Function from gains, displacement (n,) [m], velocity (n,) [m/s] and amplitude [m] to the desired force (n,) [N]."""


def no_candidates(_: Plant) -> Mapping[str, Gains]:
    """Return no candidates, for laws without gains."""
    return {}


def no_assessment(_: Plant, __: Gains) -> Assessment:
    """Return no damping ratios, for laws that have no linear equivalent."""
    return Assessment()


def no_numbers(_: Gains, __: FloatArray | None, ___: float) -> FloatArray:
    """Return an empty array, for compiled laws without further numbers."""
    import numpy as np

    return np.zeros(0)


@dataclass(frozen=True)
class Law:
    """Control law.

    Attributes
    ----------
    name
        Name on the command line: the name of the file with hyphens.
    summary
        Description in one line.
    source
        Equation of the thesis or paper.
    force
        Compiled with :data:`~mrpipe.control.kernel.LAW_SIGNATURE`: numbers, layout, state and measurements to the
        desired force [N] before clipping. A law that commands the drive writes it into `state[S_REQUEST]`.
    c_body
        The same force as the body of the C function `double law(double *state, const double *measured)`.
    c_helpers
        C functions that `c_body` calls.
    output
        `force`: the inverse of the damper turns the force into a drive. `drive`: the law commands the drive, and the
        force that it returns is only reported.
    gains
        Free gains of the law.
    needs
        Needs of the law in addition to the motion of the damper.
    candidates
        Function from a plant to gains by source: `closed-form`, `exact` and others.
    assess
        Function from a plant and gains to the damping.
    signs
        Gain -> +1 or -1, the sign that the gain must have if it is not 0.
    harmonic_force
        Desired force in harmonic motion; None where the law depends on more than the motion of the damper.
    linear
        Whether the law is f = c v + k x, clipped. Such a law has no state, and it can act in continuous time.
    tuned_gain
        Gain that is scaled to compensate the difference between the damper and its model; empty: none.
    observer
        Function from frame, position, weights and sample time to the observer of the law; None: the law has no
        observer.
    numbers
        Function from gains, position and sample time to further numbers, which the law reads from
        `numbers[layout[AT_LAW]]` on.
    memory
        Number of places of the law in the state, from `state[layout[STATE_LAW]]` on.
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
        """Names of the free gains."""
        return tuple(gain.name for gain in self.gains)

    @property
    def calibrated(self) -> bool:
        """Whether the law has gains, a network or an observer to calibrate."""
        return bool(self.gains) or bool({"network", "observer"} & self.needs)

    def require_gains(self, names: Iterable[str], setting: str) -> None:
        """Refuse gains that the law does not have.

        Raises
        ------
        UserError
            If there is one; the message names the setting.
        """
        known = self.gain_names
        for name in names:
            if name not in known:
                remedy = f"it has: {', '.join(known) or 'none'}"
                raise UserError(setting, name, f"law {self.name} has no such gain", remedy)

    def check(self, gains: Gains) -> None:
        """Check that the law has these gains and that their signs are right.

        Raises
        ------
        UserError
            If the law does not have a gain, or a gain has the wrong sign.
        """
        where = f"calibrate.{self.name}"
        for name, value in gains.items():
            if value == 0.0:
                continue
            self.require_gains([name], where)
            sign = self.signs.get(name)
            if sign is not None and value * sign < 0.0:
                raise UserError(where, name, f"is {value:g}", f"law {self.name} needs a {_SIGNS[sign]} {name}")

    def check_given(self, given: Mapping[str, float]) -> None:
        """Check gains that a user gives, as :meth:`check` does, and that they are not all zero.

        Raises
        ------
        UserError
            As :meth:`check`; or if all gains of the law are given as 0, which would be no law.
        """
        self.check(Gains(**given))
        if given and set(given) == set(self.gain_names) and not any(given.values()):
            name = next(iter(given))
            kind = _SIGNS.get(self.signs.get(name, 0.0), "non-zero")
            remedy = f"law {self.name} needs a {kind} {name}; without force the law is passive-off"
            raise UserError(f"calibrate.{self.name}", name, "is 0", remedy)

    def scaled(self, gains: Gains, factor: float) -> Gains:
        """Return the gains with the tuned gain multiplied by a factor; unchanged if the law has no tuned gain."""
        if not self.tuned_gain:
            return gains
        return gains.changed(**{self.tuned_gain: factor * gains[self.tuned_gain]})

    def negative_stiffness(self, gains: Gains) -> float:
        """Return the negative stiffness of the device at these gains, as a positive number [N/m]; 0 if it has none."""
        own = [gains[item.name] for item in self.gains if item.softens]
        return max(-gains.k_n_m, *own, 0.0)

    def gains_as_json(self, gains: Gains) -> dict[str, float]:
        """Return name -> value of the gains that the law has; the names end in units."""
        return {name: gains.get(name, 0.0) for name in self.gain_names}


_SIGNS = {1.0: "positive", -1.0: "negative"}
