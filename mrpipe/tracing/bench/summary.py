"""Errors on the validation tests and all that the contract prints of a tracing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import predict
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.baseline import FREE_EXPONENT, Baseline, ladder
from mrpipe.tracing.bench.ceiling import flexible_residual
from mrpipe.tracing.bench.error_measures import Score, campaign_offset, measured_force, score
from mrpipe.tracing.bench.nuisances import RecordGain, mean_drives, record_gains, session_gain
from mrpipe.tracing.bench.offsets import OffsetFinding
from mrpipe.tracing.bench.residual_structure import States, dependence, location, states_of, structure_p_value
from mrpipe.tracing.bench.select import Selection
from mrpipe.tracing.bench.verdict import Named, Rules, ranking
from mrpipe.tracing.bench.weights import sensor_deviation

UNATTRIBUTED: dict[str, Any] = {
    "name": "unattributed",
    "form": "boosted-trees-on-lagged-states",
    "parameters": {},
    "confidence": 0.0,
    "tied_with": [],
    "physics": "A flexible model of what no named effect explains; it stands for no physics.",
    "remedy": "Make the tests that `next_tests` lists.",
    "corrected_in": "nowhere: it is a model of the record and cannot run in a loop",
}

FLEXIBLE_SHARE = 0.15
"""A flexible model that recovers less than this share of the excess finds no structure in it."""


@dataclass(frozen=True)
class TracingOptions:
    """How a campaign is traced; the fields are those of the stage's settings, see there."""

    model: str = "bouc-wen"
    yield_order: int = 3
    viscosity_order: int = 1
    most_effects: int = 3
    fit_rate_hz: float = 250.0
    displacement_cutoff_hz: float = 0.0
    refits: int = 8
    folds: int = 3
    bootstrap_draws: int = 400
    rules: Rules = field(default_factory=Rules)
    record_gain: bool = False
    observation_filter: bool = True
    model_error_share: float = 0.0
    unattributed: bool = False
    drive_unit: str = "A"


@dataclass(frozen=True)
class Tracing:
    """What was found; `summary` is the JSON of contract section 4, the rest is for files and figures."""

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
    drive_unit: str = "A"


