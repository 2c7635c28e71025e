"""One verdict on a structure's campaign: the frame's own residual, the command's, and the damper's seen through it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns.model import Campaign
from mrpipe.discrepancy.frame_records import FrameData, frame_data
from mrpipe.discrepancy.frame_scores import residual_in_time
from mrpipe.discrepancy.frame_tracing import FrameTracing, trace_frame
from mrpipe.discrepancy.verdict import Rules
from mrpipe.effects.structural.contract import StructuralEffect


class LoopSettings(Protocol):
    """What of the stage's settings is read here."""

    most_effects: int
    bootstrap_draws: int


@dataclass(frozen=True)
class History:
    """An array for the artifact."""

    values: FloatArray
    unit: str
    dims: tuple[str, ...]


@dataclass(frozen=True)
class StructureTracing:
    """What was found.

    Attributes
    ----------
    summary
        The JSON of contract section 4.
    histories
        Name in the artifact -> array.
    maps
        (storey, drift [m], rate [m/s], residual shear force [N]) of the training records, before any effect.
    shown
        (test, storey, time [s], measured, before, after) of validation records: residual shear forces [N].
    """

    summary: dict[str, Any]
    histories: dict[str, History] = field(default_factory=dict)
    maps: list[tuple[int, FloatArray, FloatArray, FloatArray]] = field(default_factory=list)
    shown: list[tuple[str, int, FloatArray, FloatArray, FloatArray, FloatArray]] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)


def trace_structure(
    campaigns: Sequence[Campaign],
    effects: Mapping[str, StructuralEffect],
    rules: Rules,
    settings: LoopSettings,
    *,
    rng: np.random.Generator,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> StructureTracing:
    """Trace what a structure's recordings lack.

    Parameters
    ----------
    campaigns
        Of one and the same rig.
    effects
        The library of structural effects.
    """
    data = joined_data(campaigns)
    findings = [f"test {name} does not record every floor: it is not judged for the frame" for name in data.left_out]
    declared = [effects[name] for name in campaigns[0].declared_effects if name in effects]
    library = [item for item in effects.values() if item not in declared]
    frame = trace_frame(
        data, library, declared, rules, most=settings.most_effects, draws=settings.bootstrap_draws, rng=rng, jobs=jobs,
        progress=progress,
    )  # fmt: skip
    summary = {"campaign": campaigns[0].name, **frame.summary}
    return StructureTracing(summary, _histories(frame), _maps(frame), _shown(frame), findings)


def joined_data(campaigns: Sequence[Campaign]) -> FrameData:
    """Return the recordings of several campaigns of one rig."""
    parts = [frame_data(item) for item in campaigns]
    masses = next((item.masses_kg for item in parts if item.masses_kg.size), np.zeros(0))
    return FrameData(
        masses,
        tuple(record for item in parts for record in item.records),
        tuple(record for item in parts for record in item.loops),
        tuple(name for item in parts for name in item.left_out),
    )


def _histories(frame: FrameTracing) -> dict[str, History]:
    found = {}
    for record in frame.problem.validation:
        for when, model in (("before", frame.before), ("after", frame.after)):
            found[f"validation/{record.record.name}/residual_{when}"] = History(
                residual_in_time(model, record), "N", ("sample", "storey")
            )
        motion = record.motion
        found[f"validation/{record.record.name}/drift"] = History(motion.drift.T.copy(), "m", ("sample", "storey"))
    return found


def _maps(frame: FrameTracing) -> list[tuple[int, FloatArray, FloatArray, FloatArray]]:
    residual = np.concatenate([residual_in_time(frame.before, item) for item in frame.problem.training])
    drift = np.concatenate([item.motion.drift for item in frame.problem.training], axis=1)
    rate = np.concatenate([item.motion.drift_rate for item in frame.problem.training], axis=1)
    return [(k + 1, drift[k], rate[k], residual[:, k]) for k in range(residual.shape[1])]


def _shown(frame: FrameTracing) -> list[tuple[str, int, FloatArray, FloatArray, FloatArray, FloatArray]]:
    where = frame.summary["residual"]["where"]
    storey = max(range(len(where)), key=lambda k: list(where.values())[k])
    found = []
    for record in frame.problem.validation[:3]:
        time = np.arange(len(record.taper), dtype=np.float64) * record.record.dt
        shear = record.motion.acceleration @ (np.triu(np.ones((len(where),) * 2)) * frame.problem.masses_kg).T
        before, after = (residual_in_time(model, record)[:, storey] for model in (frame.before, frame.after))
        found.append((record.record.name, storey + 1, time, shear[:, storey], before, after))
    return found
