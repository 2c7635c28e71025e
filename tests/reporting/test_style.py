"""Figures with very many points are drawn quickly, and the texts of a figure are kept as they are."""

from __future__ import annotations

import ast
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import mrpipe
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


@pytest.mark.property
def test_texts_of_a_figure_keep_their_digits() -> None:
    figure, axes = figure_with_axes()
    axis = axes[0, 0]
    axis.plot([0.0, 0.123456, 0.2], [0.001, 0.0024, 0.0031])
    axis.set_yticks([0.001, 0.002, 0.003])
    axis.set_title("NRMSE 0.0046 after, test 3a-1.125Hz")
    drawing = as_svg(figure)
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", drawing)
    assert {"0.001", "0.002", "0.003", "NRMSE 0.0046 after, test 3a-1.125Hz"} <= set(texts)
    # the coordinates are still short, because they are most of the file
    assert not re.search(r"\d\.\d{3}", "".join(re.findall(r"<path[^>]*>", drawing)))


@pytest.mark.property
def test_accelerations_have_one_unit_in_tables_figures_and_text() -> None:
    package = Path(mrpipe.__file__).parent
    files = [
        *package.glob("reporting/**/*.py"),
        *package.glob("case_studies/**/report.py"),
        *package.glob("thesis/*page.py"),
        package / "cli" / "output.py",
    ]
    found = []
    for path in files:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        found += [
            f"{path.name}:{node.lineno}"
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant)
            and id(node) not in documentation
            and re.search(r"m/s(\^2|2)", str(node.value))
        ]
    assert not found, "write m/s², as all other tables do"
