"""Clusters of poles over the model orders."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.ambient.clusters import clustered
from mrpipe.modal.ambient.poles import Pole


@pytest.mark.property
def test_a_pole_that_wanders_does_not_take_the_place_of_the_one_that_stays():
    """At high orders the wandering pole came first in the list and took the group of the other one."""
    steady = np.array([1.0, -1.0, 0.5 + 0j]) / 1.5
    wandering = np.array([1.0, -0.8, 0.1 + 0j]) / np.linalg.norm([1.0, -0.8, 0.1])
    poles = []
    for order in range(10, 40, 2):
        poles += [Pole(9.53 - 0.001 * order, 0.004, wandering, order)] if order >= 14 else []
        poles.append(Pole(9.47, 0.0135, steady, order))
    best = max(clustered(poles), key=lambda item: item.orders)
    assert best.orders == 15
    assert best.angular_frequency == pytest.approx(9.47)
    assert best.shape == pytest.approx(steady.real, abs=1e-12)
