"""Section of the report on a closed loop."""

import pytest

from mrpipe.reporting.simulate import _table


@pytest.mark.golden
def test_the_law_that_others_are_compared_with_keeps_its_own_indices() -> None:
    own, viscous = {"rms_x1_m": 0.006}, {"rms_x1_m": 0.005}
    table = _table("vd", own, viscous)
    assert list(table.columns) == ["index", "vd"] and table["vd"][0] == 0.006
    table = _table("fdns", own, viscous)
    assert list(table.columns) == ["index", "fdns", "vd", "over vd"]
    assert (table["fdns"][0], table["vd"][0]) == (0.006, 0.005)