@dataclass(frozen=True)
class Summary:
    """Errors on the validation tests and what the contract prints."""

    selection: Selection
    baseline: Baseline
    training: Recordings
    validation: Recordings
    offsets: OffsetFinding | None
    reason: str

    def build(
        self,
        options: TracingOptions,
        named: tuple[Named, ...],
        further: tuple[Named, ...],
        untested: Mapping[str, str],
        window: float,
        declared: list[str],
        effects: Mapping[str, Effect],
    ) -> Tracing:
        """Return the tracing with all that is printed.

        `further` are terms that improve the model, their cause not proven; `untested` the effects that no test shows,
        and why.
        """
        selection, training, validation = self.selection, self.training, self.validation
        before, after = predict(selection.base, validation), predict(selection.chosen, validation)
        shared = campaign_offset(selection.chosen.test_offsets, training.force_rms)
        measured = measured_force(validation, after, shared)
        gains = record_gains(validation, measured, after)
        session = session_gain(validation, measured, after, self._training_gains(), mean_drives(training))
        if options.record_gain:
            values = {name: item.value for name, item in gains.items()}
            factor = np.array([values.get(name, 1.0) for name in validation.names])[validation.test]
            before, after = before * factor, after * factor
        shifted = before
        if self.offsets is not None:
            # what one offset for all would have cost: the offsets of the tests are the effect
            own = validation.force - measured
            shifted = before - (own - np.median(own))
        score_before, score_after = score(validation, measured, shifted), score(validation, measured, after)
        states = states_of(selection.base, training)
        p_value = structure_p_value(selection.base.residual, states)
        ceiling, after_ceiling, flexible = self._ceilings(measured, before, after)
        structured = selection.structured or self.offsets is not None
        if not named and structured and not self.baseline.repeats:
            # without repeats coloured noise looks like an excess: it is one only where something can be learnt of it
            blind = ceiling > score_before.nrmse * np.sqrt(1.0 - FLEXIBLE_SHARE)
            structured = not blind or p_value < 1e-6
        floor = self._noise_floor(measured)
        left = max(selection.chosen.chi_square - selection.noise, 0.0)
        excess = max(selection.base.chi_square - selection.noise, 1e-12)
        final_states = states_of(selection.chosen, training)
        effects_found = [item.as_json() for item in named]
        better = selection.chosen is not selection.base
        still = structured and left > max(0.2 * selection.noise, 0.1 * excess if better else 0.0)
        best = min(ceiling, after_ceiling, score_after.nrmse if better else ceiling)
        gain = score_before.nrmse**2 - best**2
        # what the named effects recover: the flexible model, where it is asked for, comes after
        recovered = (score_before.nrmse**2 - score_after.nrmse**2) / gain if gain > 1e-12 else 0.0
        if options.unattributed and structured and after_ceiling < score_after.nrmse:
            after = after + flexible
            score_after = score(validation, measured, after)
            effects_found.append(UNATTRIBUTED)
        summary = {
            "model": options.model,
            "declared_effects": declared,
            "noise_floor_nrmse": floor,
            "noise_from": f"{self.baseline.repeats} repeated pairs" if self.baseline.repeats else "sensor channels",
            "before": _score_json(score_before),
            "residual": {
                "structured": bool(structured),
                "p_value": p_value,
                "where": location(selection.base.residual, selection.base, training, states)["cycle"],
                "location": location(selection.base.residual, selection.base, training, states),
                "chi_square": selection.base.chi_square,
                "chi_square_of_noise": selection.noise,
            },
            "base_form": self._ladder(options, measured, effects.get("rate-dependent-yield")),
            "nuisances": {
                "gain": {name: item.value for name, item in gains.items() if item.deviates},
                "gain_interval": {name: list(item.interval) for name, item in gains.items() if item.deviates},
                "session_gain": session.as_json() if session is not None else None,
                "channel_skew_s": _value(named, "channel-skew", "skew"),
                "observation_filter_s": window * float(np.median(training.period_s)),
                "observation_filter_share_of_period": window,
                "offset_n": {
                    name: float(v) for name, v in zip(training.names, selection.chosen.test_offsets, strict=True)
                },
            },
            "effects": effects_found,
            "further_terms": [item.as_json() for item in further],
            "verdict": self.reason if not named else _verdict(named, selection, options.rules),
            "candidates": ranking(selection, self._candidate_errors(measured)),
            "untestable": dict(untested),
            "after": _score_json(score_after),
            "ceiling": {"nrmse": best, "recovered": float(np.clip(recovered, 0.0, 1.0))},
            "unexplained": {
                "structured": bool(still),
                "share_of_residual": float(min(1.0, left / excess)) if structured and self.offsets is None else 0.0,
                "depends_on": [
                    {"state": name, "share": share}
                    for name, share in dependence(selection.chosen.residual, final_states)[:6]
                    if share > 0.01
                ]
                if still
                else [],
            },
            "tests": [
                {"name": name, "nrmse_before": score_before.by_test[name], "nrmse_after": score_after.by_test[name]}
                for name in score_before.by_test
            ],
        }
        return Tracing(
            summary, selection, self.baseline, named, training, validation, measured, shifted, after, states,
            score_before, score_after, options.drive_unit,
        )  # fmt: skip

    def _ceilings(self, measured: FloatArray, before: FloatArray, after: FloatArray) -> tuple[float, float, FloatArray]:
        """Return the NRMSE of base and composite with a flexible model of the residual, and the latter's force."""
        found = []
        for fitted, simulated in ((self.selection.base, before), (self.selection.chosen, after)):
            root = fitted.problem.root_weight
            residual = np.divide(fitted.residual, root, out=np.zeros_like(root), where=root > 0.0)
            extra = flexible_residual(fitted, self.training, residual, self.validation)
            found.append(score(self.validation, measured, simulated + extra).nrmse)
            if self.selection.base is self.selection.chosen:
                break
        return found[0], found[-1], extra

    def _noise_floor(self, measured: FloatArray) -> float:
        """Return the NRMSE that noise leaves on the validation tests, beyond the sensors as much as in training."""
        fitted, used = self.selection.chosen, self.validation.used
        root = fitted.problem.root_weight
        expected = root * sensor_deviation(fitted, self.training)
        excess = self.baseline.noise / max(float(np.mean(expected[root > 0.0] ** 2)), 1e-12)
        deviation = sensor_deviation(fitted, self.validation)[used] * np.sqrt(excess)
        return float(np.sqrt(np.mean(deviation**2)) / max(np.sqrt(np.mean(measured[used] ** 2)), 1e-12))

    def _training_gains(self) -> dict[str, RecordGain]:
        fitted, recordings = self.selection.chosen, self.training
        root = fitted.problem.root_weight
        measured = recordings.force - fitted.test_offsets[recordings.test]
        residual = np.divide(fitted.residual, root, out=np.zeros_like(root), where=root > 0.0)
        return record_gains(recordings, measured, measured - residual)

    def _candidate_errors(self, measured: FloatArray) -> dict[str, float]:
        if not self.selection.rounds:
            return {}
        return {
            item.name: score(self.validation, measured, predict(item.fit, self.validation)).nrmse
            for item in self.selection.rounds[0]
        }

    def _ladder(self, options: TracingOptions, measured: FloatArray, rate_forms: Effect | None) -> dict[str, Any]:
        base = self.selection.base
        first = self.selection.rounds[0] if self.selection.rounds else ()
        known = [item.fit for item in first if rate_forms is not None and item.name == rate_forms.name]
        fits = ladder(base, rate_forms, known[0] if known else None)
        errors = {name: score(self.validation, measured, predict(f, self.validation)).nrmse for name, f in fits.items()}
        if options.model not in errors:
            errors[options.model] = errors[next(iter(fits))]
        # decided on the training tests, reported on the validation tests; a form must earn its parameters
        best = min(fits, key=lambda name: fits[name].chi_square * (1.0 if name == base.problem.base.name else 1.05))
        taken = options.model if self.selection.ground is None else FREE_EXPONENT
        return {"name": options.model, "best": best, "taken": taken, "nrmse": errors}


def _score_json(value: Score) -> dict[str, float]:
    return {"nrmse": value.nrmse, "fit_percent": value.fit_percent}


def _value(named: Sequence[Named], effect: str, parameter: str) -> float:
    for item in named:
        if item.effect.name == effect:
            return float(item.parameters[parameter]["value"])
    return 0.0


def _verdict(named: Sequence[Named], selection: Selection, rules: Rules) -> str:
    share = selection.share(selection.chosen)
    names = " and ".join(item.effect.name for item in named)
    if share >= rules.named_share or not selection.structured:
        return f"{names}: explains what is missing"
    return f"{names}: explains part of what is missing, its form is not proven"
