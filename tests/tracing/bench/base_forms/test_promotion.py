"""The winner of a race on all training tests, and the candidates that it competed with."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.base_forms.promotion import winner_on_all_tests, with_candidates
from mrpipe.tracing.bench.base_forms.race import Model, Race
from mrpipe.tracing.bench.selection.select import Selection, fit_on_draft_tests, forward_selection
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


@pytest.fixture(scope="module")
def base() -> Fit:
    return plain_fit("accumulator")


@pytest.fixture(scope="module")
def search(base: Fit) -> Selection:
    terms = [
        Term(effect, effect.forms[0]) for effect in map(damper_effects().get, ("accumulator", "inertia")) if effect
    ]
    return forward_selection(fit_on_draft_tests(base), 1.0, terms, most=1)


@pytest.fixture(scope="module")
def found(base: Fit, search: Selection) -> Race:
    counts = np.bincount(base.problem.recordings.test).astype(np.float64)
    fits = [fit_on_draft_tests(base), *(item.fit for item in search.rounds[0])]
    models = tuple(Model(item, item.chi_square * counts) for item in fits)
    return Race(models, "bouc-wen", (), {"bouc-wen": search}, counts, 1.0)


def test_the_winner_is_fitted_to_all_tests_and_its_candidates_are_added_later(base: Fit, found: Race) -> None:
    winner = next(model for model in found.models if model.effects == ("accumulator",))
    alone = winner_on_all_tests(found, winner, base)
    assert len(alone.chosen.problem.recordings.force) == len(base.problem.recordings.force)
    assert alone.chosen.chi_square < 0.5 * base.chi_square
    assert alone.rounds == ()
    complete = with_candidates(alone, found)
    assert complete.chosen is alone.chosen
    first, second = complete.rounds[0]
    assert (first.name, second.name) == ("accumulator", "inertia")
    assert first.fit is alone.chosen
    assert second.fit.problem.recordings is base.problem.recordings
    assert first.share > second.share


def test_the_effect_of_the_winner_comes_first_although_another_fits_better(base: Fit, found: Race) -> None:
    other = next(model for model in found.models if model.effects == ("inertia",))
    complete = with_candidates(winner_on_all_tests(found, other, base), found)
    assert complete.rounds[0][0].name == "inertia"
