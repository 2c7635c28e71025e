"""A measured campaign in memory: recordings in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray

CAMPAIGN_FILE = "campaign.yaml"
"""Name of the campaign file in the folder of a campaign."""


@dataclass(frozen=True)
class Recording:
    """One test of a campaign.

    Attributes
    ----------
    name, role
        As in campaign.yaml; role is training, validation or repeat.
    sampling_rate_hz
        Nominal rate.
    time_s
        Shape (n,), strictly increasing.
    channels
        Quantity (`displacement`, `drive`, `force`, `floor_acceleration_1`, ...) -> shape (n,), SI.
    segments
        Half-open index ranges to use; the whole test where none were given. Channels hold what lies between the first
        and the last; samples between two segments are not checked and may be NaN.
    kind
        Frame tests: sweep, free-decay, closed-loop or random; empty on a bench.
    details
        Other entries of the test in campaign.yaml (mode, law, gains, shaker floor, ...).
    file
        The data file, for messages; None where the test was not read from a file.
    """

    name: str
    role: str
    sampling_rate_hz: float
    time_s: FloatArray
    channels: Mapping[str, FloatArray]
    segments: tuple[tuple[int, int], ...]
    kind: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)
    file: Path | None = None

    def used(self, channel: str) -> FloatArray:
        """Return the samples of a channel that lie in segments, concatenated."""
        return self._in_segments(self.channels[channel])

    def used_time(self) -> FloatArray:
        """Return the times [s] of the samples that :meth:`used` returns."""
        return self._in_segments(self.time_s)

    def _in_segments(self, values: FloatArray) -> FloatArray:
        if self.segments == ((0, values.size),):
            return values
        return np.concatenate([values[begin:end] for begin, end in self.segments])


@dataclass(frozen=True)
class Campaign:
    """A measured campaign.

    Attributes
    ----------
    name, rig
        As in campaign.yaml; rig is damper-bench or shear-frame.
    directory
        Folder of campaign.yaml.
    recordings
        The tests in order.
    drive_unit
        `A` or `V`, empty where no drive was recorded.
    drive_is_set_point
        True where the drive is a constant written in campaign.yaml and not a recorded channel.
    declared_effects
        Names of effects that the campaign itself declares.
    floor_masses_kg
        Frame campaigns, floor 1 first; empty otherwise.
    declared
        All other entries of campaign.yaml.
    findings
        Findings of the reader for the user (clipping, sign of force, jitter), one line each.
    file_name
        Name of the campaign file in `directory`.
    """

    name: str
    rig: str
    directory: Path
    recordings: tuple[Recording, ...]
    drive_unit: str = ""
    drive_is_set_point: bool = False
    declared_effects: tuple[str, ...] = ()
    floor_masses_kg: tuple[float, ...] = ()
    declared: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[str, ...] = ()
    file_name: str = CAMPAIGN_FILE

    @property
    def file(self) -> Path:
        """The campaign file, for messages."""
        return self.directory / self.file_name

    def with_role(self, role: str) -> tuple[Recording, ...]:
        """Return the recordings of one role."""
        return tuple(item for item in self.recordings if item.role == role)
