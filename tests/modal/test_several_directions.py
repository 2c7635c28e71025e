"""Buildings whose sensors measure in several directions, without declared positions: three modes for each floor."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.identify import _layout
from mrpipe.modal.search.forced_modes import find_modes
from tests.modal.plates import building, shaken

pytestmark = pytest.mark.planted


def test_every_floor_has_two_translations_and_a_turn() -> None:
    rng = np.random.default_rng(5)
    tower = building(rng, 4)
    tests = shaken(tower, rng, rate=50.0, duration_s=120.0)
    layout = _layout(tests)
    assert (layout.floors, layout.modes) == (4, 12)
    found = find_modes(tests.forced, layout, 0.2, 0.0, tests.source).fit
    frequency = found.angular_frequencies / (2.0 * np.pi)
    assert frequency == pytest.approx(tower.frequencies_hz, rel=5e-3)
    assert found.damping_ratios == pytest.approx(tower.damping_ratios, rel=0.1)
