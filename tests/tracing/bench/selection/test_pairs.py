"""Play is tried together with the starting points of the base form."""

from __future__ import annotations

import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.selection.pairs import with_play
from mrpipe.tracing.bench.selection.select import fit_on_draft_tests
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def test_a_gap_is_found_from_several_starts() -> None:
    found = fit_on_draft_tests(plain_fit("wide-backlash"))
    trials = with_play(found, damper_effects())
    assert trials
    best = min(trials, key=lambda item: item.chi_square)
    assert best.chi_square < 0.3 * found.chi_square
    assert best.term_values[-1]["gap"] == pytest.approx(6e-4, rel=0.2)
    # a model with play gets no second one
    assert with_play(best, damper_effects()) == []


def test_without_the_effect_nothing_is_tried() -> None:
    effects = {name: effect for name, effect in damper_effects().items() if name != "backlash"}
    assert with_play(plain_fit("accumulator"), effects) == []
