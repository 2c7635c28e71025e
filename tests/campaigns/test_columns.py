"""How a column is picked out of a data file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.columns import DataFile
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

ARRAYS = {"x_F": np.arange(12.0).reshape(4, 3), "t": np.arange(4.0), "text": np.array(["a", "b"]), "one": np.ones(1)}
FILE = DataFile(Path("a.mat"), tuple(ARRAYS), ARRAYS.__getitem__, aliases={"time": "t"})


@pytest.mark.parametrize(
    ("column", "expected"),
    [("t", [0, 1, 2, 3]), ("time", [0, 1, 2, 3]), ("x_F[:,2]", [2, 5, 8, 11]), ("x_F[1,:]", [3, 4, 5])],
)
def test_names_aliases_and_indices(column: str, expected: list[float]) -> None:
    assert FILE.column(column, "channels.force").tolist() == expected


def test_a_table_is_indexed_by_position_from_both_ends() -> None:
    table = DataFile(Path("a.csv"), ("t", "x"), {"t": np.arange(3.0), "x": np.ones(3)}.__getitem__, table=True)
    assert table.column(1, "").tolist() == table.column(-1, "").tolist() == [1.0, 1.0, 1.0]
    with pytest.raises(UserError, match="no column 2, the table has 2; count from 0 to 1"):
        table.column(2, "")


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("x_f", "did you mean x_F"),
        ("x_F", r"is not a vector \(4 x 3\)"),
        ("x_F[:,7]", "lies outside an array of 4 x 3"),
        ("x_F[a]", r"index \[a\] is not understood"),
        ("text", "holds no numbers"),
        ("one", "holds one number"),
    ],
)
def test_a_wrong_column_is_named_with_its_remedy(column: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        FILE.column(column, "channels.force")
