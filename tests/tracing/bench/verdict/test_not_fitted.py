"""An effect of the user that the screening leaves out is named with the reason."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from mrpipe.tracing.bench.verdict.not_fitted import own_effects_not_fitted

pytestmark = pytest.mark.property


def _traced(rounds: list[list[str]], **summary: Any) -> Any:
    """Return the part of a tracing that is read: the candidates of each round, and the summary."""
    found = {"declared_effects": [], "untestable": {}, "effects": [], **summary}
    candidates = tuple([SimpleNamespace(name=name) for name in names] for names in rounds)
    return SimpleNamespace(selection=SimpleNamespace(rounds=candidates), summary=found)


def test_an_effect_that_the_screening_leaves_out_is_named() -> None:
    found = own_effects_not_fitted(_traced([["heating", "mine"], ["inertia"]]), ["heating", "mine", "other"])
    assert list(found) == ["other"]
    assert "less of the residual than every effect that was fitted" in found["other"]


def test_an_effect_of_the_program_is_not_an_effect_of_the_user() -> None:
    assert own_effects_not_fitted(_traced([["heating"]]), ["heating", "remanence"]) == {}


def test_declared_untestable_and_named_effects_were_not_left_out() -> None:
    traced = _traced(
        [["heating"]], declared_effects=["given"], untestable={"slow": "no long test"}, effects=[{"name": "found"}]
    )
    assert list(own_effects_not_fitted(traced, ["given", "slow", "found", "other"])) == ["other"]


def test_without_a_residual_nothing_is_left_out() -> None:
    assert own_effects_not_fitted(_traced([]), ["other"]) == {}
