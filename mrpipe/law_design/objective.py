"""Objective of a design: the largest response over a frequency band, amplitudes and recorded motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.control.gains import Gains
from mrpipe.law_design.options import DesignSettings
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import Response
from mrpipe.simulation.response_curve import ResponseCurve, response_curve
from mrpipe.simulation.steady_state import CurveOptions, Run, Steady
from mrpipe.simulation.windows import QUANTITIES, values_between

RunOf = Callable[[str, Gains], Run]
"""Function that returns, for a law and its gains, the function that runs the loop under an excitation."""

UNACCEPTABLE = 1e6
"""Value of the objective where the response grows without bound, in multiples of the reference. It is finite, because
an optimiser must be able to compare it; the value of every stable loop is far below.
"""


PENALTY = 10.0
"""Factor on the excess over a limit. A design that keeps the limit is preferred unless the objective of the other one
is smaller by more than ten times the excess. The response of a structure never depends so strongly on one of these
quantities.
"""


@dataclass(frozen=True)
class Limits:
    """Largest values that damper and structure allow, over band, amplitudes and motions; infinite: not limited.

    Attributes
    ----------
    stroke_m
        Displacement across the damper [m].
    force_n
        Force of the damper [N].
    rms_drive
        RMS value of the drive, the continuous rating of coil and driver [A or V]. The largest drive needs no limit
        here, because the controller never exceeds it.
    """

    stroke_m: float = math.inf
    force_n: float = math.inf
    rms_drive: float = math.inf

    @classmethod
    def of(cls, settings: DesignSettings) -> Limits:
        """Return the limits of the settings."""
        given = (settings.stroke_limit_m, settings.force_limit_n, settings.rms_drive_limit)
        return cls(*(math.inf if value is None else value for value in given))

    def excess(self, peaks: Mapping[str, float]) -> dict[str, float]:
        """Return the excess of a design over each limit, relative to the limit [1]; 0 if it keeps the limit."""
        pairs = {
            "max_stroke_m": self.stroke_m,
            "max_force_n": self.force_n,
            "rms_drive": self.rms_drive,
        }
        return {name: max(0.0, peaks[name] / limit - 1.0) for name, limit in pairs.items() if math.isfinite(limit)}

    def exceeded(self, peaks: Mapping[str, float]) -> dict[str, float]:
        """Return the excess of a design over each limit that it does not keep, relative to the limit [1]."""
        return {name: value for name, value in self.excess(peaks).items() if value > 0.0}


@dataclass(frozen=True)
class Motion:
    """A recorded or synthetic base motion that the design must withstand.

    Attributes
    ----------
    name
        Name of the motion, for tables.
    excitation
        Base acceleration over time.
    """

    name: str
    excitation: Excitation


@dataclass(frozen=True)
class Load:
    """Excitations for which the structure is designed.

    Attributes
    ----------
    band_rad_s
        Lowest and highest frequency of harmonic base motion [rad/s].
    amplitudes_m_s2
        Amplitudes of the harmonic base acceleration [m/s^2].
    motions
        Recorded motions; their response is the RMS or largest value over the record.
    """

    band_rad_s: tuple[float, float]
    amplitudes_m_s2: tuple[float, ...]
    motions: tuple[Motion, ...] = ()


@dataclass(frozen=True)
class Objective:
    """Function from responses to one number.

    Attributes
    ----------
    weights
        Quantity of :data:`~mrpipe.simulation.response_curve.QUANTITIES` -> weight. The objective is the weighted sum of
        the largest values, each relative to the reference.
    reference
        Quantity -> largest value of the reference design, which makes quantities with different units comparable.
    limits
        Limits of damper and structure.
    """

    weights: Mapping[str, float]
    reference: Mapping[str, float] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)

    def value(self, peaks: Mapping[str, float]) -> float:
        """Return the objective of a design from its largest responses [1]."""
        total = sum(weight * peaks[name] / self.reference.get(name, 1.0) for name, weight in self.weights.items())
        total *= 1.0 + PENALTY * sum(self.limits.excess(peaks).values())
        return min(total, UNACCEPTABLE) if math.isfinite(total) else UNACCEPTABLE


@dataclass(frozen=True)
class Evaluation:
    """One law at one set of gains under the load.

    Attributes
    ----------
    law, gains
        Law and gains of the evaluation.
    curves
        Response over frequency, one per amplitude.
    motions
        Motion -> RMS and largest values.
    value
        Value of the objective.
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
    return {
        name: max([curve.peak(name) for curve in curves] + [values[name] for values in motions.values()])
        for name in QUANTITIES
    }


@dataclass
class Known:
    """Steady responses that were measured before, so that no loop runs twice under the same conditions.

    It belongs to one loop: structure, damper, settings and sensor noise are the same for all of its responses.
    """

    _found: dict[Hashable, dict[float, Steady]] = field(default_factory=dict)

    def curve(
        self,
        run: Run,
        design: tuple[str, Gains],
        amplitude_m_s2: float,
        band: tuple[float, float],
        options: CurveOptions,
    ) -> ResponseCurve:
        """Return the response curve of a law and its gains; it shares frequencies with curves of other quantities."""
        key = (design, amplitude_m_s2, band, replace(options, refined=()))
        # a copy, because other threads may read what is there
        responses = dict(self._found.get(key, {}))
        found = response_curve(run, amplitude_m_s2, band, options, responses)
        self._found[key] = responses
        return found


def evaluate(
    run_of: RunOf,
    law: str,
    gains: Gains,
    load: Load,
    objective: Objective,
    options: CurveOptions,
    known: Known | None = None,
) -> Evaluation:
    """Run one law at one set of gains under the whole load.

    Parameters
    ----------
    run_of
        Function that returns the loop of a law.
    law, gains
        Law and gains of the design.
    load, objective
        Excitation, and the objective that makes one number of the responses.
    options
        Options of the response curves.
    known
        Responses of this loop that were measured before; new responses are added.
    """
    run = run_of(law, gains)
    known = known or Known()
    amplitudes = sorted(load.amplitudes_m_s2)
    curves = tuple(known.curve(run, (law, gains), amplitude, load.band_rad_s, options) for amplitude in amplitudes)
    motions = {motion.name: _values_of(run(motion.excitation), options.absolute) for motion in load.motions}
    found = Evaluation(law, gains, curves, motions)
    return Evaluation(law, gains, curves, motions, objective.value(found.peaks))


def _values_of(response: Response, absolute: bool) -> dict[str, float]:
    values = values_between(response, np.array([0.0, float(response.time_s[-1])]), absolute)[0]
    return dict(zip(QUANTITIES, values.tolist(), strict=True))
