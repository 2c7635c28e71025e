"""One verdict on a structure's campaign, from the residuals of the frame, of the command and of the damper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns.model import Campaign
from mrpipe.effects.contract import Effect
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.errors import UserError
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.completion import completed
from mrpipe.tracing.structure.directions import directions_of, in_direction
from mrpipe.tracing.structure.parts import Part, command_part, damper_part, merged
from mrpipe.tracing.structure.records import FASTEST_HZ, FrameData, frame_data
from mrpipe.tracing.structure.scores import residual_in_time
from mrpipe.tracing.structure.trace import FrameTracing, trace_frame
from mrpipe.words import in_percent


@dataclass(frozen=True)
class History:
    """An array of the artifact, with its unit and axes."""

    values: FloatArray
    unit: str
    dims: tuple[str, ...]


TURNING = (
    "each direction is traced by itself; the rotation of the floors about the vertical, which the sensors measure, is "
    "part of its linear frame"
)
"""Note in the result on structures whose sensors measure the rotation of all floors."""

UNCOUPLED = (
    "each direction is traced by itself: forces that couple the directions, such as torsion, are not modelled; they "
    "count as unexplained, and an effect may imitate them"
)
"""Note in the result on structures whose sensors measure in several directions."""


@dataclass(frozen=True)
class StructureTracing:
    """Result of tracing a structure's campaign.

    Attributes
    ----------
    summary
        The JSON of docs/close-loop-json.md.
    histories
        Name in the artifact -> array.
    maps
        Training records before any effect: (storey, drift [m], drift rate [m/s], residual shear force [N]).
    shown
        Validation records: (test, storey, time [s], measured, before, after), with residual shear forces [N].
    findings
        Messages for the user, one line each.
    """

    summary: dict[str, Any]
    histories: dict[str, History] = field(default_factory=dict)
    maps: list[tuple[int, FloatArray, FloatArray, FloatArray]] = field(default_factory=list)
    shown: list[tuple[str, int, FloatArray, FloatArray, FloatArray, FloatArray]] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)


def trace_structure(
    campaigns: Sequence[Campaign],
    effects: Mapping[str, StructuralEffect],
    damper_effects: Mapping[str, Effect],
    options: TracingOptions,
    *,
    rng: np.random.Generator,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> StructureTracing:
    """Trace the residuals of a structure's recordings: of the frame, of the command, and of the damper.

    Parameters
    ----------
    campaigns
        Campaigns of the same rig.
    effects, damper_effects
        The libraries of effects of a structure and of a damper.
    options
        Options of the tracing.
    rng
        Source of randomness.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share done and a text.
    """
    rules = options.rules
    campaign, names = campaigns[0], campaigns[0].declared_effects
    declared = [effects[name] for name in names if name in effects]
    library = [item for item in effects.values() if item not in declared]
    by_direction, findings = _by_direction(campaigns, options.fit_rate_hz, progress)
    frames: dict[str, FrameTracing] = {}
    for axis, data in by_direction.items():
        findings += [f"test {name} does not record every floor: it is not used for the frame" for name in data.left_out]
        findings += data.notes
        if all(item.role == "validation" for item in data.records):
            continue
        frames[axis] = trace_frame(
            data, library, declared, options, rules.frame, rules.validation, most=options.most_effects,
            draws=options.bootstrap_draws, rng=rng, jobs=jobs, progress=progress,
        )  # fmt: skip
        findings += _findings(frames[axis], axis, rules.frame)
    parts: list[Part | None] = [_part_of(frame, axis) for axis, frame in frames.items()]
    loops = next(iter(by_direction.values())).loops
    parts.append(command_part(loops, effects, names, rules.delay, options.most_confidence))
    parts.append(
        damper_part(
            loops, campaign, damper_effects, effects.get("brace-flexibility"), options, rules, rng=rng, jobs=jobs,
            progress=progress,
        )
    )  # fmt: skip
    found = [item for item in parts if item is not None]
    if not found:
        raise UserError(
            campaign.file, "tests", "no test can be judged, because floors or drive are missing",
            "record the acceleration of every floor; or damper_force, drive and the motion of floor 1",
        )  # fmt: skip
    summary = {"campaign": campaign.name, **merged(found), "declared_effects": list(names)}
    about, said = _on_directions(frames, campaigns)
    return _with_drawings(StructureTracing(summary | about, findings=findings + said), frames)


def _part_of(frame: FrameTracing, axis: str) -> Part:
    return Part(f"frame {axis}".strip(), frame.summary)


def _findings(frame: FrameTracing, axis: str, rules: FrameRules) -> list[str]:
    """Return the findings on the frame in one direction, which is named if there are several."""
    if not axis:
        return _lines(frame, rules)
    found = [f"direction {axis}: {line}" for line in _lines(frame, rules)]
    if _part_of(frame, axis).unexplained:
        found.append(f"direction {axis} has an unexplained part, which coupling with other directions may cause")
    return found


def _on_directions(
    frames: Mapping[str, FrameTracing], campaigns: Sequence[Campaign]
) -> tuple[dict[str, Any], list[str]]:
    """Return what the summary says of several directions, and the findings; nothing if there is one direction."""
    directions = [axis for axis in frames if axis]
    if not directions:
        return {}, []
    coupled = all(frames[axis].problem.training[0].record.turns for axis in directions)
    said = TURNING if coupled else UNCOUPLED
    findings = [said]
    if any("damper_force" in test.channels for item in campaigns for test in item.recordings):
        findings.append("the damper is not traced, because the sensors of the structure measure in directions")
    return {"directions": {"traced": directions, "coupling_modelled": coupled, "statement": said}}, findings


def _with_drawings(traced: StructureTracing, frames: Mapping[str, FrameTracing]) -> StructureTracing:
    """Return the tracing with the histories of all directions; its drawings show the one that decides the verdict."""
    if not frames:
        return traced
    histories = {
        f"{axis}/{key}".strip("/"): item for axis, frame in frames.items() for key, item in _histories(frame).items()
    }
    axis = traced.summary["part"].removeprefix("frame").strip()
    drawn = frames.get(axis, next(iter(frames.values())))
    return replace(traced, histories=histories, maps=_maps(drawn), shown=_shown(drawn))


def _lines(frame: FrameTracing, rules: FrameRules) -> list[str]:
    lines = [frame.between.finding()] if frame.between.drifts else []
    summary = frame.summary
    error = float(summary["before"]["nrmse"])
    if not summary["effects"] and summary["unexplained"]["structured"] and error > rules.unlikely_error:
        lines.append(
            f"a linear frame misses {in_percent(error)} of the storey forces, and no effect explains it. So large an "
            "error often comes from the sign, the unit or the floor of a channel: see what mrpipe identify-frame finds"
        )
    return lines


def _by_direction(
    campaigns: Sequence[Campaign], rate_hz: float, progress: Progress
) -> tuple[dict[str, FrameData], list[str]]:
    """Return the records by axis, with an empty name where the structure moves in one direction, and findings."""
    axes = sorted({axis for item in campaigns for axis in directions_of(item)})
    if not axes:
        whole, findings = _completed(campaigns, progress)
        return {"": joined_data(whole, rate_hz)}, findings
    found, findings = {}, []
    for axis in axes:
        own = [part for item in campaigns if (part := in_direction(item, axis)) is not None]
        if own and any(test.role == "validation" for item in own for test in item.recordings):
            whole, lines = _completed(own, progress)
            found[axis] = joined_data(whole, rate_hz)
            findings += [f"direction {axis}: {line}" for line in lines]
        else:
            findings.append(f"direction {axis} is not traced: no validation test has a measured excitation along it")
    if not found:
        raise UserError(
            campaigns[0].file,
            "channels",
            "no validation test has a measured excitation along one of its sensors",
            f"give {' or '.join(f'ground_acceleration_{axis}' for axis in axes)}",
        )
    return found, findings


def _completed(campaigns: Sequence[Campaign], progress: Progress) -> tuple[list[Campaign], list[str]]:
    """Return the campaigns with the computed motion of floors without a sensor, and messages on it."""
    found = [completed(item, progress) for item in campaigns]
    return [item for item, _ in found], [line for _, lines in found for line in lines]


def joined_data(campaigns: Sequence[Campaign], rate_hz: float = FASTEST_HZ) -> FrameData:
    """Return the recordings of several campaigns of one rig, decimated to about `rate_hz`."""
    parts = [frame_data(item, rate_hz) for item in campaigns]
    masses = next((item.masses_kg for item in parts if item.masses_kg.size), np.zeros(0))
    return FrameData(
        masses,
        tuple(record for item in parts for record in item.records),
        tuple(record for item in parts for record in item.loops),
        tuple(name for item in parts for name in item.left_out),
        parts[0].source,
        tuple(line for item in parts for line in item.notes),
    )


def _histories(frame: FrameTracing) -> dict[str, History]:
    found = {}
    for record in frame.problem.judged_validation:
        for when, model in (("before", frame.before), ("after", frame.after)):
            found[f"validation/{record.record.name}/residual_{when}"] = History(
                residual_in_time(model, record), "N", ("sample", "storey")
            )
        motion = record.motion
        found[f"validation/{record.record.name}/drift"] = History(motion.drift.T.copy(), "m", ("sample", "storey"))
    return found


def _maps(frame: FrameTracing) -> list[tuple[int, FloatArray, FloatArray, FloatArray]]:
    residual = np.concatenate([residual_in_time(frame.before, item) for item in frame.problem.judged])
    drift = np.concatenate([item.motion.drift for item in frame.problem.training], axis=1)
    rate = np.concatenate([item.motion.drift_rate for item in frame.problem.training], axis=1)
    return [(k + 1, drift[k], rate[k], residual[:, k]) for k in range(residual.shape[1])]


def _shown(frame: FrameTracing) -> list[tuple[str, int, FloatArray, FloatArray, FloatArray, FloatArray]]:
    where = frame.summary["residual"]["where"]
    storey = max(range(len(where)), key=lambda k: list(where.values())[k])
    found = []
    for record in frame.problem.judged_validation[:3]:
        time = np.arange(len(record.taper), dtype=np.float64) * record.record.dt
        shear = record.motion.acceleration @ (np.triu(np.ones((len(where),) * 2)) * frame.problem.masses_kg).T
        before, after = (residual_in_time(model, record)[:, storey] for model in (frame.before, frame.after))
        found.append((record.record.name, storey + 1, time, shear[:, storey], before, after))
    return found
