"""Definition of a base form: the contract that every file of `dampers/forms` (and of a user) fulfils.

A file defines `FORM = BaseForm(...)`; no other module has to be changed. The force of a base form is

    f = F_y(u) z + c0(u) w' + F_p(u) p + known + amplitudes,

where the steps of the form give the normalised hysteretic force z and, if the form has a second yielding part, its
normalised force p. F_y, c0 and F_p are laws of the effective drive u (:mod:`mrpipe.dampers.laws`). They are linear in
their coefficients, so that a fit solves for them exactly and searches only the parameters listed here. w' is the
velocity of the rod, or that of an inner element, if the steps set one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.parameters import Parameter, Parametrised, Scales, Values
from mrpipe.dampers.plant import Step


@dataclass(frozen=True)
class Strength:
    """Quantities that determine the post-yield force of a form; arrays of the same shape.

    Attributes
    ----------
    speed
        Speed of the rod [m/s], not negative.
    drive
        Effective drive [A or V].
    yield_force, viscosity, part_force
        Values of the laws at this drive [N], [N s/m], [N].
    """

    speed: FloatArray
    drive: FloatArray
    yield_force: FloatArray
    viscosity: FloatArray
    part_force: FloatArray


def fully_yielded(values: Values, at: Strength) -> FloatArray:
    """Return F_y + c0 v [N]: the hysteresis has reached its yield force at any speed."""
    del values
    return at.yield_force + at.viscosity * at.speed


@dataclass(frozen=True)
class BaseForm(Parametrised):
    """One base form.

    Attributes
    ----------
    name, summary
        Key, and the law in one line.
    source
        Publication that describes it.
    parameters
        Parameters of the form, without the laws and the lag of the drive, which all forms share.
    steps
        (values) -> steps of the chain that set z, p and other forces of the form. Every amplitude has its own step.
    amplitude_steps
        Amplitude -> index of its step in the list that `steps` returns.
    post_yield
        (values, strength) -> magnitude of the force at constant speed and drive [N], which inverses use.
    part
        Name of the law of the second yielding part; empty if there is none.
    coupled
        Whether the steps read yield force or viscosity, so that z depends on the laws of the drive.
    known
        Whether a step adds a force to `EXTRA_FORCE` that no linear coefficient scales, such as that of an inner spring.
    family
        Physical family of forms that are variants of each other; else the name of the form.
    begins_with
        Form whose fitted laws a coupled form reads at first; empty: those of a simple hysteresis.
    hysteresis
        (values) -> yield displacement [m], gamma/(gamma + beta), exponent of Bouc-Wen's equation (2.2); None for forms
        that do not hold it.
    dissipative
        Whether the form never feeds energy into a closed cycle, for all parameters within their bounds.
    springs
        Names of the parameters that are springs across the damper; the effect `accumulator` represents the same
        physics.
    file
        File of the user that defines the form, if any; it is set when the file is loaded.
    """

    name: str
    summary: str
    source: str
    parameters: tuple[Parameter, ...]
    steps: Callable[[Values], list[Step]]
    amplitude_steps: Mapping[str, int] = field(default_factory=dict)
    post_yield: Callable[[Values, Strength], FloatArray] = fully_yielded
    part: str = ""
    coupled: bool = False
    known: bool = False
    family: str = ""
    begins_with: str = ""
    hysteresis: Callable[[Values], tuple[float, float, float]] | None = None
    dissipative: bool = True
    springs: tuple[str, ...] = ()
    file: str = ""

    def without_springs(self) -> BaseForm:
        """Return the form without its springs, for comparisons in which the accumulator is a separate effect."""
        if not self.springs:
            return self
        kept = tuple(item for item in self.parameters if item.name not in self.springs)
        taps = {name: place for name, place in self.amplitude_steps.items() if name not in self.springs}
        return replace(self, parameters=kept, amplitude_steps=taps, springs=())

    @property
    def blocks(self) -> tuple[str, ...]:
        """Names of the laws of the drive, in order."""
        return ("yield_force", "c0", self.part) if self.part else ("yield_force", "c0")

    def constants(self, scales: Scales) -> dict[str, float]:
        """Return the references that the scales of a campaign fix."""
        return {item.name: item.start_values(scales)[0] for item in self.parameters if item.role == "constant"}

    def unit(self, name: str) -> str | None:
        """Return the unit of a parameter of this form; None if it has no parameter of this name."""
        return next((item.unit for item in self.parameters if item.name == name), None)


def rounded_share(speed: FloatArray, velocity_scale: float, sharpness: float) -> FloatArray:
    """Return r/(1 + r^m)^(1/m) for r = speed/velocity_scale: the share of the yield force that is reached."""
    ratio = speed / velocity_scale
    return np.asarray(ratio / (1.0 + ratio**sharpness) ** (1.0 / sharpness), dtype=np.float64)


def rounded_sum(share: FloatArray, at: Strength) -> FloatArray:
    """Return F_y times a share, plus c0 v [N]: the post-yield force of forms without an inner element."""
    return np.asarray(at.yield_force * share + at.viscosity * at.speed, dtype=np.float64)
