"""What a sweep says: the choice of an architecture, and the thesis' findings with a verdict each (thesis 2.3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.networks.candidates import Candidate
from mrpipe.networks.sweep import Outcome

WORTHWHILE = 0.10
"""Relative change of the error below which two architectures count as equal, whatever the spread."""


@dataclass(frozen=True)
class Score:
    """Error of a candidate over its starts.

    Attributes
    ----------
    mean
        Geometric mean of the held-out NRMSE over starts (a start that failed must not decide).
    standard_error
        Relative standard error of that mean (of the logarithm).
    best, worst
        Over starts.
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
    """Return the smallest refined network within one standard error of the best."""
    refined = [outcome for outcome in outcomes if outcome.is_refined]
    scores = [score(outcome.refined) for outcome in refined]
    best = min(scores, key=lambda item: item.mean)
    limit = best.mean * float(np.exp(best.standard_error))
    within = [outcome for outcome, item in zip(refined, scores, strict=True) if item.mean <= limit]
    return min(within, key=lambda outcome: (outcome.candidate.parameters, score(outcome.refined).mean))


@dataclass(frozen=True)
class Finding:
    """One statement of the thesis and what the sweep says of it.

    Attributes
    ----------
    name, statement
        Short name, and the thesis' words.
    reference, alternative
        Labels of the two that were compared.
    reference_nrmse, alternative_nrmse
        Their mean errors over starts.
    change, uncertainty
        Relative change of the error from reference to alternative (negative: the alternative is better), and two
        standard errors of it.
    level
        `refined` or `screened`: the fit that both have.
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
    """Return the thesis' findings with their verdicts.

    Each compares the thesis' architecture with the best alternative that differs in one respect: the error is smaller
    where more than a tenth and more than two standard errors separate them.
    """
    motion = {"displacement", "acceleration"}

    def like(candidate: Candidate, **same: object) -> bool:
        fields = {"states", "past_values", "hidden", "biases"} - same.keys()
        return all(getattr(candidate, name) == getattr(centre, name) for name in fields)

    def with_states(*states: str) -> list[Outcome]:
        return [o for o in outcomes if like(o.candidate, states=0) and set(o.candidate.states) == set(states)]

    without_velocity = [
        o for o in outcomes if like(o.candidate, states=0) and o.candidate.states and set(o.candidate.states) <= motion
    ]
    more_past = [
        o for o in outcomes if like(o.candidate, past_values=0) and o.candidate.past_values > centre.past_values
    ]
    fewer_past = [
        o for o in outcomes if like(o.candidate, past_values=0) and o.candidate.past_values < centre.past_values
    ]
    depth, width = len(centre.hidden), centre.hidden[0] if centre.hidden else 0
    deeper = [
        o
        for o in outcomes
        if like(o.candidate, hidden=0) and o.candidate.hidden[1:] and len(o.candidate.hidden) > depth
    ]
    wider = [
        o
        for o in outcomes
        if like(o.candidate, hidden=0) and len(o.candidate.hidden) == depth and o.candidate.hidden[0] > width
    ]
    shallower = [o for o in outcomes if like(o.candidate, hidden=0) and len(o.candidate.hidden) < depth]
    table = (
        ("velocity", "velocity is mandatory", without_velocity, "worse"),
        (
            "displacement",
            "displacement besides velocity is no gain",
            with_states("velocity", "displacement"),
            "no gain",
        ),
        (
            "acceleration",
            "acceleration besides velocity is no gain",
            with_states("velocity", "acceleration"),
            "no gain",
        ),
        ("both", "displacement and acceleration are no gain", with_states("velocity", *motion), "no gain"),
        ("past", "more than three past values are no gain", more_past, "no gain"),
        ("fewer-past", "fewer than three past values are worse", fewer_past, "worse"),
        ("layers", "more than two layers are no gain", deeper, "no gain"),
        ("one-layer", "one layer is worse", shallower, "worse"),
        ("neurons", "more than six neurons a layer are no gain", wider, "no gain"),
    )
    reference = next((o for o in outcomes if o.candidate == centre), None)
    return [_compare(name, statement, reference, others, claim) for name, statement, others, claim in table]


def _compare(name: str, statement: str, reference: Outcome | None, others: Sequence[Outcome], claim: str) -> Finding:
    nan = float("nan")
    if reference is None or not others:
        return Finding(name, statement, "", "", nan, nan, nan, nan, "", "not tested")
    level = "refined" if reference.is_refined and any(o.is_refined for o in others) else "screened"
    rated = [o for o in others if level == "screened" or o.is_refined]
    other = min(rated, key=lambda o: score(getattr(o, level)).mean)
    first, second = score(getattr(reference, level)), score(getattr(other, level))
    change = second.mean / first.mean - 1.0
    uncertainty = 2.0 * float(np.hypot(first.standard_error, second.standard_error))
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
