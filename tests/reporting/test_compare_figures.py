"""The page of a comparison: numbers that a reader can compare."""

import pandas as pd
import pytest

from mrpipe.reporting.compare_figures import _readable


@pytest.mark.golden
def test_small_numbers_and_missing_values_are_readable() -> None:
    rows = [("p_value", 3.17231e-4, 1.34207e-19), ("share", None, float("nan")), ("name", "a", 3)]
    table = _readable(pd.DataFrame(rows, columns=["key", "first", "stages"], dtype=object))
    assert table["first"].tolist() == ["0.000317231", "-", "a"]
    assert table["read by"].tolist() == ["1.34207e-19", "-", "3"]
