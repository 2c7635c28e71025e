"""Design of several dampers: factors on the gains of all dampers whose largest response is smallest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named
from mrpipe.law_design.confirmation import OtherStarts, other_starts
from mrpipe.law_design.kept import Designed, LawUnderDesign
from mrpipe.law_design.objective import Evaluation, Limits, Load, Objective, RunOf, evaluate
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.results import starts_as_json
from mrpipe.law_design.run import accurate_curves
from mrpipe.law_design.search import FreeGain, simplex_search
from mrpipe.law_design.study import COARSE, reference_evaluation
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import Response
from mrpipe.simulation.several_dampers_rig import DampersRig
from mrpipe.simulation.steady_state import Run

TOGETHER = "dampers"
"""Name of the set of all dampers where functions for a single law need the name of a law."""

FACTORS = (0.1, 10.0)
"""Smallest and largest factor on the calibrated gain of a damper."""

TOLERANCE = 0.02
"""Accuracy of the logarithm of a factor at which the search ends."""

FIRST_STEP = -0.5
"""First step of the logarithm of a factor. It is downwards, because a real damper saturates above."""


@dataclass(frozen=True)
class DampersDesign:
    """Result of a design of several dampers.

    Attributes
    ----------
    designed
        Best and calibrated evaluation; their gains are factors by the names of the dampers.
    reference
        Calibrated evaluation that scales the objective.
    starts
        The best design from several starts.
    limits
        Limits of the design; each holds for every damper.
    """

    designed: Designed
    reference: Evaluation
    starts: OtherStarts
    limits: Limits


def design_dampers(
    rig: DampersRig, settings: DesignSettings, load: Load, *, absolute: bool, seed: int
) -> DampersDesign:
    """Search factors on the tuned gains of all dampers together.

    The objective is that of a single law: the weighted largest responses over band, amplitudes and motions, relative to
    those at the calibrated gains. Stroke, force and drive are each that of the damper where it is largest.

    Parameters
    ----------
    rig, settings, load
        Rig whose dampers are designed, settings of the design, and its load.
    absolute
        Whether accelerations are absolute.
    seed
        Seed of the sensor noise, which is the same in all runs.

    Raises
    ------
    DivergedError
        If the loop is unstable at the calibrated gains.
    """
    free = tuple(
        FreeGain(item.known.name, *FACTORS)
        for item in rig.dampers
        if law_named(item.known.law).tuned_gain and any(item.gains.values())
    )
    start = Gains(**{gain.name: 1.0 for gain in free})
    final = accurate_curves(settings, absolute=absolute)
    run_of = _runs(rig, seed)
    reference = reference_evaluation(run_of, TOGETHER, start, load, final)
    objective = Objective(settings.weights, reference.peaks, Limits.of(settings))
    entry = LawUnderDesign(TOGETHER, start, free, TOGETHER)
    tried: list[Evaluation] = []
    coarse = replace(COARSE, absolute=absolute, refined=tuple(settings.weights))
    searched = replace(load, amplitudes_m_s2=(max(load.amplitudes_m_s2),))

    def value(logarithms: FloatArray) -> float:
        factors = {gain.name: float(part) for gain, part in zip(free, np.exp(logarithms), strict=True)}
        tried.append(evaluate(run_of, TOGETHER, Gains(**factors), searched, objective, coarse))
        return tried[-1].value

    calibrated = replace(reference, value=objective.value(reference.peaks))
    best = calibrated
    if free:
        _search(value, len(free), settings.evaluations)
        found = min(tried, key=lambda item: item.value)
        best = evaluate(run_of, TOGETHER, found.gains, load, objective, final)
    # the accurate curves decide; the search used coarse ones
    best = min(best, calibrated, key=lambda item: item.value)
    starts = other_starts(run_of(TOGETHER, best.gains), best, final)
    return DampersDesign(Designed(entry, best, calibrated, tuple(tried)), reference, starts, objective.limits)


def _search(value: Callable[[FloatArray], float], count: int, evaluations: int) -> None:
    """Minimise a function of the logarithms of the factors, from the calibrated gains on.

    The calibration is the joint optimum of the linear equivalents, so that no grid is needed before the local search; a
    grid would grow with a power of the number of dampers.
    """
    low, high = np.log(FACTORS)
    steps = np.full(count, FIRST_STEP)
    simplex_search(value, np.zeros(count), steps, [(low, high)] * count, TOLERANCE, evaluations * count)


def _runs(rig: DampersRig, seed: int) -> RunOf:
    def run_of(_: str, factors: Gains) -> Run:
        dampers = rig.loop_dampers(factors)

        def run(excitation: Excitation) -> Response:
            return rig.run(excitation, dampers, rng=np.random.default_rng(seed)).together

        return run

    return run_of


def design_as_json(rig: DampersRig, found: DampersDesign) -> dict[str, Any]:
    """Return what `mrpipe design --json` prints for several dampers."""
    best, calibrated = found.designed.best, found.designed.calibrated
    dampers: dict[str, Mapping[str, Any]] = {}
    for item, gains in zip(rig.dampers, rig.gains(best.gains), strict=True):
        law = law_named(item.known.law)
        dampers[item.known.name] = {
            "law": law.name,
            "factor": best.gains.get(item.known.name, 1.0),
            "gains": law.gains_as_json(gains),
            "calibrated_gains": law.gains_as_json(item.gains),
        }
    return {
        "dampers": dampers,
        "best": _evaluation(best),
        "calibrated": _evaluation(calibrated),
        "improvement": 1.0 - best.value / calibrated.value,
        "exceeds_limits": found.limits.exceeded(best.peaks),
        "evaluations": len(found.designed.tried),
        "starts": starts_as_json(found.starts),
        "curves": {
            name: {
                "frequency_rad_s": item.curves[-1].frequency_rad_s.tolist(),
                "rms_x_top_m": item.curves[-1].column("rms_x_top_m").tolist(),
            }
            for name, item in (("best gains", best), ("calibrated gains", calibrated))
        },
    }


def _evaluation(item: Evaluation) -> dict[str, Any]:
    return {
        **{f"peak_{name}": value for name, value in item.peaks.items()},
        "resonance_rad_s": item.resonance_rad_s,
        "objective": item.value,
        "motions": {name: dict(values) for name, values in item.motions.items()},
    }
