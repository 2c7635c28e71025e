"""What loops with one damper and with several refuse alike."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.simulation.checks import check_loop

pytestmark = pytest.mark.property


def frame(mass: np.ndarray) -> SimpleNamespace:
    return SimpleNamespace(name="test", mass=mass, floors=len(mass))


def options(delay_s: float = 0.0, driver_time_constant_s: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(delay_s=delay_s, driver_time_constant_s=driver_time_constant_s)


def test_a_sound_frame_passes() -> None:
    check_loop(frame(np.diag([1.0, 2.0])), options(0.002, 0.01))


@pytest.mark.parametrize("times", [{"delay_s": -0.001}, {"driver_time_constant_s": -0.1}])
def test_negative_times_are_refused(times: dict[str, float]) -> None:
    with pytest.raises(UserError, match="negative"):
        check_loop(frame(np.eye(2)), options(**times))


def test_a_floor_without_mass_is_refused() -> None:
    with pytest.raises(UserError, match="singular"):
        check_loop(frame(np.diag([1.0, 0.0])), options())
