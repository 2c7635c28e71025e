"""Arrays without a reference count in compiled code."""

import sys
from typing import Any

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.borrowed import borrowed


@njit
def _double_second_half(values: FloatArray) -> float:
    kept = np.arange(4.0)
    inside, given = borrowed(kept), borrowed(values)
    half = given[given.shape[0] // 2 :]
    for index in range(half.shape[0]):
        half[index] *= 2.0
    total = float(np.sum(inside[1:3]))
    kept[0] = 0.0
    return total


@njit
def _of_a_number(value: float) -> Any:
    return borrowed(value)


@pytest.mark.property
def test_slices_of_a_borrowed_array_read_and_write_the_array_itself() -> None:
    values = np.ones(6)
    assert _double_second_half(values) == pytest.approx(3.0)
    np.testing.assert_array_equal(values, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


@pytest.mark.property
def test_the_reference_count_of_the_argument_does_not_change() -> None:
    values = np.ones(6)
    _double_second_half(values)
    before = sys.getrefcount(values)
    for _ in range(100):
        _double_second_half(values)
    assert sys.getrefcount(values) == before


@pytest.mark.property
def test_only_arrays_can_be_borrowed() -> None:
    with pytest.raises(TypingError, match="takes an array"):
        _of_a_number(1.0)
