"""Effects that explain a residual alike are reported as a tie, with the test that separates them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.rules import ValidationRules
from mrpipe.tracing.structure.judgement import Errors, Judgement
from mrpipe.tracing.structure.naming import named_effects
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.rounds import FrameSelection
from mrpipe.tracing.structure.ties import rivals_of, tie_between, without_ties
from mrpipe.tracing.structure.trace import FrameTracing, trace_frame
from tests.tracing.structure.rig import frame_campaign

RULES = NamingRules()
EFFECTS = all_structural_effects()


@pytest.fixture(scope="module")
def traced() -> FrameTracing:
    library = [EFFECTS[name] for name in ("cubic-stiffness", "impact")]
    data = frame_data(frame_campaign("cubic-stiffness"))
    return trace_frame(data, library, [], RULES, most=1, draws=50, rng=np.random.default_rng(1))


def with_second(
    selection: FrameSelection, *, alike: bool = True, behind: float = 0.1, undecided: bool = True
) -> FrameSelection:
    """Return a selection whose second candidate of the first round is behind the best one by a share."""
    first, second, *others = selection.rounds[0]
    second = replace(second, alike=alike, behind=behind, undecided=undecided)
    return replace(selection, rounds=((first, second, *others),))


@pytest.mark.property
def test_only_a_candidate_that_fits_alike_on_training_and_left_out_records_is_a_rival(traced: FrameTracing) -> None:
    for alike, behind, expected in ((True, 0.1, 1), (True, 0.5, 0), (False, 0.1, 0)):
        selection = with_second(traced.selection, alike=alike, behind=behind)
        assert len(rivals_of(selection.rounds[0], RULES)) == expected


@pytest.mark.property
def test_a_tied_effect_is_not_named_and_the_separating_test_is_proposed(traced: FrameTracing) -> None:
    assert [item["name"] for item in traced.summary["effects"]] == ["cubic-stiffness"]
    assert traced.summary["tied"] is None
    shorter, tie = without_ties(with_second(traced.selection), RULES)
    assert tie is not None and shorter.chosen == ()
    assert tie.names == ("cubic-stiffness", "impact")
    assert "explain what is missing equally well, and these tests do not separate them" in tie.sentence()
    assert "the same motion at half the amplitude" in tie.sentence()
    assert tie.as_json()["effects"] == ["cubic-stiffness", "impact"]


@pytest.mark.property
def test_an_effect_that_is_better_with_certainty_is_named_with_its_rival(traced: FrameTracing) -> None:
    """Two bumpers with the right name and a confidence of 0.5 to 0.6 had become unknown."""
    selection = with_second(traced.selection, undecided=False)
    kept, tie = without_ties(selection, RULES)
    assert tie is None and [item.name for item in kept.chosen] == ["cubic-stiffness"]
    (named,) = named_effects(kept, traced.after, RULES, explained=True)
    assert named.tied_with == ("impact",)


@pytest.mark.property
def test_a_tie_is_said_unless_the_named_effects_explain_what_is_missing(traced: FrameTracing) -> None:
    _, tie = without_ties(with_second(traced.selection), RULES)
    named = named_effects(traced.selection, traced.after, RULES, explained=True)
    for after, said in ((0.001, False), (0.009, True)):
        errors = Errors(0.01, after, 0.001, 0.001)
        judgement = Judgement(
            traced.selection, named, "", errors, traced.between, (), RULES, ValidationRules(), tie
        )  # fmt: skip
        assert ("what then remains equally well" in judgement.verdict().sentence) is said
        assert (judgement.open_tie is not None) is said


@pytest.mark.property
def test_a_separating_test_is_found_whichever_of_two_effects_declares_it() -> None:
    pairs = [
        tie_between([EFFECTS[a], EFFECTS[b]]) for a, b in (("impact", "yielding"), ("impact", "nonlinear-damping"))
    ]
    assert pairs[0].tests == ()
    assert pairs[1].tests == (EFFECTS["nonlinear-damping"].separated_by["impact"].advice,)
