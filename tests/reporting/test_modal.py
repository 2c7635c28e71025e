"""Figures of modes: a line for each direction, and bars where the places are not known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mrpipe.reporting.modal import matrix_tables, mode_shapes, shapes_caption
from mrpipe.structures import Frame

pytestmark = pytest.mark.property

TORSION = [f"floor {floor} {axis}" for floor in (1, 2) for axis in ("x", "y", "rotation")]


def lines(figure) -> list[tuple[list[float], list[float]]]:  # type: ignore[no-untyped-def]
    drawn = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    return [(line.get_xdata().tolist(), line.get_ydata().tolist()) for line in drawn]


def test_each_direction_is_a_line_over_the_floors() -> None:
    shapes = np.array([[0.5], [0.1], [0.02], [1.0], [0.2], [0.04]])
    assert lines(mode_shapes(shapes, [2.0], names=TORSION)) == [
        ([0.0, 0.5, 1.0], [0.0, 1.0, 2.0]),
        ([0.0, 0.1, 0.2], [0.0, 1.0, 2.0]),
        ([0.0, 0.02, 0.04], [0.0, 1.0, 2.0]),
    ]
    assert "rotation in rad" in shapes_caption(TORSION)


def test_floors_are_drawn_over_their_number_or_height() -> None:
    shapes = np.array([[0.4], [np.nan], [1.0]])
    assert lines(mode_shapes(shapes, [2.0])) == [([0.0, 0.4, 1.0], [0.0, 1.0, 3.0])]
    assert lines(mode_shapes(shapes, [2.0], [4.0, 7.0, 10.0])) == [([0.0, 0.4, 1.0], [0.0, 4.0, 10.0])]
    # a reduced structure keeps the numbers of its floors
    assert lines(mode_shapes(shapes[[0, 2]], [2.0], names=["floor 3", "floor 9"])) == [([0, 0.4, 1.0], [0, 3, 9])]


def test_degrees_of_freedom_without_a_place_are_bars_with_names() -> None:
    figure = mode_shapes(np.array([[0.4], [-1.0]]), [2.0], names=["deck x", "pier y"])
    axis = figure.axes[0]
    assert [patch.get_width() for patch in axis.patches] == [0.4, -1.0]
    assert [label.get_text() for label in axis.get_yticklabels()] == ["deck x", "pier y"]


def test_matrices_have_the_names_of_their_rows() -> None:
    tables: dict[str, tuple[pd.DataFrame, str]] = {}

    class Sink:
        def table(self, name: str, frame: pd.DataFrame, caption: str) -> None:
            tables[name] = (frame, caption)

    matrix_tables(Sink(), Frame(np.eye(2), np.eye(2), np.eye(2), degrees_of_freedom=("deck", "deck rotation")))  # type: ignore[arg-type]
    table, caption = tables["stiffness"]
    assert list(table.columns) == ["degree of freedom", "deck", "deck rotation"]
    assert table["degree of freedom"].tolist() == ["deck", "deck rotation"]
    assert caption.startswith("K [N/m]; rows of rotations")
