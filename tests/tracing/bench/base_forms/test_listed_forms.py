"""Base forms without effects that the result lists."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from mrpipe.dampers.library import base_form
from mrpipe.fitting.engine import Fit
from mrpipe.tracing.bench.base_forms.fits_of_forms import fits_without_effects
from mrpipe.tracing.bench.base_forms.listed_forms import COMMON_FORMS, listed_fits_without_effects
from mrpipe.tracing.bench.base_forms.race import Race
from mrpipe.tracing.bench.selection.select import fit_on_draft_tests
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def _race(models: list[tuple[str, tuple[str, ...], Any]]) -> Race:
    items = tuple(SimpleNamespace(form=form, effects=effects, fit=fitted) for form, effects, fitted in models)
    return cast(Race, SimpleNamespace(models=items, own=(), coupled=frozenset()))


def test_every_base_form_of_the_race_is_listed_without_effects() -> None:
    plain = plain_fit("accumulator")
    drafted = fits_without_effects(fit_on_draft_tests(plain), {name: base_form(name) for name in ("lugre", "dahl")})
    models = [(name, (), fitted) for name, fitted in drafted.items()]
    found = listed_fits_without_effects(plain, _race([*models, ("kwok", ("accumulator",), None)]))
    assert next(iter(found)) == "bouc-wen"
    assert set(found) == {*COMMON_FORMS, "lugre"}
    for name, fitted in found.items():
        assert isinstance(fitted, Fit) and fitted.problem.base.name == name and not fitted.problem.terms
        assert fitted.problem.root_weight.shape == plain.problem.root_weight.shape


def test_the_common_forms_are_listed_without_a_race() -> None:
    assert set(listed_fits_without_effects(plain_fit("accumulator"), None)) == set(COMMON_FORMS)
