"""The measure of a share: the sensors' noise, or what a flexible model can recover."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.tracing.bench.model_choice.choose import _with_noise_of, with_floor_of_flexible_model
from mrpipe.tracing.bench.noise.baseline import Baseline, noise_level_of
from mrpipe.tracing.bench.noise.weights import noise_scale
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.rules import ModelErrorRules, NoiseRules
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted
RULES = ModelErrorRules()


def test_what_trees_learn_becomes_the_floor() -> None:
    base = plain_fit("accumulator")
    selection = Selection(base, 1e-3, (), base)
    judged = with_floor_of_flexible_model(selection, RULES)
    assert selection.noise < judged.noise < 0.5 * base.chi_square


def test_the_noise_stays_the_measure_where_trees_learn_nothing() -> None:
    base = plain_fit("accumulator")
    used = base.problem.root_weight > 0.0
    noise = np.where(used, np.random.default_rng(5).standard_normal(len(used)), 0.0)
    flat = replace(base, residual=noise, cost=float(noise @ noise))
    selection = Selection(flat, 0.9, (), flat)
    assert with_floor_of_flexible_model(selection, RULES) is selection


@pytest.mark.parametrize("hum", [0.0, 2.0])
def test_hum_that_only_the_chosen_model_shows_belongs_to_the_noise(hum: float) -> None:
    # the residual of a poor model hides the hum, and a larger noise of the better model was ignored
    poor = plain_fit("accumulator")
    scale = noise_scale(poor)
    assert scale.hum == 0.0
    baseline = Baseline(poor, noise_level_of(poor, scale), np.zeros(0), scale)
    recordings, root = poor.problem.recordings, poor.problem.root_weight
    white = np.random.default_rng(6).standard_normal(len(root))
    line = np.sqrt(2.0) * hum * np.sin(2.0 * np.pi * 50.0 * recordings.time + recordings.test)
    left = root * recordings.force_noise[recordings.test] * (white + line)
    chosen = replace(poor, residual=left, cost=float(left @ left))
    found, selection = _with_noise_of(chosen, baseline, Selection(poor, 1.0, (), chosen), NoiseRules())
    assert selection.noise == found.noise
    if hum:
        assert found.scale.hum == pytest.approx(hum**2, rel=0.2)
        assert found.noise > 0.9 * chosen.chi_square
    else:
        assert found.noise <= baseline.noise
