"""The whole tracing of a structure: linear frame, residual, effects, errors before and after, verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.errors import UserError
from mrpipe.tracing.bench.verdict import confidence_of
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.candidates import Fitted
from mrpipe.tracing.structure.drift import StiffnessBetweenTests, stiffness_between_tests
from mrpipe.tracing.structure.model import FrameModel, model_of
from mrpipe.tracing.structure.records import FrameData
from mrpipe.tracing.structure.scores import dependence, flexible_score, frame_score, noise_floor
from mrpipe.tracing.structure.select import FrameCandidate, FrameSelection, select
from mrpipe.tracing.structure.spectra import Spectra
from mrpipe.tracing.verdict import Candidate, Estimate, Interval, LeftOutGain, NamedEffect, Unexplained, Verdict
from mrpipe.words import listed

QUANTITY = (
    "shear force of every storey (mass times absolute acceleration, summed from the top) from the measured motion, "
    "pooled over storeys; lines of the spectrum weighted by the accelerometers' noise"
)

BY_STOREY = 3
"""Numerical technique: with fewer storeys their largest amplitude is reported, else the median of acting storeys."""

LISTED = 6
"""Numerical technique: largest number of states that are listed under `depends_on`."""

NO_GAIN = 1e-12
"""Numerical technique: a smaller squared error counts as zero in a ratio."""

FEWEST_PERIODS = 5
"""Numerical technique: a shorter record, in periods of the first mode, is refused."""


@dataclass(frozen=True)
class FrameTracing:
    """Result of tracing a structure.

    Attributes
    ----------
    summary
        The JSON of docs/close-loop-json.md.
    problem
        Spectra of the records, and the shear frame that is fitted first.
    selection
        Linear frame and effects, as chosen on the training records.
    before, after
        The frame with the declared effects alone, and with all named effects.
    between
        Changes of the stiffness between tests.
    """

    summary: dict[str, Any]
    problem: FrameProblem
    selection: FrameSelection
    before: FrameModel
    after: FrameModel
    between: StiffnessBetweenTests


def trace_frame(
    data: FrameData,
    effects: Sequence[StructuralEffect],
    declared: Sequence[StructuralEffect],
    rules: NamingRules,
    frame_rules: FrameRules | None = None,
    *,
    most: int = 3,
    draws: int = 400,
    rng: np.random.Generator,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> FrameTracing:
    """Trace the residual of a linear frame on the records of all floors.

    Parameters
    ----------
    data
        Records of the structure.
    effects, declared
        The library, and those of its effects that the campaign declares.
    rules
        Rules for naming an effect.
    frame_rules
        Thresholds for the residual of the frame; their defaults if None.
    most
        Largest number of effects that are named together.
    draws
        Number of draws of the bootstrap.
    rng
        Source of randomness.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share done and a text.
    """
    training = data.with_role("training", "repeat")
    problem = frame_problem(training, data.with_role("validation") or training, data.masses_kg, frame_rules)
    _require_length(problem, data)
    progress(0.2, "spectra")
    selection = select(
        problem, effects, rules, most=most, declared=declared, rng=rng, draws=draws, jobs=jobs, progress=progress
    )
    about = selection.about
    reason = _unnamed(selection, rules)
    chosen = selection.chosen[: selection.declared] if reason else selection.chosen
    before = model_of(selection.design, selection.chosen[: selection.declared], about)
    after = model_of(selection.design, chosen, about)
    progress(0.85, "errors on validation tests")
    between = stiffness_between_tests(before, _in_order(problem, data), problem.rules)
    summary = _summary(problem, selection, before, after, between, declared, rules, reason)
    return FrameTracing(summary, problem, selection, before, after, between)


def _require_length(problem: FrameProblem, data: FrameData) -> None:
    """Refuse a record in which the first mode hardly moves; noise would hide everything that it could show."""
    first_hz = float(problem.frequencies_hz[0])
    for record in data.records:
        seconds = len(record.ground) / record.rate_hz
        if seconds * first_hz < FEWEST_PERIODS:
            problem_said = f"lasts {seconds:.3g} s, which is {seconds * first_hz:.2g} periods of the first mode"
            remedy = f"record at least {FEWEST_PERIODS} periods, or leave the test out"
            raise UserError(data.source, f"tests.{record.name}", problem_said, remedy)


def _in_order(problem: FrameProblem, data: FrameData) -> list[Spectra]:
    """Return the spectra of all tests in the order of the campaign."""
    known = {item.record.name: item for item in (*problem.training, *problem.validation)}
    return [known[record.name] for record in data.records if record.name in known]


def _unnamed(selection: FrameSelection, rules: NamingRules) -> str:
    if not selection.structured:
        return "the residual is noise: nothing is missing"
    if len(selection.chosen) <= selection.declared:
        return "no effect of the library changes the error"
    if selection.share(selection.residual) < rules.least_share:
        return "no effect of the library recovers enough of what exceeds the noise"
    return ""


def _summary(
    problem: FrameProblem,
    selection: FrameSelection,
    before: FrameModel,
    after: FrameModel,
    between: StiffnessBetweenTests,
    declared: Sequence[StructuralEffect],
    rules: NamingRules,
    reason: str,
) -> dict[str, Any]:
    scores = frame_score(before, problem.validation), frame_score(after, problem.validation)
    named = [] if reason else _named(selection, after, rules)
    structured = selection.structured
    lacking = [k for k, value in enumerate(_by_storey(selection)) if value > problem.rules.least_storey]
    ceiling = scores[0].nrmse
    if lacking:
        period = 1.0 / float(problem.frequencies_hz[0])
        ceiling = flexible_score(before, problem.training, problem.validation, lacking, period)
    best = min(ceiling, scores[1].nrmse)
    gain = scores[0].nrmse ** 2 - best**2
    recovered = (scores[0].nrmse ** 2 - scores[1].nrmse ** 2) / gain if gain > NO_GAIN else 0.0
    share = selection.share(selection.residual) if named else 0.0
    still = (
        structured
        and share < rules.named_share
        and selection.groups.material(selection.residual if named else selection.design.residual)
    )
    worst = _worst_storey(selection)
    squares = selection.groups.mean_square(selection.design.residual)
    p_values = stats.chi2.sf(squares * selection.groups.count, selection.groups.count)
    return {
        "model": selection.base,
        "quantity": QUANTITY,
        "declared_effects": [item.name for item in declared],
        "noise_floor_nrmse": noise_floor(problem.validation, selection.groups.scale),
        "noise_from": "accelerometers above the highest mode",
        "before": scores[0].as_json(),
        "residual": {
            "structured": structured,
            "p_value": float(max(min(1.0, float(np.min(p_values)) * len(p_values)), 1e-300)),
            "where": {f"storey_{k + 1}": value for k, value in enumerate(_by_storey(selection))},
            "by_test": _by_test(selection, problem),
            "chi_square": selection.design.chi_square,
            "chi_square_of_noise": float(np.mean(selection.groups.scale)),
        },
        "base_form": {
            "name": selection.base,
            "best": selection.base,
            "chi_square": selection.chi_squares,
            "nrmse": {selection.base: scores[0].nrmse},
        },
        "nuisances": {"gain": {}, "channel_skew_s": 0.0, "observation_filter_s": 0.0},
        "effects": [item.as_json() for item in named],
        **_verdict(selection, named, share, rules, reason, between).sentence_as_json(),
        "candidates": [item.as_json() for item in ranking(selection, problem)],
        "after": scores[1].as_json(),
        "ceiling": {"nrmse": best, "recovered": float(np.clip(recovered, 0.0, 1.0))},
        "unexplained": Unexplained(
            bool(still),
            float(np.clip(1.0 - share, 0.0, 1.0)) if structured else 0.0,
            _depends_on(after, problem, worst) if still else (),
        ).as_json(),
        "tests": [
            {"name": name, "nrmse_before": value, "nrmse_after": scores[1].by_test[name]}
            for name, value in scores[0].by_test.items()
        ],
        "frame": {
            "frequencies_hz": problem.frequencies_hz.tolist(),
            "storey_stiffness_n_m": problem.storey_stiffness.tolist(),
            "band_hz": [problem.band.low_hz, problem.band.high_hz],
            "between_tests": between.as_json(),
        },
    }


def _depends_on(after: FrameModel, problem: FrameProblem, storey: int) -> tuple[tuple[str, float], ...]:
    found = dependence(after, problem.training, storey)[:LISTED]
    return tuple((f"{name} of storey {storey + 1}", value) for name, value in found if value > problem.rules.listed)


def _by_storey(selection: FrameSelection) -> list[float]:
    over = selection.groups.over(selection.design.residual)
    n = len(selection.design.residual)
    sums = np.bincount(selection.groups.storey, weights=over, minlength=n)
    return [float(value) for value in sums / max(float(sums.sum()), 1e-300)]


def _by_test(selection: FrameSelection, problem: FrameProblem) -> dict[str, float]:
    over = selection.groups.over(selection.design.residual)
    sums = np.bincount(selection.groups.record, weights=over, minlength=len(problem.training))
    total = max(float(sums.sum()), 1e-300)
    return {item.record.name: float(value / total) for item, value in zip(problem.training, sums, strict=True)}


def _worst_storey(selection: FrameSelection) -> int:
    residual = selection.residual if selection.chosen else selection.design.residual
    over = selection.groups.over(residual)
    return int(np.argmax(np.bincount(selection.groups.storey, weights=over)))


def _named(selection: FrameSelection, after: FrameModel, rules: NamingRules) -> list[NamedEffect]:
    found, first = [], 0
    total = selection.share(selection.residual)
    for place, item in enumerate(selection.chosen):
        count = _amplitudes_of(item, len(selection.design.residual))
        own = after.amplitudes[first : first + count]
        first += count
        if place < selection.declared:
            continue
        candidates = selection.rounds[place - selection.declared]
        lead = candidates[0].share - max((other.share for other in candidates[1:]), default=0.0)
        rivals = [other.name for other in candidates[1:] if other.share > candidates[0].share - rules.lead]
        gain = selection.gains[place - selection.declared] if selection.gains else None
        effect = item.placed.effect
        interval = None if gain is None else LeftOutGain(gain.share, Interval(*gain.interval))
        found.append(
            NamedEffect(
                effect.name,
                item.placed.form.name,
                parameters_of(item, own, selection.rules.acting),
                confidence_of(total, 0.5 + 0.5 * min(1.0, 2.0 * lead), None, rules),
                effect.physics,
                effect.remedy,
                effect.source,
                "structure",
                place_in_words(item, own, selection.rules.acting),
                tuple(rivals),
                {name: effect.separated_by[name].advice for name in rivals if name in effect.separated_by},
                interval,
            )
        )
    return found


def _amplitudes_of(item: Fitted, floors: int) -> int:
    kinds = len(item.placed.form.amplitudes)
    return kinds * floors if item.placed.effect.acts_on == "storey" else kinds


def place_in_words(item: Fitted, amplitudes: FloatArray, acting: float) -> str:
    """Return where an effect acts: a floor, every storey, or the storeys with a large amplitude.

    Parameters
    ----------
    item
        The effect.
    amplitudes
        Its amplitudes, storey after storey.
    acting
        Share of the largest amplitude from which on a storey is named.
    """
    if item.placed.floor:
        return f"floor {item.placed.floor}"
    if item.placed.effect.acts_on == "base":
        return "base"
    by_storey = amplitudes.reshape(-1, len(item.placed.form.amplitudes)).sum(axis=1)
    strong = np.flatnonzero(by_storey > acting * float(by_storey.max()))
    if len(strong) == len(by_storey):
        return "every storey"
    return "storey " + ", ".join(str(k + 1) for k in strong)


def parameters_of(item: Fitted, amplitudes: FloatArray, acting: float) -> dict[str, Estimate]:
    """Return value and unit of every parameter; amplitudes of several storeys by storey, with their median as value.

    Parameters
    ----------
    item
        The effect.
    amplitudes
        Its amplitudes, storey after storey.
    acting
        Share of the largest amplitude below which a storey does not count in the median.
    """
    found = {
        parameter.name: Estimate(float(value), parameter.unit, Interval.point(float(value)))
        for parameter, value in zip(item.placed.form.searched, item.numbers, strict=True)
    }
    kinds = len(item.placed.form.amplitudes)
    for k, parameter in enumerate(item.placed.form.amplitudes):
        own = amplitudes[k::kinds]
        value = float(np.max(own)) if len(own) < BY_STOREY else _typical(own, acting)
        interval = Interval(float(np.min(own)), float(np.max(own)), "range", None)
        storeys = tuple(float(number) for number in own) if len(own) > 1 else ()
        found[parameter.name] = Estimate(value, parameter.unit, interval if storeys else Interval.point(value), storeys)
    if item.placed.floor:
        found["floor"] = Estimate(item.placed.floor, "1", Interval.point(item.placed.floor))
    return found


def _typical(values: FloatArray, acting: float) -> float:
    strong = values[values > acting * float(values.max())] if float(values.max()) > 0.0 else values
    return float(np.median(strong))


def ranking(selection: FrameSelection, problem: FrameProblem) -> list[Candidate]:
    """Return the candidates of the first round, best first, with their errors on validation records."""
    if not selection.rounds:
        return []
    return [_ranked(item, selection, problem) for item in selection.rounds[0]]


def _ranked(item: FrameCandidate, selection: FrameSelection, problem: FrameProblem) -> Candidate:
    design, fitted = selection.design, item.outcome.fitted
    model = model_of(design, (*selection.chosen[: selection.declared], fitted), selection.about)
    return Candidate(
        item.name,
        fitted.placed.form.name,
        frame_score(model, problem.validation).nrmse,
        0.5 * (design.chi_square - item.outcome.solved.chi_square) * design.size,
        item.share,
        item.forms,
        tuple(fitted.at_bound),
    )


def _verdict(
    selection: FrameSelection,
    named: Sequence[NamedEffect],
    share: float,
    rules: NamingRules,
    reason: str,
    between: StiffnessBetweenTests,
) -> Verdict:
    # if the stiffness changed between tests, the residual also contains this change, which no effect explains
    drift = f"; {between.sentence()}" if between.drifts else ""
    if reason:
        return Verdict("unknown" if selection.structured else "noise", f"{reason}{drift}")
    names = listed([f"{item.name} ({item.place})" for item in named])
    if share >= rules.named_share:
        return Verdict("explained", f"{names}: explains what is missing{drift}", share)
    form = "explains part of what is missing; its form is not proven"
    return Verdict("partly explained", f"{names}: {form}{drift}", share)
