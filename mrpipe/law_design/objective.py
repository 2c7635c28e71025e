"""What a design minimises: the largest response over a frequency band, amplitudes and recorded motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrpipe.control.gains import Gains
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import Response
from mrpipe.simulation.response_curve import CurveOptions, ResponseCurve, Run, response_curve

RunOf = Callable[[str, Gains], Run]
"""From a law and its gains to the function that runs the loop under an excitation."""

UNACCEPTABLE = 1e6
"""Value of the objective where the response grows without bound, in multiples of the reference. It is finite because a
simplex of an optimiser must be able to compare it; any stable loop is far below."""


@dataclass(frozen=True)
class Limits:
    """What the damper allows; a design that exceeds them is penalised in proportion.

    Attributes
    ----------
    stroke_m
        Largest displacement of the damper [m]; infinite: not limited. Drive and force are limited by the damper model
        itself, which saturates.
    """

    stroke_m: float = math.inf


@dataclass(frozen=True)
class Motion:
    """A recorded or synthetic base motion that the design must withstand.

    Attributes
    ----------
    name
        For tables.
    excitation
        Base acceleration over time.
    """

    name: str
    excitation: Excitation


@dataclass(frozen=True)
class Load:
    """Everything that the structure is exposed to.

    Attributes
    ----------
    band_rad_s
        Lowest and highest frequency of harmonic base motion [rad/s].
    amplitudes_m_s2
        Amplitudes of the harmonic base acceleration [m/s^2].
    motions
        Recorded motions; their response is the RMS value over the record.
    """

    band_rad_s: tuple[float, float]
    amplitudes_m_s2: tuple[float, ...]
    motions: tuple[Motion, ...] = ()


@dataclass(frozen=True)
class Objective:
    """How responses become one number.

    Attributes
    ----------
    weights
        Quantity of :data:`~mrpipe.simulation.response_curve.QUANTITIES` -> weight. The objective is the weighted sum of
        the largest values, each relative to the reference.
    reference
        Quantity -> largest value of the reference design, which makes quantities with different units comparable.
    limits
        Of the damper.
    """

    weights: Mapping[str, float]
    reference: Mapping[str, float] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)

    def value(self, peaks: Mapping[str, float]) -> float:
        """Return the objective of a design from its largest responses [1]."""
        total = sum(weight * peaks[name] / self.reference.get(name, 1.0) for name, weight in self.weights.items())
        excess = peaks["rms_stroke_m"] * math.sqrt(2.0) / self.limits.stroke_m - 1.0
        total *= 1.0 + max(0.0, excess)
        return min(total, UNACCEPTABLE) if math.isfinite(total) else UNACCEPTABLE


@dataclass(frozen=True)
class Evaluation:
    """One law at one set of gains under the load.

    Attributes
    ----------
    law, gains
        What was run.
    curves
        Response over frequency, one per amplitude.
    motions
        Motion -> RMS values.
    value
        Of the objective.
    """

    law: str
    gains: Gains
    curves: tuple[ResponseCurve, ...]
    motions: Mapping[str, Mapping[str, float]]
    value: float = math.nan

    @property
    def peaks(self) -> dict[str, float]:
        """Largest value of each quantity over band, amplitudes and motions."""
        return largest(self.curves, self.motions)

    @property
    def resonance_rad_s(self) -> float:
        """Frequency of the largest top displacement at the largest amplitude [rad/s]."""
        return self.curves[-1].resonance_rad_s


def largest(curves: Sequence[ResponseCurve], motions: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Return the largest value of each quantity over all curves and motions."""
    from mrpipe.simulation.response_curve import QUANTITIES

    return {
        name: max([curve.peak(name) for curve in curves] + [values[name] for values in motions.values()])
        for name in QUANTITIES
    }


def evaluate(
    run_of: RunOf, law: str, gains: Gains, load: Load, objective: Objective, options: CurveOptions
) -> Evaluation:
    """Run one law at one set of gains under the whole load.

    Parameters
    ----------
    run_of
        Gives the loop of a law.
    law, gains
        Of the design.
    load, objective
        What it is exposed to, and how responses become one number.
    options
        Of the response curves.
    """
    run = run_of(law, gains)
    amplitudes = sorted(load.amplitudes_m_s2)
    curves = tuple(response_curve(run, amplitude, load.band_rad_s, options) for amplitude in amplitudes)
    motions = {motion.name: _rms_of(run(motion.excitation), options.absolute) for motion in load.motions}
    found = Evaluation(law, gains, curves, motions)
    return Evaluation(law, gains, curves, motions, objective.value(found.peaks))


def _rms_of(response: Response, absolute: bool) -> dict[str, float]:
    from mrpipe.simulation.response_curve import QUANTITIES, rms_between

    values = rms_between(response, np.array([0.0, float(response.time_s[-1])]), absolute)[0]
    return dict(zip(QUANTITIES, values.tolist(), strict=True))
