"""Ranking of the laws over a frequency band, by the largest response of every closed loop.

A comparison at one frequency favours a law that moves the resonance away from this frequency. A locked damper, for
example, has a small response at the old resonance and by far the largest one at the new resonance.

A way is a name of an arrangement of the loop, with a damper model and a controller: `before`, `after` or
`recalibrated` (:func:`~mrpipe.tracing.loop.comparison.compare_laws`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from mrpipe.artifacts import Progress, no_progress
from mrpipe.errors import DivergedError
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import Response, simulate_law
from mrpipe.simulation.response_curve import ResponseCurve, response_curve
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.tracing.loop.comparison import (
    Arrangement,
    Bench,
    LoopRun,
    judged_span,
    ranking,
    reversed_pairs,
)
from mrpipe.tracing.rules import LoopRules

OPTIONS = CurveOptions(points=11, tolerance=1e-2, most_cycles=60, frequency_tolerance=5e-3, refined=("rms_x_top_m",))
"""Numerical technique: options of the response curves, whose peaks are accurate to half of `rules.alike`."""


@dataclass(frozen=True)
class Band:
    """Harmonic base motion of one amplitude over a frequency band.

    Attributes
    ----------
    band_rad_s
        Lowest and highest frequency [rad/s].
    amplitude_m_s2
        Amplitude of the base acceleration [m/s^2].
    """

    band_rad_s: tuple[float, float]
    amplitude_m_s2: float


def amplitude_of(run: LoopRun, steady: float = LoopRules().steady) -> float:
    """Return the amplitude [m/s^2] of a harmonic motion with the RMS acceleration of the ground motion of a run.

    Parameters
    ----------
    run
        Run that gives the ground motion.
    steady
        Limits of a steady response, see :class:`~mrpipe.tracing.rules.LoopRules`.
    """
    first, last = judged_span(run.time_s, run.ground_acceleration, steady)
    part = run.ground_acceleration[(run.time_s >= first) & (run.time_s <= last)]
    return float(math.sqrt(2.0) * np.std(part))


def curves_of(
    runs: Sequence[LoopRun],
    ways: Mapping[str, Mapping[str, Arrangement]],
    bench: Bench,
    band: Band,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> dict[str, dict[str, ResponseCurve | None]]:
    """Return law -> way -> response curve; the curve is None if the response grows without bound at some frequency.

    Parameters
    ----------
    runs
        The first run of a law gives its gains.
    ways
        Law -> the ways in which it runs.
    bench, band
        Structure, sensors and base motion.
    jobs
        Threads; the result does not depend on their number.
    progress
        Called with the share of the work that is done (0 to 1).
    """
    first = {law: next(run for run in runs if run.law == law) for law in ways}
    # a way that has two names is run once
    tasks = [(law, way) for law, offered in ways.items() for way in {id(way): way for way in offered.values()}.values()]
    runner = Parallel(n_jobs=max(1, jobs), backend="threading", return_as="generator")
    found: dict[tuple[str, int], ResponseCurve | None] = {}
    curves = runner(delayed(_curve)(first[law], way, bench, band) for law, way in tasks)
    for (law, way), curve in zip(tasks, curves, strict=True):
        found[law, id(way)] = curve
        progress(len(found) / len(tasks), f"response over frequency, {law}")
    return {law: {name: found[law, id(way)] for name, way in offered.items()} for law, offered in ways.items()}


def _curve(run: LoopRun, way: Arrangement, bench: Bench, band: Band) -> ResponseCurve | None:
    controller = way.controller(run)

    def loop(excitation: Excitation) -> Response:
        response = simulate_law(
            bench.frame,
            way.chain,
            controller,
            excitation,
            bench.options,
            position=bench.position,
            rng=np.random.default_rng(bench.seed),
        )
        if np.max(np.abs(response.damper_displacement)) > bench.rules.diverged * bench.tested_stroke_m:
            raise DivergedError(f"law {run.law}: the damper would move far beyond the tested stroke")
        return response

    curve = response_curve(loop, band.amplitude_m_s2, band.band_rad_s, OPTIONS)
    return curve if math.isfinite(curve.peak("rms_x_top_m")) else None


def best_way(curves: Mapping[str, ResponseCurve | None], alike: float = LoopRules().alike) -> str:
    """Return the way with the smallest peak of the top displacement, unless an earlier one is almost as good.

    Parameters
    ----------
    curves
        Way -> response curve, the way with the fewest changes first.
    alike
        Share by which a later way must be better.
    """
    best, least = next(iter(curves)), math.inf
    for name, curve in curves.items():
        if curve is not None and curve.peak("rms_x_top_m") < (1.0 - alike) * least:
            best, least = name, curve.peak("rms_x_top_m")
    return best


def rank_over_band(
    curves: Mapping[str, Mapping[str, ResponseCurve | None]],
    band: Band,
    ways: Sequence[str],
    alike: float = LoopRules().alike,
) -> dict[str, Any]:
    """Return peaks, resonances and the ranking of the laws over the band.

    Parameters
    ----------
    curves
        Law -> way -> response curve.
    band
        Base motion.
    ways
        `before`, `after` and, where the controller was renewed, `recalibrated`.
    alike
        Laws whose responses differ by less than this share are not ranked.
    """
    rows = [
        {"law": law} | {way: _peaks(of_law.get(way)) for way in ways if way in of_law} for law, of_law in curves.items()
    ]
    keyed = [
        {key: _as_ranked(value) if isinstance(value, dict) else value for key, value in row.items()} for row in rows
    ]
    swapped = reversed_pairs(keyed, "before", "after", alike) if "after" in ways else []
    return {
        "over_band": {
            "band_rad_s": list(band.band_rad_s),
            "base_amplitude_m_s2": band.amplitude_m_s2,
            "laws": rows,
        },
        "ranking": {way: ranking(keyed, way) for way in ways},
        "ranking_changes": bool(swapped),
        "reversed_pairs": swapped,
    }


def _peaks(curve: ResponseCurve | None) -> dict[str, Any]:
    return {"diverged": "the response grows without bound"} if curve is None else curve.peaks_as_json()


def _as_ranked(peaks: Mapping[str, Any]) -> dict[str, Any]:
    """Return the peak of the top displacement under the key by which laws are ranked."""
    return {"rms_x_top_m": peaks["peak_rms_x_top_m"]} if "peak_rms_x_top_m" in peaks else dict(peaks)
