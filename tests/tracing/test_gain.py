"""A gain is significant if its whole interval is positive."""

from __future__ import annotations

import pytest

from mrpipe.tracing.gain import Gain

pytestmark = pytest.mark.property


@pytest.mark.parametrize(("low", "significant"), [(0.01, True), (0.0, False), (-0.1, False)])
def test_the_lower_end_of_the_interval_decides(low: float, significant: bool) -> None:
    assert Gain(0.2, (low, 0.4)).significant is significant
