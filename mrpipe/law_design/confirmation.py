"""Confirmation of a design: the same loop at another step, with other sensor noise, and from other starts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed

from mrpipe.artifacts import FloatArray
from mrpipe.control.law import Plant
from mrpipe.control.laws import law_named
from mrpipe.law_design.kept import Designed
from mrpipe.law_design.objective import Evaluation, Load, Objective, evaluate
from mrpipe.law_design.problem import LoopOf
from mrpipe.simulation.steady_state import CurveOptions, Run, steady_values
from mrpipe.simulation.windows import QUANTITIES

CONFIRMING_RATE = 2.0
"""Plant rate of the confirmation, relative to the settings, with other sensor noise."""

STARTS = 8
"""Number of phases of the base motion from which the best design is run."""

DIFFERENT = 0.02
"""Relative difference between the responses from two starts that is reported; sensor noise gives less than 0.5 %."""

ERRORS = 4.0
"""A difference is reported only if it exceeds this number of standard errors of the values, because an irregular
response differs from run to run."""


@dataclass(frozen=True)
class OtherStarts:
    """Response of a design at its resonance from several starts, each at another phase of the base motion.

    A loop with a clipped law or friction can have several periodic responses. Which of them it reaches depends on its
    start.

    Attributes
    ----------
    frequency_rad_s
        Frequency of the base motion [rad/s].
    rms_x_top_m
        RMS displacement of the top, shape (starts,) [m].
    error_m
        Largest standard error of these values [m].
    """

    frequency_rad_s: float
    rms_x_top_m: FloatArray
    error_m: float

    @property
    def matter(self) -> bool:
        """Whether the response depends on the start."""
        difference = float(np.ptp(self.rms_x_top_m))
        return math.isfinite(difference) and difference > max(
            DIFFERENT * float(np.max(self.rms_x_top_m)), ERRORS * self.error_m
        )

    @property
    def sentence(self) -> str:
        """A sentence for the user; empty where the start does not matter."""
        if not self.matter:
            return ""
        low, high = 1e3 * np.min(self.rms_x_top_m), 1e3 * np.max(self.rms_x_top_m)
        return (
            f"the response of the best design depends on its start: at {self.frequency_rad_s:.2f} rad/s the RMS top "
            f"displacement is {low:.3g} to {high:.3g} mm from {self.rms_x_top_m.size} phases of the base motion. The "
            "curves of the design contain only the response from one of them"
        )


def other_starts(run: Run, found: Evaluation, options: CurveOptions) -> OtherStarts:
    """Run an evaluated design at its resonance and largest amplitude from all phases.

    Parameters
    ----------
    run
        The loop at the gains of the design.
    found
        The design with its response curves.
    options
        Options of these curves.
    """
    curve, column = found.curves[-1], QUANTITIES.index("rms_x_top_m")
    omega = curve.resonance_rad_s
    phases = 2.0 * math.pi * np.arange(STARTS) / STARTS
    steady = [steady_values(run, curve.base_amplitude_m_s2, omega, options, phase_rad=float(phase)) for phase in phases]
    values = np.array([item.values[column] for item in steady])
    return OtherStarts(omega, values, max(float(item.errors[column]) for item in steady))


@dataclass(frozen=True)
class Confirmation:
    """The best design and calibrated gains, run again at half the step with other sensor noise.

    Attributes
    ----------
    design
        The best design.
    calibrated
        The best law at its calibrated gains.
    same_law
        The law of the best design at its calibrated gains.
    starts
        The best design from several starts.
    """

    design: Evaluation
    calibrated: Evaluation
    same_law: Evaluation
    starts: OtherStarts

    def improvement(self, quantity: str) -> float:
        """Return the relative reduction of the largest value of a quantity against the best calibrated gains [1]."""
        return 1.0 - self.design.peaks[quantity] / self.calibrated.peaks[quantity]


def confirmed(
    run_of: LoopOf, found: Sequence[Designed], load: Load, objective: Objective, final: CurveOptions, jobs: int
) -> Confirmation:
    """Run the best design and calibrated gains at half the step with other sensor noise.

    Parameters
    ----------
    run_of
        The loops of the design.
    found
        Result of each law.
    load, objective
        Load and objective of the design.
    final
        Options of the accurate response curves.
    jobs
        Threads; the result does not depend on their number.
    """
    chosen = min(found, key=lambda item: item.best.value)
    calibrated = min((item.calibrated for item in found), key=lambda item: item.value)
    finer = replace(run_of.at_rate(CONFIRMING_RATE), seed=run_of.seed + 1)
    wanted = {(item.law, item.gains): item for item in (chosen.best, calibrated, chosen.calibrated)}
    runner = Parallel(n_jobs=max(1, jobs), backend="threading")
    again = runner(delayed(evaluate)(finer, law, gains, load, objective, final) for law, gains in wanted)
    known = dict(zip(wanted, again, strict=True))
    design, common, same_law = (known[item.law, item.gains] for item in (chosen.best, calibrated, chosen.calibrated))
    return Confirmation(design, common, same_law, other_starts(finer(design.law, design.gains), design, final))


def doubts(found: Confirmation, plant: Plant) -> list[str]:
    """Return what a user should know before the best design is used, one sentence each.

    Parameters
    ----------
    found
        The confirmed design.
    plant
        Structure with the static stiffness at its damper.
    """
    law, limit = found.design.law, plant.static_stiffness_n_m
    negative = law_named(law).negative_stiffness(found.design.gains)
    lines = [found.starts.sentence] if found.starts.matter else []
    if negative > limit:
        lines.append(
            f"the best design, {law}, has a negative stiffness of {-negative:.0f} N/m, which is beyond the static "
            f"limit of {-limit:.0f} N/m at the damper: only the clipping of the force keeps the structure stable"
        )
    return lines
