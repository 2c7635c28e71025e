"""The named effects of a model: its selection, the gain of each name, and why no effect is named, if none is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mrpipe.fitting.engine import Fit
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.bench.selection.terms import with_terms_in_order
from mrpipe.tracing.gain import Gain


@dataclass(frozen=True)
class NamedEffects:
    """A selection whose first effects behind the declared ones are named.

    Attributes
    ----------
    selection
        Named effects with their fit, and further terms behind them.
    gains
        Gain of each named effect on tests that were left out; None if it was not computed. Names behind the last gain
        have none.
    declared
        Number of terms that the campaign declares. They come first, are part of every model, and are not named.
    reason
        Why no effect is named; empty if effects are named, or if no effect was needed.
    """

    selection: Selection
    gains: tuple[Gain | None, ...]
    declared: int
    reason: str = ""

    @property
    def places(self) -> range:
        """Indices of the named effects among the terms of the chosen fit."""
        return named_places(self.selection, self.declared)

    def gain(self, number: int) -> Gain | None:
        """Return the gain of a named effect, by its number among the named effects."""
        return self.gains[number] if number < len(self.gains) else None

    def without_one(self, place: int, chosen: Fit) -> NamedEffects:
        """Return the named effects without one of them; there are no further terms.

        Parameters
        ----------
        place
            Index of the dropped effect among the terms of the chosen fit.
        chosen
            The fit without this term.
        """
        number, proven = place - self.declared, len(self.places) - 1
        rounds = self.selection.rounds
        found = replace(
            self.selection,
            chosen=chosen,
            ground=self.selection.ground if proven else chosen,
            proven=proven,
            rounds=tuple(item for k, item in enumerate(rounds) if k != number) or rounds[:1],
        )
        gains = tuple(gain for k, gain in enumerate(self.gains) if k != number)
        return replace(self, selection=found, gains=gains)

    def without_names(self, numbers: Sequence[int]) -> NamedEffects:
        """Return the same model with some of its named effects as further terms, whose cause is not proven.

        Parameters
        ----------
        numbers
            Numbers, among the named effects, of those that become further terms.
        """
        selection, declared = self.selection, self.declared
        alone = selection.with_named_alone.chosen
        count = len(alone.problem.terms) - declared
        kept = [k for k in range(count) if k not in numbers]
        behind = range(declared + count, len(selection.chosen.problem.terms))
        order = [*range(declared), *(declared + k for k in kept), *(declared + k for k in numbers), *behind]
        named = selection.without_effects if not kept else with_terms_in_order(alone, order[: declared + len(kept)])
        found = replace(
            selection,
            chosen=with_terms_in_order(selection.chosen, order),
            named_fit=named,
            proven=len(kept),
            rounds=tuple(selection.rounds[k] for k in kept if k < len(selection.rounds)) or selection.rounds[:1],
        )
        return replace(self, selection=found, gains=tuple(self.gain(k) for k in kept))


def named_places(selection: Selection, declared: int) -> range:
    """Return the indices of the named effects among the terms of the chosen fit; `declared` terms come before them."""
    return range(declared, min(declared + selection.proven, len(selection.chosen.problem.terms)))
