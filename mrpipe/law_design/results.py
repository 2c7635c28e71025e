"""A design as JSON and as an artifact."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from mrpipe.artifacts import ArtifactWriter
from mrpipe.control.laws import law_named
from mrpipe.law_design.confirmation import Confirmation, OtherStarts
from mrpipe.law_design.kept import Designed
from mrpipe.law_design.objective import Evaluation, Limits
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.run import Result
from mrpipe.law_design.uncertainty import test_for
from mrpipe.simulation.storage import write_curves

MOST_SENSITIVITIES = 5
"""Uncertain quantities that are listed."""


def law_as_json(found: Designed, limits: Limits) -> dict[str, Any]:
    """Return what was found for one law; `exceeds_limits` is the excess over each limit that it does not keep [1]."""
    law = law_named(found.entry.law)
    best, calibrated = found.best, found.calibrated
    return {
        "gains": law.gains_as_json(best.gains),
        **{f"peak_{name}": value for name, value in best.peaks.items()},
        "resonance_rad_s": best.resonance_rad_s,
        "objective": best.value,
        "exceeds_limits": limits.exceeded(best.peaks),
        "calibrated": {
            "gains": law.gains_as_json(calibrated.gains),
            **{f"peak_{name}": value for name, value in calibrated.peaks.items()},
            "resonance_rad_s": calibrated.resonance_rad_s,
            "objective": calibrated.value,
        },
        "improvement": 1.0 - best.value / calibrated.value,
        "motions": {name: dict(values) for name, values in best.motions.items()},
        "evaluations": len(found.tried),
    }


def point_as_json(item: Evaluation) -> dict[str, Any]:
    """Return one design of the Pareto front."""
    law = law_named(item.law)
    return {
        "law": item.law,
        "gains": law.gains_as_json(item.gains),
        **{f"peak_{name}": item.peaks[name] for name in ("rms_x_top_m", "rms_a_top_m_s2", "rms_a1_m_s2")},
    }


def design_as_json(result: Result, settings: DesignSettings) -> dict[str, Any]:
    """Return what `mrpipe design --json` prints, without wall-clock times.

    Parameters
    ----------
    result
        Result of the design.
    settings
        Settings of the design.
    """
    ranking, limits, weights = result.ranking, Limits.of(settings), settings.weights
    laws = {}
    for label, found in result.designed.items():
        laws[label] = law_as_json(found, limits)
        laws[label]["probability_best"] = None if ranking is None else ranking.probability_best[label]
        if label in result.free:
            laws[label]["unrestricted"] = law_as_json(result.free[label], limits)
    summary: dict[str, Any] = {
        "objective": " + ".join(f"{weight:g} x largest {name}" for name, weight in weights.items())
        + ", relative to law vd at its calibrated gains",
        "weights": dict(weights),
        "limits": {name: value for name, value in asdict(limits).items() if math.isfinite(value)},
        "best": result.best,
        "laws": laws,
        "pareto": [point_as_json(item) for item in result.front],
        "confirmation": _confirmation_as_json(result.confirmation),
    }
    if ranking is not None:
        listed = list(ranking.sensitivities.items())[:MOST_SENSITIVITIES]
        summary["uncertainty"] = {
            "draws": len(next(iter(ranking.values.values()))),
            "regret": ranking.regret,
            "regret_90_percent": ranking.regret_p90,
            "sensitivities": [
                {"parameter": name, "rank_correlation": value, "test": test_for(name)} for name, value in listed
            ],
        }
    if result.untraced is not None:
        summary["before_tracing"] = {
            "design": point_as_json(result.untraced.design),
            "with_traced_damper": point_as_json(result.untraced.with_traced),
            "regret": result.untraced.regret,
        }
    return summary


def _confirmation_as_json(found: Confirmation) -> dict[str, Any]:
    return {
        "design": point_as_json(found.design),
        "calibrated": point_as_json(found.calibrated),
        "same_law_calibrated": point_as_json(found.same_law),
        "improvement_x_top": found.improvement("rms_x_top_m"),
        "improvement_a_top": found.improvement("rms_a_top_m_s2"),
        "starts": starts_as_json(found.starts),
    }


def starts_as_json(found: OtherStarts) -> dict[str, Any]:
    """Return the response of the best design from several starts."""
    return {
        "frequency_rad_s": found.frequency_rad_s,
        "rms_x_top_m": found.rms_x_top_m.tolist(),
        "differ": found.matter,
    }


def write_design(artifact: ArtifactWriter, result: Result, summary: Mapping[str, Any]) -> None:
    """Write gains and response curves of every law, and the summary."""
    for label, found in result.designed.items():
        artifact.put_json(f"laws/{label}/gains", dict(found.best.gains))
        write_curves(artifact, found.best.curves, f"laws/{label}/")
    for label, found in result.free.items():
        artifact.put_json(f"unrestricted/{label}/gains", dict(found.best.gains))
    artifact.put_json("summary", dict(summary))
    artifact.attributes("/", best=result.best)
