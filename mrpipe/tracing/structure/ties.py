"""Ties: effects that explain a residual equally well. None is named; the test that separates them is proposed.

Each effect is compared in its best form. A rival of the best effect leaves hardly more of the residual, and predicts
the tests that were left out hardly worse. The best effect is named, with its rivals, if its errors are smaller with
certainty on the tests that were left out, or on all training tests. Otherwise the effects are tied, and none is named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.fit import solve
from mrpipe.tracing.structure.rounds import FrameCandidate, FrameSelection, projected
from mrpipe.words import listed, separating_tests


@dataclass(frozen=True)
class Tie:
    """Effects that these tests do not separate.

    Attributes
    ----------
    names
        Their names, the one that fits best first.
    tests
        Tests that separate the first one from another one; empty if the library proposes none.
    """

    names: tuple[str, ...]
    tests: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the keys of docs/close-loop-json.md."""
        return {"effects": list(self.names), "separating_tests": list(self.tests)}

    def sentence(self, what: str = "what is missing") -> str:
        """Return that the effects explain something equally well, and the tests that separate them."""
        proposed = f"; {separating_tests(self.tests)}" if self.tests else ""
        return f"{listed(self.names)} explain {what} equally well, and these tests do not separate them{proposed}"


def tie_between(effects: Sequence[StructuralEffect]) -> Tie:
    """Return the tie of some effects, the one that fits best first."""
    first = effects[0]
    tests = []
    for other in effects[1:]:
        advice = first.separated_by.get(other.name) or other.separated_by.get(first.name)
        if advice is not None and advice.advice not in tests:
            tests.append(advice.advice)
    return Tie(tuple(item.name for item in effects), tuple(tests))


def rivals_of(candidates: Sequence[FrameCandidate], rules: NamingRules) -> list[FrameCandidate]:
    """Return the other candidates of a round that explain almost as much as the best one.

    Parameters
    ----------
    candidates
        Candidates of one round, best first.
    rules
        Rules for naming an effect.
    """
    return [item for item in candidates[1:] if item.alike and item.behind < rules.lead]


def tie_below_noise(selection: FrameSelection) -> Tie | None:
    """Return the tie of effects that are smaller than the noise of each line; None if there are fewer than two."""
    alike = selection.below_noise.alike if selection.below_noise and not selection.chosen else ()
    if len(alike) < 2:
        return None
    ranked = {item.name: item.outcome.fitted.placed.effect for item in selection.rounds[0]}
    return tie_between([ranked[name] for name in alike])


def without_ties(selection: FrameSelection, rules: NamingRules) -> tuple[FrameSelection, Tie | None]:
    """Return a selection without the first effect that is tied and those after it, and the tie.

    Parameters
    ----------
    selection
        Linear frame and effects, as chosen on the training records.
    rules
        Rules for naming an effect.
    """
    for place in range(selection.declared, len(selection.chosen)):
        candidates = selection.rounds[place - selection.declared]
        rivals = [item for item in rivals_of(candidates, rules) if item.undecided]
        if not rivals:
            continue
        first = selection.chosen[place].placed.effect
        tie = tie_between([first, *(item.outcome.fitted.placed.effect for item in rivals)])
        return _shortened(selection, place), tie
    return selection, None


def _shortened(selection: FrameSelection, count: int) -> FrameSelection:
    """Return a selection with its first effects only; the rounds remain, because they rank the candidates."""
    kept = selection.chosen[:count]
    alone = len(selection.chosen) - selection.elsewhere
    shorter = replace(
        selection, chosen=kept, gains=selection.gains[: count - selection.declared], elsewhere=max(0, count - alone)
    )
    if not kept:
        return replace(shorter, amplitudes=selection.amplitudes[:0], residual=selection.residual[:0])
    solved = solve(selection.design, projected(selection.design, kept, selection.about))
    return replace(shorter, amplitudes=solved.amplitudes, residual=solved.residual)
