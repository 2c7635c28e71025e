"""From candidates to a verdict: named effects, their confidence, effects that are tied with them, and the rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit
from mrpipe.tracing.bench.residuals.crossvalidation import gain_of
from mrpipe.tracing.bench.selection.select import EffectCandidate, Selection, excess_over_noise, share_of
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.verdict import Candidate as RankedCandidate
from mrpipe.tracing.verdict import Estimate, Interval, LeftOutGain, NamedEffect


@dataclass(frozen=True)
class Named:
    """One named effect of the verdict, with its definition.

    Attributes
    ----------
    effect, form
        The effect of the library, and the name of its form.
    parameters
        Parameter -> estimate.
    confidence
        Evidence for the effect, or the calibrated probability that it is present [1].
    tied_with
        Effects that these tests do not separate from it.
    separating_tests
        Rival -> advice on tests that separate it.
    gain
        Gain on left-out tests; None if it was not computed.
    """

    effect: Effect
    form: str
    parameters: Mapping[str, Estimate]
    confidence: float
    tied_with: tuple[str, ...] = ()
    separating_tests: dict[str, str] = field(default_factory=dict)
    gain: Gain | None = None

    @property
    def typed(self) -> NamedEffect:
        """The effect in the form in which all tracings report it."""
        effect = self.effect
        return NamedEffect(
            effect.name,
            self.form,
            self.parameters,
            self.confidence,
            effect.physics,
            effect.remedy,
            effect.source,
            "prepare" if effect.sensor else "plant",
            tied_with=self.tied_with,
            separating_tests=self.separating_tests,
            gain=None if self.gain is None else LeftOutGain(self.gain.share, Interval(*self.gain.interval)),
        )

    def as_json(self) -> dict[str, Any]:
        """Return the effect as docs/close-loop-json.md describes it."""
        return self.typed.as_json()


def tied_effects(
    candidates: Sequence[EffectCandidate], noise: float, rules: NamingRules, *, draws: int, rng: np.random.Generator
) -> tuple[str, ...]:
    """Return the families that these tests do not separate from the best one of a round.

    A family is separated if its residual is clearly larger than that of the best one, and if the difference holds in a
    paired bootstrap of the blocks of the residual. See :class:`~mrpipe.tracing.options.NamingRules`.
    """
    if not candidates:
        return ()
    best = candidates[0].fit
    rivals = []
    for item in candidates[1:]:
        least = excess_over_noise(best, noise, rules.noise_share)
        alike = excess_over_noise(item.fit, noise, rules.noise_share) <= (1.0 + rules.lead) * least
        if not alike:
            alike = not gain_of(item.fit.residual, best.residual, best.problem, draws=draws, rng=rng).significant
        if alike:
            rivals.append(item.name)
    return tuple(rivals)


def unnamed_reason(selection: Selection, rules: NamingRules) -> str:
    """Return why nothing may be named; an empty text if something may be named."""
    if not selection.structured:
        return "the residual is noise: nothing is missing"
    if selection.ground is not None and selection.chosen is selection.ground:
        return f"no effect is named in addition to the base form {selection.ground.problem.base.name}"
    if not selection.rounds or selection.chosen is selection.base:
        return "no effect of the library changes the error"
    if share_of(selection.without_effects, selection.chosen, selection.noise) < rules.least_share:
        return "no effect of the library recovers enough of what is recoverable"
    return ""


def calibrated_probability(
    evidence: float, rules: NamingRules, *, with_others: bool = False, partly: bool = False
) -> float:
    """Return the probability that an effect with this evidence is present, calibrated on the planted benchmark.

    Parameters
    ----------
    evidence
        See :func:`mrpipe.tracing.evidence.evidence_of`.
    rules
        Rules that contain the calibrated probabilities.
    with_others
        Whether the effect is named together with others.
    partly
        Whether the named effects explain only part of what is missing.
    """
    alone = rules.calibration_of_part if partly else rules.calibration
    known, probability = zip(*(rules.calibration_of_several if with_others else alone), strict=True)
    return round(float(np.interp(evidence, known, probability)), 3)


def parameter_table(
    found: Fit, index: int, limits: Mapping[str, tuple[float, float]], drive_unit: str
) -> dict[str, Estimate]:
    """Return parameter -> value, unit and interval, for all parameters of one effect."""
    term, values = found.problem.terms[index], found.term_values[index]
    result = {}
    for item in term.form.parameters:
        value = float(values[item.name])
        interval = Interval.point(value)
        if item.name in limits:
            low, high = limits[item.name]
            interval = Interval(float(low), float(high))
        result[item.name] = Estimate(value, item.unit.replace("drive", drive_unit), interval)
    return result


def ranking(selection: Selection, errors: Mapping[str, float]) -> list[RankedCandidate]:
    """Return the candidates of the first round, best first, with their errors on the validation tests."""
    if not selection.rounds:
        return []
    base, noise = selection.base, selection.noise
    return [
        RankedCandidate(
            item.name,
            item.fit.problem.terms[-1].form.name,
            float(errors.get(item.name, float("nan"))),
            float(0.5 * (base.cost - item.fit.cost) / max(noise, 1e-12)),
            float(share_of(base, item.fit, noise)),
            {name: float(value) for name, value in item.forms.items()},
            tuple(item.fit.at_bound),
        )
        for item in selection.rounds[0]
    ]
