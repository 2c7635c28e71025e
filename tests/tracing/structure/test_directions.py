"""Frames that move in two directions are refused with a message: tracing needs one sensor for each floor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.tracing.structure.records import frame_data


@pytest.mark.property
def test_a_channel_with_a_direction_is_refused() -> None:
    time = np.arange(100) / 100.0
    channels = {"ground_acceleration": time, "floor_acceleration_1_x": time}
    test = Recording("sweep-a", "validation", 100.0, time, channels, ((0, 100),), "sweep")
    with pytest.raises(UserError, match="floor_acceleration_1_x has a direction"):
        frame_data(Campaign("tower", "shear-frame", Path(), (test,), floor_masses_kg=(100.0,)))
