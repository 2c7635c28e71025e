"""What campaign.yaml states about a frame: masses, positions of the sensors and moments of inertia."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign
from mrpipe.errors import UserError


def floor_plan(
    campaign: Campaign, directions: Collection[str], floors: int, source: Path
) -> tuple[dict[str, tuple[float, float]], FloatArray]:
    """Return positions of the sensors by direction [m], and moments of inertia of the floors [kg m^2].

    Parameters
    ----------
    campaign, source
        The campaign, and campaign.yaml for messages.
    directions
        Directions of all sensors that are used.
    floors
        Number of floors.

    Raises
    ------
    UserError
        If a direction has no position, or the number of inertias is wrong.
    """
    known = campaign.declared.get("frame") or {}
    given = known.get("sensor_positions_m") or {}
    positions = {str(name): (float(x), float(y)) for name, (x, y) in given.items()}
    inertias = np.asarray(known.get("floor_inertias_kg_m2") or (), dtype=np.float64)
    missing = sorted(set(directions) - set(positions))
    if positions and missing:
        place = "frame.sensor_positions_m"
        raise UserError(source, place, f"has no entry {missing[0]!r}", "give x and y of every sensor's suffix in m")
    if inertias.size and inertias.size != floors:
        place = "frame.floor_inertias_kg_m2"
        raise UserError(source, place, f"has {inertias.size} entries", f"give one for each floor, {floors} in all")
    return positions, inertias


def check_masses(masses: FloatArray, floors: int, source: Path) -> None:
    """Refuse masses that are too few or not positive.

    Parameters
    ----------
    masses
        Shape (n,) [kg]; nan where unknown.
    floors
        Highest floor with a sensor.
    source
        campaign.yaml, for messages.

    Raises
    ------
    UserError
        Naming the number of masses, or the floor.
    """
    place = "frame.floor_masses_kg"
    if masses.size < floors:
        raise UserError(source, place, f"has {masses.size} entries", f"the channels are of {floors} floors")
    for floor, mass in enumerate(masses, start=1):
        if np.isinf(mass) or mass <= 0.0:
            raise UserError(source, place, f"mass of floor {floor} is {mass:g} kg", "give a positive mass in kg")
