"""The whole tracing of a structure: linear frame, residual, effects, errors before and after, verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.errors import UserError
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.rules import FrameRules, ValidationRules
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.choice import choice
from mrpipe.tracing.structure.drift import StiffnessBetweenTests, stiffness_between_tests
from mrpipe.tracing.structure.exchange import exchanged_floors
from mrpipe.tracing.structure.fault_and_effect import (
    FaultAndEffect,
    effect_after,
    fault_and_effect,
    leaves_nothing,
    promising_fault,
)
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.judgement import Errors, Judgement, why_unnamed
from mrpipe.tracing.structure.model import FrameModel, model_of
from mrpipe.tracing.structure.naming import named_effects
from mrpipe.tracing.structure.on_validation import DifferingTest, differing_tests
from mrpipe.tracing.structure.records import FrameData
from mrpipe.tracing.structure.rounds import FrameCandidate, FrameSelection
from mrpipe.tracing.structure.scores import dependence, flexible_score, frame_score, noise_floor
from mrpipe.tracing.structure.select import select
from mrpipe.tracing.structure.sensor_faults import SensorFault
from mrpipe.tracing.structure.spectra import Spectra
from mrpipe.tracing.structure.ties import Tie, tie_below_noise, without_ties
from mrpipe.tracing.verdict import Candidate, Unexplained, Verdict

QUANTITY = (
    "shear force of every storey (mass times absolute acceleration, summed from the top) from the measured motion, "
    "pooled over storeys; lines of the spectrum weighted by the accelerometers' noise"
)

QUANTITY_OF_MODES = (
    "force of every mode in the band (mass times absolute acceleration, summed with the shape of the mode) from the "
    "measured motion, pooled over modes; lines of the spectrum weighted by the accelerometers' noise"
)

LISTED = 6
"""Numerical technique: largest number of states that are listed under `depends_on`."""

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
    validation_rules: ValidationRules | None = None,
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
    validation_rules
        How the errors on validation tests decide the class of the verdict; their defaults if None.
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

    def choose(given: FrameProblem, most: int) -> FrameSelection:
        return select(
            given, effects, rules, most=most, declared=declared, rng=rng, draws=draws, jobs=jobs, progress=progress
        )

    found = _diagnosis(problem, rules, most, choose)
    problem, about = found.problem, found.selection.about
    if found.reason:
        selection, tie = found.selection, None if found.fault else tie_below_noise(found.selection)
    else:
        selection, tie = without_ties(found.selection, rules)
    unnamed = found.reason
    if tie and not unnamed and len(selection.chosen) == selection.declared:
        unnamed = tie.sentence()
    chosen = selection.chosen[: selection.declared] if unnamed else selection.chosen
    before = model_of(selection.design, selection.chosen[: selection.declared], about)
    after = model_of(selection.design, chosen, about)
    progress(0.85, "errors on validation tests")
    of_storeys = model_of(design_of("linear-frame", problem.training), chosen, about) if problem.modal else after
    between = stiffness_between_tests(of_storeys, _in_order(problem, data), problem.rules)
    if found.fault:
        # a faulty sensor in one test looks like a change of the stiffness
        between = replace(between, kind="constant", change=0.0, step_before="", storey=0)
    differing = differing_tests(of_storeys, problem, np.ones(len(problem.masses_kg)), problem.rules.differing_floors)
    summary = _summary(
        problem, selection, before, after, between, declared, rules, unnamed, differing,
        validation_rules or ValidationRules(), tie,
    )  # fmt: skip
    if found.both:
        summary = found.both.in_summary(summary, problem.rules, tie if summary["tied"] else None)
    elif found.fault:
        # a linear frame fits exchanged floors as well, so that the residual may be noise
        summary |= Verdict("unknown", found.reason).sentence_as_json()
    summary["frame"]["sensor_fault"] = found.fault.as_json() if found.fault else None
    return FrameTracing(summary, problem, selection, before, after, between)


@dataclass(frozen=True)
class _Diagnosis:
    """What the residual of the linear frame is: effects, a fault of a sensor, or both.

    Attributes
    ----------
    problem, selection
        Spectra of the records, corrected for the fault if there are also effects, and the effects.
    reason
        Why no effect is named; empty if the chosen effects are named.
    fault
        Fault of a sensor; None if there is none.
    both
        The fault and the effects, if both are reported.
    """

    problem: FrameProblem
    selection: FrameSelection
    reason: str
    fault: SensorFault | None = None
    both: FaultAndEffect | None = None


def _diagnosis(
    problem: FrameProblem, rules: NamingRules, most: int, choose: Callable[[FrameProblem, int], FrameSelection]
) -> _Diagnosis:
    def select_all(given: FrameProblem) -> FrameSelection:
        return choose(given, most)

    exchange = exchanged_floors(problem)
    if exchange:
        # the drifts of exchanged floors are wrong, and so would be the effects that act on them
        selection = choose(problem, 0)
        both = effect_after(exchange, problem, selection, rules, select_all)
        if both:
            return _Diagnosis(both.problem, both.selection, "", both.fault, both)
        return _Diagnosis(problem, selection, exchange.reason(), exchange)
    judged, selection = choice(problem, select_all)
    if judged.modal is None:
        found, fault = _with_fault(problem, selection, rules, select_all)
        return found or _Diagnosis(problem, selection, why_unnamed(selection, rules, fault))
    share = selection.share(selection.remaining)
    if share < rules.named_share:
        # a faulty sensor makes the modes wrong, so that it is sought in the equations of the storeys
        found, _ = _with_fault(problem, select_all(problem), rules, select_all)
        if found and (found.both or share < rules.least_share):
            return found
    return _Diagnosis(judged, selection, why_unnamed(selection, rules))


def _with_fault(
    problem: FrameProblem,
    selection: FrameSelection,
    rules: NamingRules,
    choose: Callable[[FrameProblem], FrameSelection],
) -> tuple[_Diagnosis | None, SensorFault | None]:
    """Return the diagnosis with a fault of a sensor, if one is reported, and the fault that removes most."""
    fault = promising_fault(problem, selection, rules)
    if fault and leaves_nothing(fault, problem):
        return _Diagnosis(problem, selection, fault.reason(), fault), fault
    both = fault_and_effect(fault, problem, selection, rules, choose)
    return (_Diagnosis(both.problem, both.selection, "", both.fault, both) if both else None), fault


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


def _summary(
    problem: FrameProblem,
    selection: FrameSelection,
    before: FrameModel,
    after: FrameModel,
    between: StiffnessBetweenTests,
    declared: Sequence[StructuralEffect],
    rules: NamingRules,
    reason: str,
    differing: Sequence[DifferingTest],
    validation: ValidationRules,
    tie: Tie | None,
) -> dict[str, Any]:
    first, last = frame_score(before, problem.judged_validation), frame_score(after, problem.judged_validation)
    floor = noise_floor(problem.judged_validation, selection.groups.scale)
    errors = Errors(first.nrmse, last.nrmse, floor, _flexible(problem, selection, before, first.nrmse))
    named = [] if reason else named_effects(selection, after, rules, explained=errors.explained(validation))
    judgement = Judgement(selection, named, reason, errors, between, differing, rules, validation, tie)
    return {
        "model": selection.base,
        "quantity": QUANTITY_OF_MODES if problem.modal else QUANTITY,
        "declared_effects": [item.name for item in declared],
        "noise_floor_nrmse": floor,
        "noise_from": "accelerometers above the highest mode",
        "before": first.as_json(),
        "residual": _residual(selection, problem),
        "base_form": {
            "name": selection.base,
            "best": selection.base,
            "chi_square": selection.chi_squares,
            "nrmse": {selection.base: first.nrmse},
        },
        "nuisances": {"gain": {}, "channel_skew_s": 0.0, "observation_filter_s": 0.0},
        "effects": [item.as_json() for item in named],
        "tied": judgement.open_tie.as_json() if judgement.open_tie else None,
        **judgement.verdict().sentence_as_json(),
        "candidates": [item.as_json() for item in ranking(selection, problem)],
        "after": last.as_json(),
        "ceiling": {"nrmse": errors.ceiling, "recovered": errors.recovered},
        "unexplained": _unexplained(problem, after, judgement).as_json(),
        "tests": [
            {"name": name, "nrmse_before": value, "nrmse_after": last.by_test[name]}
            for name, value in first.by_test.items()
        ],
        "frame": {
            "frequencies_hz": problem.frequencies_hz.tolist(),
            "storey_stiffness_n_m": problem.storey_stiffness.tolist(),
            "band_hz": [problem.band.low_hz, problem.band.high_hz],
            "judged_modes_hz": problem.modal.frequencies_hz.tolist() if problem.modal else None,
            "between_tests": between.as_json(),
            "differing_tests": [item.as_json() for item in differing],
        },
    }


def _residual(selection: FrameSelection, problem: FrameProblem) -> dict[str, Any]:
    """Return whether the residual of the linear frame has a structure, and in which storeys and tests it is."""
    squares = selection.groups.mean_square(selection.design.residual)
    p_values = stats.chi2.sf(squares * selection.groups.count, selection.groups.count)
    p_value = float(np.min(p_values)) * len(p_values)
    if selection.below_noise is not None:
        p_value = min(p_value, float(stats.chi2.sf(selection.below_noise.explained, len(p_values))))
    return {
        "structured": selection.structured,
        "p_value": float(max(min(1.0, p_value), 1e-300)),
        "where": {f"storey_{k + 1}": value for k, value in enumerate(_by_storey(selection))},
        "by_test": _by_test(selection, problem),
        "chi_square": selection.design.chi_square,
        "chi_square_of_noise": float(np.mean(selection.groups.scale)),
    }


def _flexible(problem: FrameProblem, selection: FrameSelection, before: FrameModel, nrmse_before: float) -> float:
    """Return the NRMSE of the linear frame with a flexible model of the residual of the storeys that lack something."""
    lacking = [k for k, value in enumerate(_by_storey(selection)) if value > problem.rules.least_storey]
    if not lacking:
        return nrmse_before
    period = 1.0 / float(problem.frequencies_hz[0])
    return flexible_score(before, problem.judged, problem.judged_validation, lacking, period)


def _unexplained(problem: FrameProblem, after: FrameModel, judgement: Judgement) -> Unexplained:
    """Return the part of the residual that the named effects leave."""
    selection = judgement.selection
    left = selection.residual if judgement.named else selection.design.residual
    still = (
        selection.structured
        and not judgement.proven
        and (selection.below_noise is not None or selection.groups.material(left))
    )
    return Unexplained(
        bool(still),
        float(np.clip(1.0 - judgement.share, 0.0, 1.0)) if selection.structured else 0.0,
        _depends_on(after, problem, _worst_storey(selection)) if still else (),
    )


def _depends_on(after: FrameModel, problem: FrameProblem, storey: int) -> tuple[tuple[str, float], ...]:
    found = dependence(after, problem.judged, storey)[:LISTED]
    return tuple((f"{name} of storey {storey + 1}", value) for name, value in found if value > problem.rules.listed)


def _by_storey(selection: FrameSelection) -> list[float]:
    sums = _over_by_storey(selection, selection.design.residual)
    return [float(value) for value in sums / max(float(sums.sum()), 1e-300)]


def _over_by_storey(selection: FrameSelection, residual: FloatArray) -> FloatArray:
    """Return what is missing in each storey: excess over the noise, or power of the force in equations of modes."""
    spectra = selection.design.spectra
    if spectra[0].modes is None:
        over = selection.over(residual)
        return np.asarray(np.bincount(selection.groups.storey, weights=over, minlength=len(residual)), dtype=np.float64)
    widths = np.cumsum([2 * item.frequencies_hz.size for item in spectra])
    found = np.zeros(spectra[0].record.floors)
    for item, own in zip(spectra, np.split(residual[0], widths[:-1]), strict=True):
        real, imaginary = np.split(own, 2)
        found += np.sum(np.abs(item.in_storeys((real + 1j * imaginary) / item.weight)) ** 2, axis=1)
    return found


def _by_test(selection: FrameSelection, problem: FrameProblem) -> dict[str, float]:
    over = selection.over(selection.design.residual)
    sums = np.bincount(selection.groups.record, weights=over, minlength=len(problem.training))
    total = max(float(sums.sum()), 1e-300)
    return {item.record.name: float(value / total) for item, value in zip(problem.training, sums, strict=True)}


def _worst_storey(selection: FrameSelection) -> int:
    return int(np.argmax(_over_by_storey(selection, selection.remaining)))


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
        frame_score(model, problem.judged_validation).nrmse,
        0.5 * (design.chi_square - item.outcome.solved.chi_square) * design.size,
        item.share,
        item.forms,
        tuple(fitted.at_bound),
    )
