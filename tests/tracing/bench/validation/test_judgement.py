"""The class of a verdict follows from errors on validation tests by rule."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from mrpipe.tracing.bench.validation.judgement import (
    Condition,
    Evidence,
    classify,
    lowest_error,
)
from mrpipe.tracing.bench.verdict.naming import calibrated_probability
from mrpipe.tracing.gain import recovered_share
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.rules import ValidationRules

RULES = ValidationRules()


def evidence(
    before: float, after: float, *, structured: bool = True, effects: bool = True, changed: bool = False,
    floor: float = 0.01, ceiling: float = 0.01, worse: float = 0.0, events: float = 0.0,
) -> Evidence:  # fmt: skip
    conditions = tuple(
        Condition(name, before, after + extra, floor, ceiling, 1.02 * ceiling)
        for name, extra in (("a", 0.0), ("b", worse))
    )
    return Evidence(before, after, floor, ceiling, conditions, structured, effects, changed, events)


@pytest.mark.property
@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (evidence(0.1, 0.012), "explained"),
        (evidence(0.1, 0.013), "explained"),
        # at the ceiling on every test, though the ceiling is far above the floor
        (evidence(0.1, 0.051, ceiling=0.05), "explained"),
        # one test is not explained: the average does not hide it
        (evidence(0.1, 0.051, ceiling=0.05, worse=0.03), "partly explained"),
        (evidence(0.1, 0.06), "partly explained"),
        (evidence(0.1, 0.1), "unknown"),
        # a larger error than before never explains anything, not even at the noise floor
        (evidence(0.011, 0.012), "unknown"),
        (evidence(0.011, 0.011, structured=False, effects=False), "noise"),
        (evidence(0.019, 0.019, structured=False, effects=False), "noise"),
        # above twice the floor nothing is noise, whatever the training tests say
        (evidence(0.021, 0.021, structured=False, effects=False), "unknown"),
        (evidence(0.015, 0.015, structured=False, effects=False, worse=0.01), "unknown"),
        (evidence(0.05, 0.05, effects=False), "unknown"),
        (evidence(0.1, 0.012, effects=False, changed=True), "base form"),
        (evidence(0.1, 0.095, effects=False, changed=True), "unknown"),
        # no model learns events that do not repeat, so a high ceiling does not show that they are explained
        (evidence(0.1, 0.051, effects=False, changed=True, ceiling=0.05, structured=False), "base form"),
        # what remains far above the noise has a structure: no flexible model learns it, so it is not explained either
        (evidence(0.1, 0.051, effects=False, changed=True, ceiling=0.05), "unknown"),
        (evidence(0.1, 0.019, effects=False, changed=True, ceiling=0.018), "base form"),
        (evidence(0.1, 0.051, effects=False, changed=True, ceiling=0.05, events=0.045), "unknown"),
        (evidence(0.1, 0.051, ceiling=0.05, events=0.045), "partly explained"),
        (evidence(0.1, 0.012, events=0.045), "explained"),
    ],
)
def test_the_class_follows_from_the_errors(found: Evidence, kind: str) -> None:
    assert classify(found, RULES) == kind


@pytest.mark.property
@given(
    before=st.floats(0.01, 5.0), ratio=st.floats(1.0, 3.0), floor=st.floats(1e-4, 0.5), ceiling=st.floats(1e-4, 5.0),
    structured=st.booleans(), changed=st.booleans(), events=st.floats(0.0, 1.0),
)  # fmt: skip
def test_an_effect_that_does_not_lower_the_error_explains_nothing(
    before: float, ratio: float, floor: float, ceiling: float, structured: bool, changed: bool, events: float
) -> None:
    found = evidence(
        before, ratio * before, structured=structured, changed=changed, floor=floor, ceiling=ceiling, events=events
    )
    assert classify(found, RULES) == "unknown"
    assert found.share == 0.0


@pytest.mark.property
def test_the_share_is_that_of_the_squared_error_beyond_the_ceiling() -> None:
    assert recovered_share(0.1, 0.1, 0.01) == 0.0
    assert recovered_share(0.1, 0.01, 0.01) == 1.0
    assert recovered_share(0.05, 0.04, 0.03) == pytest.approx(9.0 / 16.0)
    # a ceiling above the error that is reached is none
    assert recovered_share(0.1, 0.01, 0.05) == 1.0
    assert recovered_share(0.01, 0.02, 0.01) == 0.0


@pytest.mark.property
@given(pair=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=2))
def test_more_evidence_is_never_less_probable(pair: list[float]) -> None:
    less, more = sorted(pair)
    rules = NamingRules()
    for with_others in (False, True):
        assert (
            0.0
            <= calibrated_probability(less, rules, with_others=with_others)
            <= calibrated_probability(more, rules, with_others=with_others)
            < 1.0
        )
        assert (
            calibrated_probability(less, rules, partly=True) <= calibrated_probability(more, rules, partly=True) < 1.0
        )
    # one of several effects may correct the form of another
    assert calibrated_probability(more, rules, with_others=True) <= calibrated_probability(more, rules)
    # an effect that leaves something may stand for one that the library lacks
    assert calibrated_probability(more, rules, partly=True) <= calibrated_probability(more, rules)


@pytest.mark.property
@pytest.mark.parametrize(
    "pairs", [((0.0, 0.0),), ((0.0, 0.5), (1.0, 0.2)), ((0.5, 0.1), (0.2, 0.9)), ((0.0, 0.0), (1.0, 2.0))]
)
def test_a_calibration_that_falls_or_leaves_0_to_1_is_refused(pairs: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(ValidationError, match="rise"):
        NamingRules(calibration=pairs)


@pytest.mark.property
@given(st.floats(0.01, 1.0), st.floats(0.5, 1.0), st.floats(1.0, 2.0), st.floats(0.001, 2.0))
def test_the_interval_of_the_lowest_error_contains_it(ceiling: float, low: float, high: float, after: float) -> None:
    """The final model may have a lower error than the flexible model, and lie below the interval of the latter."""
    nrmse, interval = lowest_error(ceiling, (low * ceiling, high * ceiling), after)
    assert nrmse == min(ceiling, after)
    assert interval[0] <= nrmse <= interval[1] == high * ceiling
