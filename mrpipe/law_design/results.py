"""A design as JSON and as an artifact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mrpipe.artifacts import ArtifactWriter
from mrpipe.control.laws import law_named
from mrpipe.law_design.objective import Evaluation
from mrpipe.law_design.study import Designed, Study
from mrpipe.law_design.uncertainty import Ranking, test_for

MOST_SENSITIVITIES = 5
"""Uncertain quantities that are listed."""


def law_as_json(found: Designed) -> dict[str, Any]:
    """Return what was found for one law."""
    law = law_named(found.entry.law)
    best, calibrated = found.best, found.calibrated
    return {
        "gains": law.gains_as_json(best.gains),
        **{f"peak_{name}": value for name, value in best.peaks.items()},
        "resonance_rad_s": best.resonance_rad_s,
        "objective": best.value,
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


def study_as_json(
    study: Study,
    free: Mapping[str, Designed],
    front: Sequence[Evaluation],
    ranking: Ranking | None,
    weights: Mapping[str, float],
) -> dict[str, Any]:
    """Return what `mrpipe design --json` prints, but for times.

    Parameters
    ----------
    study
        The laws in the race.
    free
        Law -> the same law with all gains free, where some are fixed in the race.
    front
        Pareto front.
    ranking
        Under uncertainty; None without draws.
    weights
        Of the objective.
    """
    laws = {}
    for label, found in study.designed.items():
        laws[label] = law_as_json(found)
        laws[label]["probability_best"] = None if ranking is None else ranking.probability_best[label]
        if found.entry.law in free:
            laws[label]["unrestricted"] = law_as_json(free[found.entry.law])
    summary: dict[str, Any] = {
        "objective": " + ".join(f"{weight:g} x largest {name}" for name, weight in weights.items())
        + ", relative to law vd at its calibrated gains",
        "weights": dict(weights),
        "best": study.best,
        "laws": laws,
        "pareto": [point_as_json(item) for item in front],
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
    return summary


def write_design(artifact: ArtifactWriter, study: Study, summary: Mapping[str, Any]) -> None:
    """Write gains and response curves of every law, and the summary."""
    for label, found in study.designed.items():
        group = f"laws/{label}"
        artifact.put_json(f"{group}/gains", dict(found.best.gains))
        for number, curve in enumerate(found.best.curves, start=1):
            inner = f"{group}/amplitude_{number}"
            artifact.put(f"{inner}/base_amplitude", curve.base_amplitude_m_s2, unit="m/s^2")
            artifact.put(f"{inner}/frequency", curve.frequency_rad_s, unit="rad/s", dims=("frequency",))
            artifact.put(f"{inner}/rms_x_top", curve.column("rms_x_top_m"), unit="m", dims=("frequency",))
            artifact.put(f"{inner}/rms_a_top", curve.column("rms_a_top_m_s2"), unit="m/s^2", dims=("frequency",))
    artifact.put_json("summary", dict(summary))
    artifact.attributes("/", best=study.best)
