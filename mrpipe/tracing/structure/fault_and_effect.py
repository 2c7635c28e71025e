"""A faulty sensor and a missing effect in one campaign, if neither of them alone explains the residual.

The fault is sought in the residual of the linear frame and, where an effect explains most of it, in the residual with
this effect. The records are corrected, and effects are selected again. The force of the effect is then subtracted, so
that gain and delay of the sensor are fitted without it, and the records are corrected with these values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.choice import without_effects
from mrpipe.tracing.structure.fault_search import likely_fault, with_smaller_residual
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.naming import acting_on, by_effect
from mrpipe.tracing.structure.rounds import FrameSelection
from mrpipe.tracing.structure.scores import frame_score
from mrpipe.tracing.structure.sensor_faults import SensorFault, repaired
from mrpipe.tracing.structure.spectra import Spectra
from mrpipe.tracing.structure.ties import Tie
from mrpipe.tracing.verdict import Score, Verdict
from mrpipe.words import listed

Select = Callable[[FrameProblem], FrameSelection]
"""Selection of effects on a problem."""


@dataclass(frozen=True)
class FaultAndEffect:
    """A fault of a sensor, and the effects that explain what it leaves.

    Attributes
    ----------
    fault
        The fault.
    problem
        Spectra of the corrected records.
    selection
        Linear frame and effects on them.
    recorded
        Errors of the linear frame without these effects on the validation records as they were recorded, with the
        weights of the corrected records.
    """

    fault: SensorFault
    problem: FrameProblem
    selection: FrameSelection
    recorded: Score

    def in_summary(self, summary: dict[str, Any], rules: FrameRules, tie: Tie | None) -> dict[str, Any]:
        """Return the summary of the corrected records, with the errors of the recorded ones before, and the fault.

        Parameters
        ----------
        summary
            The JSON of docs/close-loop-json.md.
        rules
            Decision thresholds; effects of a campaign with a faulty sensor are as probable as each of several effects.
        tie
            Effects that explain equally well what the named ones leave; None if these tests separate all effects.
        """
        most = rules.probability_of_several
        effects = [{**item, "confidence": min(item["confidence"], most)} for item in summary["effects"]]
        names = listed([f"{item['name']} ({item['place']})" for item in effects])
        most_of = "most of " if self.selection.groups.material(self.selection.residual) else ""
        leaves = f"what a fault of a sensor leaves ({self.fault.sentence()})"
        if effects:
            rest = f"; {tie.sentence('what then remains')}" if tie else ""
            sentence = f"{names}: explains {most_of}{leaves}{rest}; correct the channel"
        else:
            sentence = f"{tie.sentence(leaves) if tie else leaves}; correct the channel"
        if differing := [item["name"] for item in summary["frame"]["differing_tests"]]:
            sentence += f"; the error of {listed(differing)} exceeds the noise nevertheless"
        tests = [{**item, "nrmse_before": self.recorded.by_test[item["name"]]} for item in summary["tests"]]
        verdict = Verdict("partly explained" if effects else "unknown", sentence).sentence_as_json()
        return {**summary, **verdict, "effects": effects, "before": self.recorded.as_json(), "tests": tests}


def promising_fault(problem: FrameProblem, selection: FrameSelection, rules: NamingRules) -> SensorFault | None:
    """Return the fault of a sensor that removes most of the residual of the linear frame, where effects leave some.

    Parameters
    ----------
    problem
        Spectra of the records.
    selection
        Linear frame and effects, as chosen on the training records.
    rules
        Rules for naming an effect.
    """
    if not selection.structured or selection.share(selection.remaining) >= rules.named_share:
        return None
    design = design_of("linear-frame", problem.training)
    return likely_fault(design, groups_of(design, problem.rules), problem.masses_kg, rules.least_share)


def leaves_nothing(fault: SensorFault, problem: FrameProblem) -> bool:
    """Return whether the residual of a linear frame is noise once the records are corrected for a fault.

    Parameters
    ----------
    fault
        The fault.
    problem
        Spectra of the records as they were recorded. The noise was estimated with the faulty sensor, and is estimated
        again.
    """
    design = design_of("linear-frame", _repaired(problem, fault).training)
    return not groups_of(design, problem.rules).material(design.residual)


def fault_and_effect(
    fault: SensorFault | None, problem: FrameProblem, selection: FrameSelection, rules: NamingRules, choose: Select
) -> FaultAndEffect | None:
    """Return the fault of a sensor and the effects that together explain the residual; None if none do.

    Parameters
    ----------
    fault
        Fault that removes most of the residual of the linear frame; None if none does.
    problem
        Spectra of the records.
    selection
        Linear frame and effects, as chosen on the training records without any fault.
    rules
        Rules for naming an effect.
    choose
        Selection of effects on a problem.
    """
    if not selection.structured or selection.share(selection.remaining) >= rules.named_share:
        return None
    for start in _possible(fault, problem, selection, rules.least_share):
        again, found = _traced(problem, start, choose)
        if len(found.chosen) <= found.declared or found.share(found.residual) < rules.least_share:
            continue
        refined = with_smaller_residual(start, without_effects(again.training, found), problem.masses_kg)
        # what an effect leaves because of its form also looks like a small error of a gain
        if not refined.exceeds(problem.rules.same_gain, problem.band.high_hz):
            continue
        both = effect_after(refined, problem, selection, rules, choose)
        if both is not None:
            return both
    return None


def effect_after(
    fault: SensorFault, problem: FrameProblem, selection: FrameSelection, rules: NamingRules, choose: Select
) -> FaultAndEffect | None:
    """Return the effects that explain what is missing in records that are corrected for a fault; None if none do.

    Parameters
    ----------
    fault
        Fault of a sensor.
    problem, selection
        Spectra of the records as they were recorded, and the linear frame that was fitted to them.
    rules
        Rules for naming an effect.
    choose
        Selection of effects on a problem.
    """
    again, found = _traced(problem, fault, choose)
    if len(found.chosen) <= found.declared or not _sufficient(found, selection, rules):
        return None
    return FaultAndEffect(fault, again, found, _recorded_error(problem, again, found))


def _recorded_error(problem: FrameProblem, again: FrameProblem, found: FrameSelection) -> Score:
    """Return the errors of the linear frame on the records as they were recorded, with the weights of corrected ones.

    The noise is estimated again in the corrected records. Errors with different weights are not comparable.

    Parameters
    ----------
    problem, again
        Spectra of the records as they were recorded, and of the corrected ones.
    found
        Linear frame and effects on the corrected records; the linear frame is fitted again to the recorded ones.
    """
    training = _with_weights_of(again.training, again, problem.training)
    validation = _with_weights_of(again.validation, again, problem.validation)
    known = found.chosen[: found.declared]
    return frame_score(model_of(design_of(found.base, training), known, found.about), validation)


def _with_weights_of(
    corrected: Sequence[Spectra], again: FrameProblem, recorded: Sequence[Spectra]
) -> tuple[Spectra, ...]:
    """Return the spectra of records as they were recorded, with the weights of the corrected ones."""
    spectra = again.spectra([item.record for item in recorded])
    return tuple(
        replace(item, weight=own.weight, variance=own.variance) for item, own in zip(spectra, corrected, strict=True)
    )


def _sufficient(found: FrameSelection, recorded: FrameSelection, rules: NamingRules) -> bool:
    """Return whether effects explain what a fault leaves.

    The fault of a sensor leaves a residual in all storeys that its floor is coupled to, an effect in those on which it
    acts. If something is left in the latter alone, it is the form of the effect.

    Parameters
    ----------
    found
        Linear frame and effects on the corrected records.
    recorded
        Linear frame on the records as they were recorded.
    rules
        Rules for naming an effect.
    """
    share = found.share(found.residual)
    if share >= rules.named_share:
        return True
    acting = {storey for item, own in by_effect(found, found.amplitudes) for storey in acting_on(item, own, found)}
    others = [storey for storey in range(len(found.residual)) if storey not in acting]
    explained = recorded.groups.of_storeys(others).material(recorded.design.residual)
    left = found.groups.of_storeys(others).material(found.residual)
    return share >= rules.least_share and explained and not left


def _possible(
    fault: SensorFault | None, problem: FrameProblem, selection: FrameSelection, least_share: float
) -> Iterator[SensorFault]:
    """Yield the given fault, and the one that removes most of the residual with the chosen effects."""
    if fault is not None:
        yield fault
    if len(selection.chosen) > selection.declared:
        design = design_of("linear-frame", without_effects(problem.training, selection))
        found = likely_fault(design, groups_of(design, problem.rules), problem.masses_kg, least_share)
        if found is not None:
            yield found


def _traced(problem: FrameProblem, fault: SensorFault, choose: Select) -> tuple[FrameProblem, FrameSelection]:
    again = _repaired(problem, fault)
    return again, choose(again)


def _repaired(problem: FrameProblem, fault: SensorFault) -> FrameProblem:
    """Return the problem of the records that are corrected for a fault, with noise that is estimated again."""
    training, validation = (
        [repaired(item.record, fault) for item in items] for items in (problem.training, problem.validation)
    )
    return frame_problem(training, validation, problem.masses_kg, problem.rules)
