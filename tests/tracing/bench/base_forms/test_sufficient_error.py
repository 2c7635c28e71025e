"""Largest error of a model that needs nothing more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.tracing.bench.base_forms.sufficient_error import nrmse_of_noise, sufficient_chi_square
from mrpipe.tracing.rules import RaceRules
from tests.tracing.bench.fits import plain_fit


@pytest.mark.property
def test_weights_relative_to_the_force_give_the_noise_as_a_share_of_it() -> None:
    found = plain_fit("asymmetry")
    problem = found.problem
    deviation = 0.05 * problem.recordings.force_rms
    weights = np.where(problem.root_weight > 0.0, 1.0 / deviation, 0.0)
    even = replace(found, problem=replace(problem, root_weight=weights))
    assert nrmse_of_noise(even, 1.0) == pytest.approx(0.05)
    assert nrmse_of_noise(even, 0.25) == pytest.approx(0.025)


@pytest.mark.property
def test_a_multiple_of_small_noise_and_a_share_of_the_force_beyond_large_noise_are_sufficient() -> None:
    rules = RaceRules()
    small = sufficient_chi_square(2.0, 0.005, rules)
    assert small == pytest.approx(2.0 * rules.sufficient**2)
    assert sufficient_chi_square(2.0, 0.0, rules) == small
    # in the root mean square the excess over noise of 10 % is the share of the force
    large = sufficient_chi_square(2.0, 0.1, rules)
    assert 0.1**2 * (large / 2.0 - 1.0) == pytest.approx(rules.sufficient_share**2)
