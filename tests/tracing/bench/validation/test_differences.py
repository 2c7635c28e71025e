"""A gain that a session of validation tests shares is a difference, although no single test stands out."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.tracing.bench.residuals.nuisances import SessionGain
from mrpipe.tracing.bench.validation.differences import Comparison, with_session
from mrpipe.tracing.rules import ValidationRules
from mrpipe.tracing.verdict import Difference
from tests.tracing.bench.residuals.test_nuisances import recordings

pytestmark = pytest.mark.property

RULES = ValidationRules()
WEAKER = ("t1", "t2", "t3", "t4")


def session(with_it: float) -> SessionGain:
    return SessionGain(0.93, (0.92, 0.94), WEAKER, 0.02, 0.078, with_it)


def nothing_found() -> Comparison:
    return Comparison((), recordings().used, 0.0, None)


def test_a_session_whose_gain_accounts_for_the_error_is_a_difference() -> None:
    """On labcontrol seven of nine tests are weaker by 7 %, within what single training tests scatter."""
    validation = recordings()
    found = with_session(nothing_found(), session(0.047), validation, 0.01, RULES)
    (difference,) = found.differences
    assert (difference.kind, difference.tests, difference.value) == ("gain", WEAKER, 0.93)
    assert "0.93 times the simulated one" in difference.sentence
    assert found.corrected == 0.047
    assert found.accounted > 0.5
    compared = {validation.names[k] for k in np.unique(validation.test[found.comparable])}
    assert compared == set(validation.names) - set(WEAKER)


def test_a_session_that_accounts_for_little_is_none() -> None:
    before = nothing_found()
    assert with_session(before, session(0.07), recordings(), 0.01, RULES) is before
    assert with_session(before, None, recordings(), 0.01, RULES) is before


def test_differences_of_single_tests_that_account_for_the_error_stay() -> None:
    odd = Difference("gain", ("t0",), 0.5, "1", "t0: the measured force is 0.5 times the simulated one")
    before = Comparison((odd,), recordings().used, 0.9, 0.02)
    assert with_session(before, session(0.047), recordings(), 0.01, RULES) is before
