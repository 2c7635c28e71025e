"""The result of a plausibility check, and the samples of one test on which the checks work."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Recording

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """One implausible property of a campaign.

    Attributes
    ----------
    name
        Name of the check, such as `sign-reversed`.
    severity
        `error` if results would almost certainly be wrong, `warning` if the user should check the data.
    sentence
        The finding with its numbers, in plain English.
    remedy
        A sentence that says what the user can do.
    test
        Name of the test; empty where the finding concerns the whole campaign.
    channel
        Name of the channel; empty where no single channel is concerned.
    numbers
        Figures of the finding for programs; each key carries its unit as a suffix.
    """

    name: str
    severity: Severity
    sentence: str
    remedy: str
    test: str = ""
    channel: str = ""
    numbers: Mapping[str, float] = field(default_factory=dict)

    @property
    def line(self) -> str:
        """The finding as one line: place, sentence and remedy."""
        place = ", ".join(part for part in (f"test {self.test}" if self.test else "", self.channel) if part)
        return f"{place}: {self.sentence}; {self.remedy}" if place else f"{self.sentence}; {self.remedy}"

    def as_dict(self) -> dict[str, Any]:
        """Return the finding as plain structure for JSON."""
        return {
            "name": self.name,
            "severity": self.severity,
            "test": self.test or None,
            "channel": self.channel or None,
            "sentence": self.sentence,
            "remedy": self.remedy,
            "numbers": dict(self.numbers),
        }


@dataclass(frozen=True)
class TestArrays:
    """The samples of one bench test in SI, shape (n,) each; `velocity_m_s` is derived where it is None.

    `drive` is in A or V, the same unit for all tests of a comparison.
    """

    __test__ = False  # the name is not a test case for pytest

    name: str
    time_s: FloatArray
    displacement_m: FloatArray
    drive: FloatArray
    force_n: FloatArray
    velocity_m_s: FloatArray | None = None
    role: str = "training"

    @property
    def rate_hz(self) -> float:
        """Sampling rate from the median interval of the clock."""
        return float(1.0 / np.median(np.diff(self.time_s)))


def arrays_of(test: Recording) -> TestArrays:
    """Return the samples of the longest segment of a bench recording."""
    begin, end = max(test.segments, key=lambda item: item[1] - item[0])
    part = {name: values[begin:end] for name, values in test.channels.items()}
    return TestArrays(
        name=test.name,
        time_s=test.time_s[begin:end],
        displacement_m=part["displacement"],
        drive=part["drive"],
        force_n=part["force"],
        role=test.role,
    )
