"""What campaign.yaml states about a frame: masses, positions and inertias."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.campaigns import Campaign
from mrpipe.errors import UserError
from mrpipe.modal.declared import check_masses, floor_plan

pytestmark = pytest.mark.property

SOURCE = Path("campaign.yaml")


def campaign(**frame: Any) -> Campaign:
    return Campaign("c", "shear-frame", Path(), (), declared={"frame": frame})


def test_known_and_unknown_masses_are_accepted() -> None:
    check_masses(np.array([2.0, np.nan, 3.0]), 3, SOURCE)


@pytest.mark.parametrize(
    ("masses", "words"),
    [([2.0], "has 1 entries"), ([2.0, 0.0], "mass of floor 2 is 0 kg"), ([np.inf, 1.0], "mass of floor 1 is inf kg")],
)
def test_wrong_masses_are_named(masses: list[float], words: str) -> None:
    with pytest.raises(UserError, match=words):
        check_masses(np.array(masses), 2, SOURCE)


def test_positions_and_inertias() -> None:
    given = campaign(sensor_positions_m={"x": [0, 4], "y": [3, 0]}, floor_inertias_kg_m2=[5.0, 6.0])
    positions, inertias = floor_plan(given, {"x", "y"}, 2, SOURCE)
    assert positions == {"x": (0.0, 4.0), "y": (3.0, 0.0)}
    np.testing.assert_array_equal(inertias, [5.0, 6.0])
    assert floor_plan(campaign(), {"x"}, 2, SOURCE)[0] == {}


def test_a_direction_without_a_position_is_named() -> None:
    with pytest.raises(UserError, match="has no entry 'y'"):
        floor_plan(campaign(sensor_positions_m={"x": [0, 4]}), {"x", "y"}, 2, SOURCE)


def test_a_wrong_number_of_inertias_is_named() -> None:
    with pytest.raises(UserError, match="give one for each floor, 2 in all"):
        floor_plan(campaign(floor_inertias_kg_m2=[5.0]), {"x"}, 2, SOURCE)
