"""Whether laws over amplitude explain the motion."""

from __future__ import annotations

import pytest

from mrpipe.modal.amplitude.dependence import explains

pytestmark = pytest.mark.property


@pytest.mark.parametrize(
    ("constant", "law", "expected"),
    [
        ([0.81, 0.81], [0.01, 0.02], True),
        # an error beyond the response explains nothing, however much it falls
        ([24.9, 24.9], [14.1, 14.1], False),
        ([24.9, 24.9], [0.9, 0.9], False),
        ([0.04, 0.04], [0.03, 0.03], False),
    ],
)
def test_a_law_leaves_less_than_half_of_the_response_and_of_the_error(
    constant: list[float], law: list[float], expected: bool
) -> None:
    assert explains(constant, law) is expected
