"""A model with fewer terms, or with its terms in another order, is fitted from where the model was."""

from __future__ import annotations

import pytest

from mrpipe.tracing.bench.selection.terms import other_places, with_terms_in_order
from tests.tracing.bench.fits import fit_with_terms, plain_fit

pytestmark = pytest.mark.planted


def test_the_order_of_the_terms_does_not_change_the_fit() -> None:
    found = fit_with_terms("accumulator", ("inertia", "mass"), ("accumulator", "linear"))
    turned = with_terms_in_order(found, [1, 0])
    assert [term.effect.name for term in turned.problem.terms] == ["accumulator", "inertia"]
    assert turned.chi_square == pytest.approx(found.chi_square, rel=1e-3)


def test_without_the_effect_that_is_there_the_error_is_that_of_the_plain_model() -> None:
    found = fit_with_terms("accumulator", ("inertia", "mass"), ("accumulator", "linear"))
    assert other_places(found, 1) == [0]
    shorter = with_terms_in_order(found, other_places(found, 1))
    assert [term.effect.name for term in shorter.problem.terms] == ["inertia"]
    assert found.chi_square < 0.5 * shorter.chi_square <= 0.5 * 1.001 * plain_fit("accumulator").chi_square
