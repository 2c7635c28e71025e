"""The last reversal of a motion and the path since then."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.signals.reversals import last_reversal, path_since_reversal

pytestmark = pytest.mark.property


@given(st.lists(st.sampled_from([-1.0, 0.0, 1.0]), min_size=1, max_size=40))
def test_the_direction_is_constant_since_the_last_reversal_and_another_one_before_it(signs: list[float]) -> None:
    direction = np.array(signs)
    for index, turned in enumerate(last_reversal(direction)):
        assert np.all(direction[turned : index + 1] == direction[index])
        assert turned == 0 or direction[turned - 1] != direction[index]


def test_the_path_of_a_triangle_grows_from_zero_to_twice_its_amplitude() -> None:
    velocity = np.repeat([1.0, -1.0, 1.0], [50, 100, 100])
    path = path_since_reversal(velocity, 0.02)
    assert path[49] == pytest.approx(0.98)
    assert path[[50, 150]] == pytest.approx([0.0, 0.0])
    assert path[[149, 249]] == pytest.approx([1.98, 1.98])


def test_a_record_without_samples_has_no_reversals() -> None:
    assert len(last_reversal(np.zeros(0))) == 0
