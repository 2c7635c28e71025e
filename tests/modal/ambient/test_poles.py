"""Poles of responses alone at many model orders."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.ambient.poles import ESTIMATORS, Records
from tests.modal.towers import Sensors, ambient_test, random_tower


@pytest.mark.planted
@pytest.mark.parametrize("name", ["ssi", "plscf"])
def test_every_mode_is_a_pole_of_most_orders_with_its_damping_and_shape(name):
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    rng = np.random.default_rng(2)
    tower = random_tower(rng, floors=3, damping=(0.01, 0.02))
    rate = 20.0
    seen = ambient_test(tower, rng, Sensors(noise=0.02), rate=rate, duration_s=2400.0)
    blocks = tuple(np.ascontiguousarray(part.T) for part in np.array_split(seen - seen.mean(axis=0), 4))
    records = Records(blocks, rate, 40, 0.45 * rate)
    estimator = ESTIMATORS[name]
    statistic = np.mean([estimator.statistic(block, records) for block in blocks], axis=0)
    orders = list(estimator.orders(3, 3))[:6]
    poles = estimator.poles(statistic, records, orders)
    for frequency, ratio, shape in zip(tower.frequencies_hz, tower.damping_ratios, tower.shapes.T, strict=True):
        near = [pole for pole in poles if abs(pole.angular_frequency / (2.0 * np.pi * frequency) - 1.0) < 0.01]
        assert len({pole.order for pole in near}) >= 4
        # the damping of the exponential window of pLSCF is as large as that of the modes and must be gone
        assert np.median([pole.damping_ratio for pole in near]) == pytest.approx(ratio, rel=0.3)
        unit = shape / np.linalg.norm(shape)
        assert np.median([abs(np.vdot(pole.shape, unit)) for pole in near]) > 0.99
