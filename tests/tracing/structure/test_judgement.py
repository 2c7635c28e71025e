"""The class of a verdict on a frame follows from the errors on the validation tests."""

from __future__ import annotations

import pytest

from mrpipe.tracing.rules import ValidationRules
from mrpipe.tracing.structure.judgement import Errors

pytestmark = pytest.mark.property

RULES = ValidationRules()


def test_the_noise_floor_is_reached_within_a_quarter() -> None:
    assert Errors(0.1, 0.0124, 0.01, 0.05).explained(RULES)
    assert not Errors(0.1, 0.0126, 0.01, 0.05).explained(RULES)


def test_effects_that_do_not_lower_the_error_explain_nothing() -> None:
    assert not Errors(0.01, 0.01, 0.01, 0.02).explained(RULES)


def test_a_flexible_model_that_is_worse_than_the_effects_proves_nothing() -> None:
    worse = Errors(0.1, 0.02, 0.01, 0.05)
    assert worse.ceiling == 0.02 and worse.recovered == 1.0 and not worse.explained(RULES)


def test_most_of_what_a_flexible_model_reaches_is_sufficient() -> None:
    assert Errors(0.1, 0.03, 0.01, 0.02).explained(RULES)
    half = Errors(0.1, 0.07, 0.01, 0.02)
    assert half.recovered == pytest.approx((1.0 - 0.49) / (1.0 - 0.04)) and not half.explained(RULES)


def test_nothing_to_recover_is_no_division_by_zero() -> None:
    assert Errors(0.02, 0.02, 0.01, 0.02).recovered == 0.0
