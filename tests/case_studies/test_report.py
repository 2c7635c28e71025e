"""Figures of the benchmark structures say what they show."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.case_studies.report import histories, index_bars, sensitivity


@pytest.mark.golden
def test_bars_leave_out_indices_that_are_powers_here_or_in_the_thesis() -> None:
    ours = {"vd": {"J1": 0.9, "J6": 0.05}, "passive-on": {"J1": 0.8, "J6": 0.1}}
    figure = index_bars(ours, {"vd": {"J1": 0.63, "J6": 32.55}})
    assert [text.get_text() for text in figure.axes[0].get_xticklabels()] == ["J1"]


@pytest.mark.golden
def test_sensitivity_is_labelled_with_the_capacities() -> None:
    figure = sensitivity([250.0, 1000.0, 4000.0], {"J1": [1.0, 0.9, 0.8]}, unit="capacity [kN]", title="vd")
    assert [text.get_text() for text in figure.axes[0].get_xticklabels()] == ["250", "1000", "4000"]


@pytest.mark.golden
def test_the_grey_curve_has_its_own_name() -> None:
    time = np.arange(10.0)
    figure = histories(time, {"y": time}, 2.0 * time, quantity="a [m/s^2]", reference_name="x")
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["x", "y"]
