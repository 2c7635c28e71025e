"""Evidence for an effect is the product of three reasons, each at most 1."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.tracing.evidence import evidence_of
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.options import NamingRules

pytestmark = pytest.mark.property

RULES = NamingRules()
SHARES = st.floats(0.0, 1.0)


@given(share=SHARES, support=SHARES)
def test_evidence_lies_between_zero_and_the_most_confidence(share: float, support: float) -> None:
    assert 0.0 <= evidence_of(share, support, None, RULES) <= RULES.most_confidence


def test_a_gain_whose_interval_contains_zero_lowers_the_evidence() -> None:
    sure, doubtful = Gain(0.3, (0.1, 0.5)), Gain(0.3, (-0.1, 0.5))
    assert evidence_of(1.0, 1.0, sure, RULES) == RULES.most_confidence
    expected = RULES.doubtful * RULES.most_confidence
    assert evidence_of(1.0, 1.0, doubtful, RULES) == pytest.approx(expected, abs=1e-3)


def test_full_evidence_needs_only_the_share_with_which_a_cause_is_named() -> None:
    assert evidence_of(RULES.named_share, 0.5, None, RULES) == evidence_of(1.0, 0.5, None, RULES)
    assert evidence_of(0.5 * RULES.named_share, 0.5, None, RULES) < evidence_of(1.0, 0.5, None, RULES)
