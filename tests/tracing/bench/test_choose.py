"""The measure of a share: the sensors' noise, or what a flexible model can recover."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.tracing.bench.choose import judged_by_trees
from mrpipe.tracing.bench.select import Selection
from mrpipe.tracing.rules import ModelErrorRules
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted
RULES = ModelErrorRules()


def test_what_trees_learn_becomes_the_floor() -> None:
    base = plain_fit("accumulator")
    selection = Selection(base, 1e-3, (), base)
    judged = judged_by_trees(selection, RULES)
    assert selection.noise < judged.noise < 0.5 * base.chi_square


def test_the_noise_stays_the_measure_where_trees_learn_nothing() -> None:
    base = plain_fit("accumulator")
    used = base.problem.root_weight > 0.0
    noise = np.where(used, np.random.default_rng(5).standard_normal(len(used)), 0.0)
    flat = replace(base, residual=noise, cost=float(noise @ noise))
    selection = Selection(flat, 0.9, (), flat)
    assert judged_by_trees(selection, RULES) is selection
