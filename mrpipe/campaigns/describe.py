"""Description of a campaign as plain data, for `mrpipe show`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.schema import floor_of, quantity_of
from mrpipe.units import SI_UNITS

if TYPE_CHECKING:
    from mrpipe.campaigns.plausibility import Finding


def describe(campaign: Campaign, judged: Sequence[Finding] = ()) -> dict[str, Any]:
    """Return tests, channels, ranges, rates, durations and findings of a campaign as JSON-able Python (SI).

    `findings` holds one line for each finding of the reader and of the plausibility checks (`judged`); `plausibility`
    holds the latter with their numbers.
    """
    floors = {floor_of(name) for test in campaign.recordings for name in test.channels} - {None}
    content: dict[str, Any] = {
        "campaign": campaign.name,
        "rig": campaign.rig,
        "directory": str(campaign.directory),
        "test_count": len(campaign.recordings),
        "roles": {role: len(campaign.with_role(role)) for role in ("training", "validation", "repeat")},
        "duration_s": float(sum(_duration(test) for test in campaign.recordings)),
    }
    if campaign.drive_unit:
        content["drive_unit"] = campaign.drive_unit
        content["drive_is_set_point"] = campaign.drive_is_set_point
    if floors:
        content["floors"] = max(floor for floor in floors if floor is not None)
    if campaign.floor_masses_kg:
        content["floor_masses_kg"] = list(campaign.floor_masses_kg)
    content["declared_effects"] = list(campaign.declared_effects)
    content["tests"] = [_describe_test(campaign, test) for test in campaign.recordings]
    content["findings"] = [*campaign.findings, *(item.line for item in judged)]
    content["plausibility"] = [item.as_dict() for item in judged]
    return content


def _duration(test: Recording) -> float:
    return float(sum(end - begin for begin, end in test.segments) / test.sampling_rate_hz)


def _describe_test(campaign: Campaign, test: Recording) -> dict[str, Any]:
    row: dict[str, Any] = {"name": test.name, "role": test.role}
    if test.kind:
        row["kind"] = test.kind
    row |= {"sampling_rate_hz": test.sampling_rate_hz, "duration_s": _duration(test)}
    if len(test.segments) > 1:
        row["segments"] = len(test.segments)
    row["channels"] = {
        name: {
            "unit": unit_of(campaign, name),
            "minimum": float(test.used(name).min()),
            "maximum": float(test.used(name).max()),
        }
        for name in test.channels
    }
    if test.details:
        row["details"] = dict(test.details)
    return row


def unit_of(campaign: Campaign, channel: str) -> str:
    """Return the SI unit of a channel."""
    quantity = quantity_of(channel, campaign.rig) or ""
    return campaign.drive_unit if quantity == "drive" else SI_UNITS.get(quantity, "1")
