"""Campaigns of structures that move in several directions: one campaign for each direction, from all its sensors."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.tracing.structure.records import TURN

_SENSOR = re.compile(r"^(floor_(?:acceleration|displacement)_\d+)_([a-z]\w*)$")
_GROUND, _FORCE = "ground_acceleration", "input_force"


def directions_of(campaign: Campaign) -> list[str]:
    """Return the axes in which sensors measure, such as x and y; empty if the campaign has one direction."""
    suffixes = {
        found[2] for item in campaign.recordings for name in item.channels if (found := _SENSOR.match(name)) is not None
    }
    return sorted({suffix[0] for suffix in suffixes})


def in_direction(campaign: Campaign, axis: str) -> Campaign | None:
    """Return the part of a campaign along one axis, as a campaign of a structure with one direction.

    Several sensors on a floor give the translation of its centre of mass, because floors move as rigid plates, and
    `frame.sensor_positions_m` gives the positions of the sensors. Without positions the mean of the sensors is taken.
    Tests without a measured excitation along the axis are left out, unless they are free decays. Dampers are left out.

    Parameters
    ----------
    campaign
        Campaign with channels such as `floor_acceleration_3_x`.
    axis
        First letter of the suffixes.

    Returns
    -------
    The campaign, or None if no test can be used. If the sensors of all floors determine the rotation about the vertical
    in all tests, it has the channels `floor_turn_1` and so on [rad/s2].
    """
    positions = (campaign.declared.get("frame") or {}).get("sensor_positions_m") or {}
    axes = directions_of(campaign)
    tests = [_test_in(item, axis, positions, first=axis == axes[0]) for item in campaign.recordings]
    kept = tuple(item for item in tests if item is not None)
    plates = [_plates_of(item, positions) for item in campaign.recordings if any(item.name == one.name for one in kept)]
    if kept and all(plates):
        kept = tuple(_with_plates(item, own, axis) for item, own in zip(kept, plates, strict=True))
    return replace(campaign, recordings=kept) if kept else None


def _plates_of(test: Recording, positions: Mapping[str, Sequence[float]]) -> dict[str, dict[str, FloatArray]]:
    """Return number of a floor -> acceleration of its centre of mass along each axis, and `turn` [rad/s2].

    The result is empty if the sensors of some floor do not determine its rotation.
    """
    sensors: dict[str, dict[str, FloatArray]] = {}
    for name, values in test.channels.items():
        found = _SENSOR.match(name)
        if found is not None and found[1].startswith("floor_acceleration_"):
            sensors.setdefault(found[1].rpartition("_")[2], {})[found[2]] = values
    plates = {floor: _plate(own, positions) for floor, own in sensors.items()}
    return plates if all(plates.values()) else {}


def _plate(sensors: Mapping[str, FloatArray], positions: Mapping[str, Sequence[float]]) -> dict[str, FloatArray]:
    axes = sorted({name[0] for name in sensors})
    if not set(axes) <= {"x", "y"} or not all(name in positions for name in sensors):
        return {}
    # u_x = u - y turn, u_y = u + x turn
    levers = [-positions[name][1] if name[0] == "x" else positions[name][0] for name in sensors]
    rows = np.column_stack([*([float(name[0] == axis) for name in sensors] for axis in axes), levers])
    if np.linalg.matrix_rank(rows) < rows.shape[1]:
        return {}
    return dict(zip([*axes, "turn"], np.linalg.pinv(rows) @ np.stack(list(sensors.values())), strict=True))


def _with_plates(test: Recording, plates: Mapping[str, Mapping[str, FloatArray]], axis: str) -> Recording:
    channels = dict(test.channels)
    for floor, plate in plates.items():
        channels |= {f"floor_acceleration_{floor}": plate[axis], f"{TURN}{floor}": plate["turn"]}
    return replace(test, channels=channels)


def _test_in(test: Recording, axis: str, positions: Mapping[str, Sequence[float]], *, first: bool) -> Recording | None:
    sensors: dict[str, dict[str, FloatArray]] = {}
    for name, values in test.channels.items():
        found = _SENSOR.match(name)
        if found is not None and found[2][0] == axis:
            sensors.setdefault(found[1], {})[found[2]] = values
    channels = {name: _translation(found, axis, positions) for name, found in sensors.items()}
    details = dict(test.details)
    # a ground channel without a suffix belongs to the direction that its entry names, or to the first one
    said = str(details.get(f"{_GROUND}_direction") or "")
    if f"{_GROUND}_{axis}" in test.channels:
        channels[_GROUND] = test.channels[f"{_GROUND}_{axis}"]
    elif _GROUND in test.channels and (said[:1] == axis if said else first):
        channels[_GROUND] = test.channels[_GROUND]
    for name in test.channels:
        if name.startswith(_FORCE) and _along(name, axis, details, first=first):
            channels[_FORCE] = test.channels[name]
            details["floor"] = details.get(f"{name}_floor", details.get("floor", 1))
    excited = _GROUND in channels or _FORCE in channels or test.kind == "free-decay"
    return replace(test, channels=channels, details=details) if sensors and excited else None


def _along(name: str, axis: str, details: Mapping[str, Any], *, first: bool) -> bool:
    said = str(details.get(f"{name}_direction") or "")
    return said[:1] == axis if said else first


def _translation(sensors: Mapping[str, FloatArray], axis: str, positions: Mapping[str, Sequence[float]]) -> FloatArray:
    """Return the translation of the centre of mass from the sensors of a floor along one axis."""
    histories = np.stack(list(sensors.values()))
    if len(sensors) > 1 and all(name in positions for name in sensors):
        # u_x = u - y turn, u_y = u + x turn
        levers = [-positions[name][1] if axis == "x" else positions[name][0] for name in sensors]
        weights = np.linalg.pinv(np.column_stack([np.ones(len(levers)), levers]))[0]
    else:
        weights = np.full(len(sensors), 1.0 / len(sensors))
    return np.asarray(weights @ histories)
