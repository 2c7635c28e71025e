"""What the amplitude of an effect multiplies."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.plant import CURRENT, WIRE_SIZE, YIELD_FORCE
from mrpipe.effects.amplitudes import OF_DRIVE, OF_ONE, OF_YIELD_FORCE, multiplied

pytestmark = pytest.mark.property


def test_an_amplitude_is_a_share_of_the_yield_force_or_a_force_or_a_force_per_drive() -> None:
    wire = np.zeros(WIRE_SIZE)
    wire[YIELD_FORCE], wire[CURRENT] = 120.0, 1.5
    assert [multiplied(wire, kind) for kind in (OF_YIELD_FORCE, OF_ONE, OF_DRIVE)] == [120.0, 1.0, 1.5]
