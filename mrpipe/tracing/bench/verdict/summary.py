"""The result of a tracing as one dictionary for JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.fitting.engine import predict
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.base_forms.listed_forms import COMMON_FORMS, listed_fits_without_effects
from mrpipe.tracing.bench.base_forms.race import Race
from mrpipe.tracing.bench.campaign_tests.odd_tests import SortedTests
from mrpipe.tracing.bench.noise.baseline import Baseline
from mrpipe.tracing.bench.residuals.ceiling import flexible_residual
from mrpipe.tracing.bench.residuals.error_measures import score
from mrpipe.tracing.bench.residuals.nuisances import session_of
from mrpipe.tracing.bench.residuals.residual_structure import States, dependence, location, states_of, structure_p_value
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.bench.validation.judgement import lowest_error
from mrpipe.tracing.bench.validation.on_validation import OnValidation, VerdictWithEvidence, open_tests
from mrpipe.tracing.bench.verdict.naming import Named, ranking
from mrpipe.tracing.bench.verdict.offsets import OffsetFinding
from mrpipe.tracing.gain import recovered_share
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.rules import TracingRules
from mrpipe.tracing.verdict import Score, Unexplained

UNATTRIBUTED: dict[str, Any] = {
    "name": "unattributed",
    "form": "boosted-trees-on-lagged-states",
    "parameters": {},
    "confidence": 0.0,
    "tied_with": [],
    "physics": "A flexible model of what no named effect explains; it has no physical meaning.",
    "remedy": "Make the tests that `next_tests` lists.",
    "corrected_in": "nowhere: it is a model of the record and cannot run in a closed loop",
}


LISTED = 6
"""Numerical technique: largest number of states that are listed under `depends_on`."""


@dataclass(frozen=True)
class Tracing:
    """Result of a tracing; forces have shape (n,), the samples of the validation tests [N].

    Attributes
    ----------
    summary
        The document that `close-loop --json` prints.
    selection
        Base form and effects, fitted to all training tests.
    baseline
        Fit of the declared model, its weights and its noise.
    named
        Effects that the verdict names.
    training, validation
        Recordings.
    measured, before, after
        Measured force without offset, and the force of the base model and of the final model.
    states
        States of the training tests that the residual may depend on.
    score_before, score_after
        Errors of both models on the validation tests.
    drive_unit
        `A` or `V`.
    """

    summary: dict[str, Any]
    selection: Selection
    baseline: Baseline
    named: tuple[Named, ...]
    training: Recordings
    validation: Recordings
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    states: States
    score_before: Score
    score_after: Score
    drive_unit: str


@dataclass(frozen=True)
class Summary:
    """Errors on the validation tests, and the printed result of a tracing."""

    selection: Selection
    baseline: Baseline
    training: Recordings
    offsets: OffsetFinding | None
    found: OnValidation
    judgement: VerdictWithEvidence
    sorted_tests: SortedTests
    race: Race | None = None
    jobs: int = 1

    def build(
        self,
        options: TracingOptions,
        named: tuple[Named, ...],
        further: tuple[Named, ...],
        untested: Mapping[str, str],
        window: float,
        declared: list[str],
    ) -> Tracing:
        """Return the tracing with its printed result.

        `further` are terms that improve the model, but whose cause is not proven. `untested` are the effects that no
        test can show, with the reason.
        """
        selection, training, found = self.selection, self.training, self.found
        states = states_of(selection.base, training)
        after, effects_found = found.after, [item.as_json() for item in named]
        if options.unattributed and self.judgement.evidence.structured:
            flexible = found.after + self._flexible()
            if found.nrmse(flexible) < found.nrmse(found.after):
                after = flexible
                effects_found.append(UNATTRIBUTED)
        score_before, score_after = found.score_before, score(found.recordings, found.measured, after)
        lowest, lowest_interval = lowest_error(
            self.judgement.ceiling, self.judgement.ceiling_interval, score_after.nrmse
        )
        summary = {
            "model": options.model,
            "declared_effects": declared,
            "noise_floor_nrmse": found.floor_nrmse(),
            "noise_components_nrmse": found.noise_components,
            "noise_from": self.baseline.scale.source,
            "before": score_before.as_json(),
            "residual": self._residual(states, options.rules),
            "base_form": self._base_form(options, found.measured),
            "nuisances": self._nuisances(named, window, options.rules),
            "effects": effects_found,
            "further_terms": [item.as_json() for item in further],
            **self._verdict(),
            "candidates": [item.as_json() for item in ranking(selection, self._candidate_errors(found.measured))],
            "untestable": dict(untested),
            "after": score_after.as_json(),
            "ceiling": {
                "nrmse": lowest,
                "interval": list(lowest_interval),
                "recovered": recovered_share(score_before.nrmse, found.nrmse(found.after), self.judgement.ceiling),
            },
            "unexplained": self._unexplained(options.rules),
            "tests": [
                {"name": name, "nrmse_before": score_before.by_test[name], "nrmse_after": score_after.by_test[name]}
                for name in score_before.by_test
            ],
        }
        return Tracing(
            summary, selection, self.baseline, named, training, found.recordings, found.measured, found.before, after,
            states, score_before, score_after, options.drive_unit,
        )  # fmt: skip

    def _verdict(self) -> dict[str, Any]:
        """Return the keys of the verdict; the sentence begins with faults of single tests."""
        found, first = self.judgement.verdict.as_json(), self.sorted_tests.sentence
        if first:
            found["verdict"] = f"{first}; {found['verdict']}"
        return {**found, "findings": self.sorted_tests.as_json()}

    def _residual(self, states: States, rules: TracingRules) -> dict[str, Any]:
        base = self.selection.base
        places = location(base.residual, base, self.training, states, rules.location)
        return {
            "structured": self.judgement.evidence.structured,
            "p_value": structure_p_value(base.residual, states),
            "where": places["cycle"],
            "location": places,
            "chi_square": base.chi_square,
            "chi_square_of_noise": self.selection.noise,
        }

    def _nuisances(self, named: Sequence[Named], window: float, rules: TracingRules) -> dict[str, Any]:
        found, training = self.found, self.training
        session = session_of(
            found.recorded,
            found.measured,
            found.after,
            self.selection.chosen,
            training,
            rules.nuisances,
            rules.validation,
        )
        offsets = zip(training.names, self.selection.chosen.test_offsets, strict=True)
        return {
            "gain": {name: item.value for name, item in found.gains.items() if item.deviates},
            "gain_interval": {name: list(item.interval) for name, item in found.gains.items() if item.deviates},
            "session_gain": session.as_json() if session is not None else None,
            "channel_skew_s": _value(named, "channel-skew", "skew"),
            "observation_filter_s": window * float(np.median(training.period_s)),
            "observation_filter_share_of_period": window,
            "offset_n": {name: float(value) for name, value in offsets},
            "offsets_of_validation_from": "the first part of each record, which is not judged"
            if found.own_offsets
            else "the training tests",
        }

    def _unexplained(self, rules: TracingRules) -> dict[str, Any]:
        """Return what remains unexplained in training and validation tests, and the states that it depends on."""
        selection, structured = self.selection, self.judgement.evidence.structured
        left = max(selection.chosen.chi_square - selection.noise, 0.0)
        excess = max(selection.base.chi_square - selection.noise, 1e-12)
        better = selection.chosen is not selection.base
        still = structured and left > max(
            rules.selection.nothing_missing * selection.noise, rules.remainder.of_excess * excess if better else 0.0
        )
        remains, share, p_value = self.found.unexplained(rules.validation)
        kind = self.judgement.verdict.kind
        in_training = float(min(1.0, left / excess)) if structured and self.offsets is None else 0.0
        states = states_of(selection.chosen, self.training)
        found = dependence(selection.chosen.residual, states)[:LISTED] if still or remains else []
        return Unexplained(
            bool(still or remains) and kind != "noise",
            max(in_training, share if remains else 0.0),
            tuple((name, part) for name, part in found if part > rules.remainder.listed),
            p_value,
            tuple(open_tests(self.judgement, rules.validation)) if remains else (),
        ).as_json()

    def _flexible(self) -> FloatArray:
        """Return the prediction on the validation tests [N] of a flexible model of the training residual."""
        fitted = self.selection.chosen
        root = fitted.problem.root_weight
        residual = np.divide(fitted.residual, root, out=np.zeros_like(root), where=root > 0.0)
        return flexible_residual(fitted, self.training, residual, self.found.recordings)

    def _candidate_errors(self, measured: FloatArray) -> dict[str, float]:
        if not self.selection.rounds:
            return {}
        return {
            item.name: score(self.found.recordings, measured, predict(item.fit, self.found.recordings)).nrmse
            for item in self.selection.rounds[0]
        }

    def _base_form(self, options: TracingOptions, measured: FloatArray) -> dict[str, Any]:
        base = self.selection.base
        fits = listed_fits_without_effects(base, self.race, jobs=self.jobs)
        judged = self.found.recordings
        errors = {name: score(judged, measured, predict(f, judged)).nrmse for name, f in fits.items()}
        if options.model not in errors:
            errors[options.model] = errors[next(iter(fits))]
        # decided on the training tests with a penalty for parameters, and reported on the validation tests
        lead = 1.0 + options.rules.race.listed_lead
        common = [name for name in fits if name in COMMON_FORMS or name == base.problem.base.name]
        best = min(common, key=lambda name: fits[name].chi_square * (1.0 if name == base.problem.base.name else lead))
        ground = self.selection.ground
        taken = options.model
        if ground is not None:
            taken = ground.problem.base.name
            errors[taken] = score(judged, measured, predict(ground, judged)).nrmse
            best = taken
        declared = {"name": options.model, "declared": options.model}
        tied = list(self.selection.tied_forms)
        # the stage adds the comparison with the damper of identify-damper; a tracing of a structure has none
        return {**declared, "best": best, "taken": taken, "tied_with": tied, "nrmse": errors, "identified": None}


def _value(named: Sequence[Named], effect: str, parameter: str) -> float:
    for item in named:
        if item.effect.name == effect:
            return item.parameters[parameter].value
    return 0.0
