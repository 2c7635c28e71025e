"""An effect can lose its name and stay in the model, or leave the model."""

from __future__ import annotations

import pytest

from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.gain import Gain
from tests.tracing.bench.fits import fit_with_terms, plain_fit

pytestmark = pytest.mark.planted


def test_the_term_that_loses_its_name_stands_behind_the_others() -> None:
    plain = plain_fit("accumulator")
    chosen = fit_with_terms("accumulator", ("inertia", "mass"), ("accumulator", "linear"))
    named = NamedEffects(Selection(plain, 1.0, (), chosen, proven=2), (None, None), declared=0)
    found = named.without_names([0])
    kept = found.selection
    assert [item.effect.name for item in kept.chosen.problem.terms] == ["accumulator", "inertia"]
    assert [item.effect.name for item in kept.with_named_alone.chosen.problem.terms] == ["accumulator"]
    assert (kept.proven, found.gains) == (1, (None,))
    assert kept.chosen.chi_square == pytest.approx(chosen.chi_square, rel=1e-3)


def test_the_gains_stay_with_their_names() -> None:
    first, second = Gain(0.3, (0.2, 0.4)), Gain(0.1, (0.05, 0.15))
    chosen = fit_with_terms("accumulator", ("inertia", "mass"), ("accumulator", "linear"))
    selection = Selection(plain_fit("accumulator"), 1.0, (), chosen, proven=2)
    named = NamedEffects(selection, (first, second), declared=0)
    assert named.without_names([0]).gains == (second,)
    assert named.without_names([1]).gains == (first,)
    shorter = named.without_one(0, fit_with_terms("accumulator", ("accumulator", "linear")))
    assert (shorter.gains, shorter.places) == ((second,), range(1))
    assert named.gain(2) is None
