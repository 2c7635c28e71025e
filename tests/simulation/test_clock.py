"""Time steps of a loop: the plant's step divides the controller's sample."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.simulation.clock import clock_of

pytestmark = pytest.mark.property


@given(
    duration=st.floats(0.5, 100.0),
    rate=st.floats(20.0, 2000.0),
    plant=st.floats(100.0, 20000.0),
    record=st.floats(50.0, 2000.0),
)
def test_steps_fit_together(duration: float, rate: float, plant: float, record: float) -> None:
    clock = clock_of(duration, rate, plant, record)
    assert clock.dt * clock.per_sample == pytest.approx(1.0 / rate)
    assert 1.0 / clock.dt >= plant * (1.0 - 1e-6) or clock.per_sample == 1
    assert clock.steps * clock.dt == pytest.approx(duration, abs=clock.dt)
    assert clock.records == clock.steps // clock.every + 1 and clock.samples >= 1
