"""Base forms whose steps read the laws of the drive: the laws that are read are those that are fitted."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from mrpipe.dampers.library import base_form
from mrpipe.fitting.coupled import coupled
from mrpipe.fitting.engine import Fit, fit, linear_derivatives, predict
from mrpipe.fitting.solution import regressors
from mrpipe.fitting.start import fit_with_form
from mrpipe.fitting.weighting import weighting
from tests.fitting.spencer import NOISE, SERIES, YIELD_DISPLACEMENT, spencer_fit

LEVELS = np.linspace(0.0, 3.0, 7)


@cache
def _fitted() -> Fit:
    form = base_form("modified-bouc-wen").without_springs()
    return fit_with_form(spencer_fit(0.0, 0.0), form, starts=1, iterations=30)


@pytest.mark.planted
def test_the_modified_bouc_wen_model_is_found_where_the_dashpot_in_series_moves_much() -> None:
    """Laws that were solved for again and again did not converge here: the error was 150 times the noise."""
    found = _fitted()
    values = found.base_values
    force = found.laws[0]
    assert values["yield_displacement"] == pytest.approx(YIELD_DISPLACEMENT, rel=0.03)
    assert values["gamma_share"] == pytest.approx(0.5, abs=0.03)
    np.testing.assert_allclose(force(LEVELS), 20.0 + 8.0 * LEVELS + 14.0 * LEVELS**2, rtol=0.03)
    series = values["c1_a"] + values["c1_b"] * LEVELS
    np.testing.assert_allclose(series, SERIES * (50.0 + 75.0 * LEVELS), rtol=0.02)
    used = found.problem.root_weight > 0.0
    left = found.residual[used] / found.problem.root_weight[used]
    # the steps of 2 ms, 40 times those of the rig, cause another 0.3 N
    assert np.sqrt(np.mean(left**2)) < 2.0 * NOISE


@pytest.mark.property
def test_the_steps_read_the_fitted_laws_and_the_residual_is_that_of_the_damper() -> None:
    found = _fitted()
    for read, fitted in zip(found.problem.reference, found.laws, strict=True):
        np.testing.assert_allclose(read(LEVELS), fitted(LEVELS), rtol=1e-9)
    problem = found.problem
    error = problem.recordings.force - predict(found, problem.recordings) - found.test_offsets[problem.recordings.test]
    np.testing.assert_allclose(error * problem.root_weight, found.residual, atol=1e-8)


@pytest.mark.property
def test_a_fit_without_steps_keeps_its_error_and_no_change_of_a_law_lowers_it() -> None:
    found = _fitted()
    again = fit(found.problem, found.theta, iterations=0)
    assert again.cost == pytest.approx(found.cost, rel=1e-6)
    whole, point = coupled(found.problem, found.theta, weighting(found.problem))
    for place in range(len(found.theta), len(point)):
        for share in (0.98, 1.02):
            moved = point.copy()
            moved[place] *= share
            assert whole.solved(moved).cost >= (1.0 - 1e-3) * found.cost


@pytest.mark.property
def test_derivatives_with_respect_to_the_laws_include_what_the_steps_read() -> None:
    found = _fitted()
    w = weighting(found.problem)
    whole, point = coupled(found.problem, found.theta, w)
    rows = linear_derivatives(found, regressors(found.problem, found.theta))
    for place in range(len(whole.sizes)):
        moved = point.copy()
        moved[len(found.theta) + place] += 1e-4
        slope = (whole.solved(moved).residual - whole.solved(point).residual) / (1e-4 * whole.sizes[place])
        assert np.linalg.norm(rows[place] - slope) < 0.05 * np.linalg.norm(slope)
