"""Which effects of the user the tracing did not fit."""

from __future__ import annotations

from collections.abc import Iterable

from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.verdict.summary import Tracing

LEFT_OUT = (
    "by the estimate of the screening it explains less of the residual than every effect that was fitted; a larger "
    "close_loop.refits fits it too"
)
"""Reason why an effect is not among the candidates."""


def own_effects_not_fitted(traced: Tracing, library: Iterable[str]) -> dict[str, str]:
    """Return name -> reason of the user's effects that the screening left out, so that `candidates` lacks them.

    Parameters
    ----------
    traced
        The tracing.
    library
        Names of the effects that could be traced. Those that the program does not contain are the user's.
    """
    rounds = traced.selection.rounds
    if not rounds:
        # without a structured residual nothing is fitted, and no effect is left out
        return {}
    summary = traced.summary
    seen = {item.name for candidates in rounds for item in candidates}
    seen |= {*summary["declared_effects"], *summary["untestable"], *(item["name"] for item in summary["effects"])}
    return {name: LEFT_OUT for name in library if name not in damper_effects() and name not in seen}
