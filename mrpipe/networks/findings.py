"""Results of a sweep: the chosen architecture, and a verdict on each statement of thesis 2.3.2."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.networks.candidates import Candidate
from mrpipe.networks.sweep import Outcome

WORTHWHILE = 0.10
"""Relative change of the error up to which two architectures are treated as equal, independent of the spread."""


@dataclass(frozen=True)
class Score:
    """Error of a candidate over its starts.

    Attributes
    ----------
    mean
        Geometric mean of the held-out NRMSE over the starts, so that a failed start does not dominate.
    standard_error
        Relative standard error of this mean (standard error of the logarithm).
    best, worst
        Smallest and largest error of the starts.
    """

    mean: float
    standard_error: float
    best: float
    worst: float


def score(errors: FloatArray) -> Score:
    """Return the score of one candidate from the errors of its starts."""
    logarithms = np.log(errors)
    count = len(errors)
    spread = float(np.std(logarithms, ddof=1) / np.sqrt(count)) if count > 1 else 0.0
    return Score(float(np.exp(np.mean(logarithms))), spread, float(errors.min()), float(errors.max()))


def choose(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the smallest refined network that is not significantly worse than the best.

    A network is not significantly worse if the mean over the starts of the logarithmic ratio of the errors is at most
    its standard error and at most the logarithm of 1 + :data:`WORTHWHILE`. All candidates have the same splits, so that
    the difficulty of a split cancels in the ratio.
    """
    refined = [outcome for outcome in outcomes if outcome.is_refined]
    best = min(refined, key=lambda outcome: score(outcome.refined).mean)
    within = []
    for outcome in refined:
        ratio = score(outcome.refined / best.refined)
        if np.log(ratio.mean) <= min(ratio.standard_error, np.log1p(WORTHWHILE)):
            within.append(outcome)
    return min(within, key=lambda outcome: (outcome.candidate.parameters, score(outcome.refined).mean))


@dataclass(frozen=True)
class Finding:
    """One statement of the thesis, and the result of the sweep for it.

    Attributes
    ----------
    name, statement
        Short name, and statement of the thesis.
    reference, alternative
        Labels of the two candidates that were compared.
    reference_nrmse, alternative_nrmse
        Mean errors of the two candidates over the starts.
    change, uncertainty
        Relative change of the error from reference to alternative (negative: the alternative is better), and two
        standard errors of it.
    level
        `refined` or `screened`: the last fit that both candidates have.
    verdict
        `holds`, `differs` or `not tested`.
    """

    name: str
    statement: str
    reference: str
    alternative: str
    reference_nrmse: float
    alternative_nrmse: float
    change: float
    uncertainty: float
    level: str
    verdict: str


def findings(outcomes: Sequence[Outcome], centre: Candidate) -> list[Finding]:
    """Return the statements of the thesis with their verdicts.

    Each statement compares the architecture of the thesis with the best alternative that differs in one property. An
    error counts as smaller if the difference is more than a tenth and more than two standard errors.
    """
    past, depth = centre.past_values, len(centre.hidden)
    width = centre.hidden[0] if centre.hidden else 0
    statements = (
        ("velocity", "velocity is mandatory", "worse"),
        ("displacement", "adding displacement to velocity does not help", "no gain"),
        ("acceleration", "adding acceleration to velocity does not help", "no gain"),
        ("both", "adding displacement and acceleration does not help", "no gain"),
        ("past", f"more than {past} past values do not help", "no gain"),
        ("fewer-past", f"fewer than {past} past values are worse", "worse"),
        ("layers", f"more than {depth} hidden layers do not help", "no gain"),
        ("fewer-layers", f"fewer than {depth} hidden layers are worse", "worse"),
        ("neurons", f"more than {width} neurons per layer do not help", "no gain"),
    )
    others = _alternatives(outcomes, centre)
    reference = next((outcome for outcome in outcomes if outcome.candidate == centre), None)
    return [_compare(name, statement, reference, others[name], claim) for name, statement, claim in statements]


def _alternatives(outcomes: Sequence[Outcome], centre: Candidate) -> dict[str, list[Outcome]]:
    """Return the alternatives of each finding: outcomes that differ from the centre in one property."""
    states = [o for o in outcomes if replace(o.candidate, states=centre.states) == centre]
    past = [o for o in outcomes if replace(o.candidate, past_values=centre.past_values) == centre]
    shapes = [o for o in outcomes if replace(o.candidate, hidden=centre.hidden) == centre]
    depth = len(centre.hidden)
    motion = {"displacement", "acceleration"}

    def seeing(*wanted: str) -> list[Outcome]:
        return [o for o in states if set(o.candidate.states) == set(wanted)]

    return {
        "velocity": [o for o in states if o.candidate.states and set(o.candidate.states) <= motion],
        "displacement": seeing("velocity", "displacement"),
        "acceleration": seeing("velocity", "acceleration"),
        "both": seeing("velocity", *motion),
        "past": [o for o in past if o.candidate.past_values > centre.past_values],
        "fewer-past": [o for o in past if o.candidate.past_values < centre.past_values],
        "layers": [o for o in shapes if len(o.candidate.hidden) > depth],
        "fewer-layers": [o for o in shapes if len(o.candidate.hidden) < depth],
        "neurons": [
            o for o in shapes if len(o.candidate.hidden) == depth > 0 and o.candidate.hidden[0] > centre.hidden[0]
        ],
    }


def _compare(name: str, statement: str, reference: Outcome | None, others: Sequence[Outcome], claim: str) -> Finding:
    nan = float("nan")
    if reference is None or not others:
        return Finding(name, statement, "", "", nan, nan, nan, nan, "", "not tested")
    level = "refined" if reference.is_refined and any(o.is_refined for o in others) else "screened"
    rated = [o for o in others if level == "screened" or o.is_refined]
    other = min(rated, key=lambda o: score(getattr(o, level)).mean)
    first, second = score(getattr(reference, level)), score(getattr(other, level))
    change = second.mean / first.mean - 1.0
    # start by start, because both have the same splits
    uncertainty = 2.0 * score(getattr(other, level) / getattr(reference, level)).standard_error
    clear = abs(np.log(second.mean / first.mean)) > max(uncertainty, np.log1p(WORTHWHILE))
    holds = (clear and change > 0.0) if claim == "worse" else not (clear and change < 0.0)
    return Finding(
        name,
        statement,
        reference.candidate.label,
        other.candidate.label,
        first.mean,
        second.mean,
        change,
        uncertainty,
        level,
        "holds" if holds else "differs",
    )
