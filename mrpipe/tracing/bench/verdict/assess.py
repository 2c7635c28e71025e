"""From the chosen effects to names with probabilities, further terms, and the verdict on the validation tests.

An effect is named only if it is more likely present than absent. The others remain in the model as further terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.campaign_tests.odd_tests import SortedTests
from mrpipe.tracing.bench.model_choice.choose import Choice
from mrpipe.tracing.bench.residuals.crossvalidation import intervals
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.selection.select import Selection, share_of
from mrpipe.tracing.bench.validation.on_validation import OnValidation, VerdictWithEvidence
from mrpipe.tracing.bench.verdict.gates import (
    errors_on_validation,
    residual_is_structured,
    verdict_on_validation,
    with_calibrated_probability,
)
from mrpipe.tracing.bench.verdict.naming import Named, parameter_table, tied_effects
from mrpipe.tracing.bench.verdict.offsets import OffsetFinding
from mrpipe.tracing.evidence import evidence_of
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.options import NamingRules, TracingOptions


@dataclass(frozen=True)
class Case:
    """Data that do not change while the names are decided.

    Attributes
    ----------
    choice
        The models that competed, and the baseline.
    training, validation
        Recordings; effects are decided on the first and judged on the second.
    options
        Options of the tracing.
    ordered
        The tests that are used, and the faults that were found in tests.
    offsets
        Offset that differs between tests; None if there is none.
    jobs
        Processes.
    """

    choice: Choice
    training: Recordings
    validation: Recordings
    options: TracingOptions
    ordered: SortedTests
    offsets: OffsetFinding | None
    jobs: int


@dataclass(frozen=True)
class Assessment:
    """Names, further terms and the verdict.

    Attributes
    ----------
    named
        The named terms of the model with their evidence, in their order.
    causes
        The causes that the verdict names, with probabilities: the named terms, and an offset between tests.
    further
        Terms of the model whose cause is not proven.
    missing
        Whether the residual of the training tests contains more than noise.
    found, alone
        Errors on the validation tests of the whole model, and of the model without further terms.
    judgement
        Verdict on the named effects alone: further terms do not explain anything.
    """

    named: tuple[Named, ...]
    causes: tuple[Named, ...]
    further: tuple[Named, ...]
    missing: bool
    found: OnValidation
    alone: OnValidation
    judgement: VerdictWithEvidence

    @property
    def further_terms_fail(self) -> bool:
        """Whether there are further terms, and they do not lower the error on the validation tests."""
        return bool(self.further) and self.found.nrmse(self.found.after) >= self.alone.nrmse(self.alone.after)


def assess(
    found: NamedEffects,
    case: Case,
    rng: np.random.Generator,
    *,
    with_others: bool = False,
    doubts: Sequence[Named] = (),
) -> Assessment:
    """Return the probability of each named effect and further term, the errors on validation, and the verdict.

    Parameters
    ----------
    found
        Named effects, and further terms.
    case
        Data that do not change.
    rng
        Source of randomness.
    with_others
        Whether more than one effect had a name before some of them became further terms. The remaining ones then keep
        the lower probability of an effect that is not alone.
    doubts
        Terms that lost their name, with the probability that they had as names. They keep it as further terms.
    """
    options, baseline, offsets = case.options, case.choice.baseline, case.offsets
    selection = found.selection
    proven = selection.with_named_alone
    named = _with_evidence(proven, case, found.gains, found.declared, rng)
    further = _with_evidence(selection, case, (), found.declared + len(named), rng)
    causes = [*named, *([offsets.as_named_effect()] if offsets is not None else [])]
    if offsets is not None and any(item.effect.name == "offset" for item in named):
        causes.pop()
    missing = residual_is_structured(selection, baseline, case.training, options, bool(causes))
    differ = offsets is not None
    errors = errors_on_validation(
        selection.base, selection.chosen, baseline, case.training, case.validation, options, differ
    )
    # the class of the verdict is that of the named effects; further terms do not explain anything
    alone = errors
    if proven is not selection:
        alone = errors_on_validation(
            selection.base, proven.chosen, baseline, case.training, case.validation, options, differ
        )
    judgement = verdict_on_validation(
        alone, proven, case.training, options, causes, missing, found.reason, case.ordered, case.jobs
    )
    with_others = with_others or len(named) > 1
    evidence = judgement.evidence
    beyond = evidence.structured and evidence.after > options.rules.validation.noise_floors * evidence.floor
    likely = tuple(
        with_calibrated_probability(
            item, judgement, options, with_others=with_others, beyond=beyond, chosen=item in named
        )
        for item in causes
    )
    known = {item.effect.name: item for item in doubts}
    # a further term that never had a name stands at best for a part of what is missing
    unproven = tuple(
        replace(item, confidence=known[item.effect.name].confidence)
        if item.effect.name in known
        else with_calibrated_probability(item, judgement, options, with_others=True, beyond=True)
        for item in further
    )
    return Assessment(named, likely, unproven, missing, errors, alone, judgement)


def with_likely_names(found: NamedEffects, case: Case, rng: np.random.Generator) -> tuple[NamedEffects, Assessment]:
    """Return the effects whose names are more likely present than absent, and their assessment.

    An effect whose probability is too low loses its name and becomes a further term. This changes the probabilities of
    the other names, so that they are assessed again until every probability is high enough. Further terms that do not
    lower the error on the validation tests are left out.

    Parameters
    ----------
    found
        Named effects, and further terms.
    case
        Data that do not change.
    rng
        Source of randomness.
    """
    assessed = assess(found, case, rng)
    with_others = len(assessed.named) > 1
    doubts: list[Named] = []
    while (numbers := _unlikely(assessed, case.options)) or assessed.further_terms_fail:
        if numbers:
            doubts += [assessed.causes[k] for k in numbers]
            found = found.without_names(numbers)
            found = replace(found, reason="" if found.selection.proven else _unlikely_reason(doubts))
        else:
            found = replace(found, selection=found.selection.with_named_alone)
        assessed = assess(found, case, rng, with_others=with_others, doubts=doubts)
    return found, assessed


def _unlikely(assessed: Assessment, rules: NamingRules) -> tuple[int, ...]:
    """Return the numbers of the named terms whose probability is below `least_probability`."""
    return tuple(k for k in range(len(assessed.named)) if assessed.causes[k].confidence < rules.least_probability)


def _unlikely_reason(doubts: Sequence[Named]) -> str:
    """Return why nothing is named, if the probability of every name is too low."""
    names = ", ".join(f"{item.effect.name} (probability {item.confidence:.2f})" for item in doubts)
    said = "lowers the error, but is" if len(doubts) == 1 else "lower the error, but each of them is"
    return f"no effect is named: {names} {said} more likely absent than present"


def _with_evidence(
    selection: Selection, case: Case, gains: Sequence[Gain | None], declared: int, rng: np.random.Generator
) -> tuple[Named, ...]:
    """Return the terms of the chosen fit behind the first `declared` ones, with parameters and confidence."""
    chosen, options = selection.chosen, case.options
    named = []
    limits = intervals(chosen) if len(chosen.problem.terms) > declared else []
    total = share_of(selection.without_effects, chosen, selection.noise)
    for place, index in enumerate(range(declared, len(chosen.problem.terms))):
        term = chosen.problem.terms[index]
        candidates = selection.rounds[place] if place < len(selection.rounds) else ()
        rivals: tuple[str, ...] = ()
        if candidates and candidates[0].name == term.effect.name:
            rivals = tied_effects(candidates, selection.noise, options, draws=options.bootstrap_draws, rng=rng)
        gain = gains[place] if place < len(gains) else None
        support = case.choice.support(term.effect.name, options, rng)
        named.append(
            Named(
                term.effect,
                term.form.name,
                parameter_table(chosen, index, limits[index], options.drive_unit),
                evidence_of(total, support, gain, options),
                rivals,
                {name: term.effect.separated_by[name].advice for name in rivals if name in term.effect.separated_by},
                gain,
            )
        )
    return tuple(named)
