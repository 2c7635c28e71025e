"""The verdicts on the parts of a rig (frame, controller command, damper), each with its part of the JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import Progress
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.effects.contract import Effect
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.tracing.options import NamingRules, TracingOptions
from mrpipe.tracing.rules import BraceRules, DelayRules, TracingRules
from mrpipe.tracing.structure.damper import BraceFinding, find_brace, prepared_loops, trace_damper
from mrpipe.tracing.structure.delay import DelayFinding, drive_lag, law_lag
from mrpipe.tracing.structure.loop import bench_of, loop_signals
from mrpipe.tracing.verdict import Candidate, Estimate, Interval, NamedEffect, Unexplained, Verdict

OF_PART = (
    "model", "quantity", "verdict", "verdict_class", "noise_floor_nrmse", "before", "after", "effects", "candidates",
    "tied",
)  # fmt: skip
"""Keys of a part that the joint verdict repeats under `parts`."""

COMMAND_QUANTITY = (
    "drive from desired force and motion, or desired force from motion, whichever is late, over its spread"
)
DAMPER_QUANTITY = "damper force from the motion of floor 1 (or of its rod) and the drive, over its RMS"


@dataclass(frozen=True)
class Part:
    """One part of the rig.

    Attributes
    ----------
    name
        `frame`, `command` or `damper`.
    summary
        Keys of docs/close-loop-json.md.
    """

    name: str
    summary: dict[str, Any]

    @property
    def named(self) -> bool:
        """Whether an effect is named."""
        return bool(self.summary["effects"])

    @property
    def unexplained(self) -> bool:
        """Whether something is missing and no effect is named for it."""
        return bool(self.summary["unexplained"]["structured"])


def command_part(
    loops: Sequence[Recording],
    effects: Mapping[str, StructuralEffect],
    declared: Sequence[str],
    rules: DelayRules | None = None,
    most_confidence: float = NamingRules().most_confidence,
) -> Part | None:
    """Return the verdict on the controller's command; None if no test records desired force, drive and motion."""
    effect = effects.get("controller-delay")
    signals = loop_signals(loops)
    if effect is None or effect.name in declared or not signals:
        return None
    laws = {item.name: str(item.details.get("law", "")) for item in loops}
    found = [item for item in (drive_lag(signals, rules), law_lag(signals, laws, rules)) if item is not None]
    if not found:
        return None
    late = [item for item in found if item.late]
    worst = max(late or found, key=lambda item: item.before / max(item.after, 1e-12))
    return Part("command", _command_summary(worst, found, effect, most_confidence))


def _command_summary(
    worst: DelayFinding, found: Sequence[DelayFinding], effect: StructuralEffect, most: float
) -> dict[str, Any]:
    share = 1.0 - (worst.after / max(worst.before, 1e-12)) ** 2
    named: list[NamedEffect] = []
    if worst.late:
        interval = Interval(*worst.delay_interval_s)
        named.append(
            NamedEffect(
                effect.name,
                worst.part,
                {"time": Estimate(worst.delay_s, "s", interval)},
                round(float(np.clip(share, 0.0, most)), 3),
                effect.physics,
                effect.remedy,
                effect.source,
                "controller",
                "controller",
            )
        )
    sentence = f"{effect.name}: explains what is missing" if named else "command and motion agree"
    return {
        "model": "controller-as-declared",
        "quantity": COMMAND_QUANTITY,
        "noise_floor_nrmse": worst.after,
        "noise_from": "error at the best shift of the clock",
        "before": _score(worst.before),
        "residual": {"structured": worst.late, "p_value": 0.0 if worst.late else 1.0, "where": {}},
        "base_form": {
            "name": "controller-as-declared", "best": "controller-as-declared",
            "nrmse": {"controller-as-declared": worst.before},
        },
        "nuisances": {"gain": {}, "channel_skew_s": 0.0, "observation_filter_s": 0.0},
        "effects": [item.as_json() for item in named],
        **Verdict("explained" if named else "noise", sentence).sentence_as_json(),
        "candidates": [_candidate(item, effect).as_json() for item in found],
        "after": _score(worst.after if named else worst.before),
        "ceiling": {"nrmse": worst.after, "recovered": 1.0 if named else 0.0},
        "unexplained": Unexplained(False).as_json(),
        "tests": [],
    }  # fmt: skip


def _candidate(item: DelayFinding, effect: StructuralEffect) -> Candidate:
    share = 1.0 - (item.after / max(item.before, 1e-12)) ** 2
    return Candidate(effect.name, item.part, item.after, item.before / item.after, share, lag_s=item.lag_s)


