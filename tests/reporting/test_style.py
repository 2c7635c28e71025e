"""Figures with very many points are drawn without a search for the best place of the legend."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from mrpipe.reporting.style import MOST_POINTS, as_svg, figure_with_axes


@pytest.mark.property
def test_a_figure_of_very_many_points_is_drawn_without_a_warning() -> None:
    figure, axes = figure_with_axes()
    axis = axes[0, 0]
    samples = np.random.default_rng(0).standard_normal(MOST_POINTS + 1)
    axis.plot(samples, label="measured")
    axis.legend(fontsize=7)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        as_svg(figure)
    # the legend lies in the upper right corner, in place of a place that is searched
    assert axis.get_legend()._loc == 1