def damper_part(
    loops: Sequence[Recording],
    campaign: Campaign,
    effects: Mapping[str, Effect],
    brace: StructuralEffect | None,
    options: TracingOptions,
    rules: TracingRules,
    *,
    rng: np.random.Generator,
    jobs: int,
    progress: Progress,
) -> Part | None:
    """Return the verdict on the damper at floor 1; None if motion, drive and force are not all recorded."""
    bench = bench_of(loops, campaign.directory, campaign.name, campaign.drive_unit)
    if bench is None:
        return None
    tests = prepared_loops(bench, rules.brace)
    declared = [effects[name] for name in campaign.declared_effects if name in effects]
    measured = any("damper_displacement" in item.channels for item in loops)
    found = None
    if brace is not None and not measured and brace.name not in campaign.declared_effects:
        found = find_brace(tests, options, declared, rules.brace)
    if found is not None and found.strong(rules.brace):
        # with a rigid brace the residual is far above the noise: judge rival effects, one at a time, relative to the
        # residual with the flexible brace
        share = max(options.model_error_share, found.nrmse_after)
        options = options.changed(model_error_share=share, most_effects=1)
    summary = dict(trace_damper(tests, effects, declared, options, rng=rng, jobs=jobs, progress=progress).summary)
    summary["quantity"] = DAMPER_QUANTITY
    most = (1.0 + rules.frame.of_floor) * summary["noise_floor_nrmse"]
    if not summary["effects"] and summary["before"]["nrmse"] <= most:
        _nothing_that_matters(summary)
    if brace is not None and found is not None:
        _with_brace(summary, found, brace, options, rules.brace)
    return Part("damper", summary)


def _nothing_that_matters(summary: dict[str, Any]) -> None:
    """Change a verdict to 'nothing is missing', if the error exceeds the noise by too little to matter."""
    if summary["residual"]["structured"]:
        sentence = "the residual exceeds the noise by too little to matter: nothing is missing"
        summary |= Verdict("noise", sentence).sentence_as_json()
    summary["residual"] = {**summary["residual"], "structured": False}
    summary["unexplained"] = Unexplained(False).as_json()


def _with_brace(
    summary: dict[str, Any],
    found: BraceFinding,
    effect: StructuralEffect,
    options: TracingOptions,
    brace_rules: BraceRules,
) -> None:
    """Add the brace to the candidates, and name it if it explains more than any effect of the damper."""
    rules = options
    share = float(np.clip(found.share, 0.0, 1.0)) if found.compliance_m_n > 0.0 else 0.0
    entry = Candidate(effect.name, "spring", found.nrmse_after, found.rigid / found.chi_square, share).as_json()
    summary["candidates"] = sorted([*summary["candidates"], entry], key=lambda item: -item["share"])
    better = found.nrmse_after < min([summary["after"]["nrmse"], brace_rules.better * found.nrmse_before])
    if not summary["residual"]["structured"] or share < rules.least_share or not better:
        return
    rivals = [
        item["name"] for item in summary["candidates"] if item is not entry and item["share"] > share - rules.lead
    ]
    interval = Interval(*found.interval, "equivalent", None)
    named = NamedEffect(
        effect.name,
        "spring",
        {"compliance": Estimate(found.compliance_m_n, "m/N", interval)},
        round(rules.most_confidence * min(1.0, share / rules.named_share) * (0.5 if rivals else 1.0), 3),
        effect.physics,
        effect.remedy,
        effect.source,
        "plant",
        "damper",
        tuple(rivals),
    )
    summary["effects"] = [named.as_json()]
    whole = share >= rules.named_share
    sentence = f"{effect.name}: explains {'' if whole else 'part of '}what is missing"
    summary |= Verdict("explained" if whole else "partly explained", sentence, share).sentence_as_json()
    summary["before"], summary["after"] = _score(found.nrmse_before), _score(found.nrmse_after)
    summary["unexplained"] = Unexplained(not whole, 1.0 - share).as_json()


def _score(nrmse: float) -> dict[str, float]:
    return {"nrmse": nrmse, "fit_percent": 100.0 * (1.0 - nrmse)}


def merged(parts: Sequence[Part]) -> dict[str, Any]:
    """Return one verdict: that of the first part that names an effect, with the effects of all parts."""
    order = sorted(parts, key=lambda part: (not part.named, not part.unexplained))
    first = order[0]
    summary = dict(first.summary)
    summary["part"] = first.name
    summary["effects"] = [effect for part in order for effect in part.summary["effects"]]
    summary["verdict"] = "; ".join(f"{part.name}: {part.summary['verdict']}" for part in order)
    if not first.named:
        open_part = next((part for part in order if part.unexplained), first)
        summary["unexplained"] = open_part.summary["unexplained"]
    # only the frame can have effects that are tied
    summary["tied"] = next((part.summary["tied"] for part in order if part.summary.get("tied")), None)
    own = {part.name: {"tied": None, **part.summary} for part in parts}
    summary["parts"] = {name: {key: values[key] for key in OF_PART} for name, values in own.items()}
    return summary
