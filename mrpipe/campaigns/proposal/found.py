"""A file, or a group of its columns, that is a test; and the tests that are proposed from such files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mrpipe import units
from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.files import ending_of
from mrpipe.campaigns.proposal.columns import Column, Guess, Layout
from mrpipe.campaigns.proposal.text import TestText


@dataclass(frozen=True)
class FoundFile:
    """A test in a data file: its columns, and the channels that they hold.

    Attributes
    ----------
    path, file
        The file.
    columns
        Columns of the test.
    layout
        Channels of the test.
    group
        Group of the columns within the file; empty for the whole file.
    """

    path: Path
    file: DataFile
    columns: list[Column]
    layout: Layout
    group: str = ""

    @property
    def rate(self) -> float:
        """Sampling rate as far as it is known [Hz], else 1000."""
        time = self.layout.channels.get("time")
        if time is not None:
            steps = np.diff(self.samples(time.column)) * units.conversion(time.unit)
            return float(1.0 / max(float(np.median(steps)), 1e-9))
        return self.file.sampling_rate_hz or 1000.0

    def samples(self, column: str) -> FloatArray:
        """Return a column's samples, shape (n,)."""
        return next(item.values for item in self.columns if item.name == column)

    def samples_of_channels(self) -> dict[str, FloatArray]:
        """Return channel -> samples, shape (n,), NaN replaced by zero."""
        guesses = self.layout.channels.items()
        return {key: np.nan_to_num(self.samples(guess.column)) for key, guess in guesses if guess.column}

    def own(self, shared: Mapping[str, Guess]) -> dict[str, Guess]:
        """Return the channels that differ from those of the campaign."""
        return {
            key: guess
            for key, guess in self.layout.channels.items()
            if key not in shared or (guess.column, guess.unit) != (shared[key].column, shared[key].unit)
        }

    def test_name(self, folder: Path) -> str:
        """Return the name of the test: folders within `folder`, file and group."""
        relative = self.path.relative_to(folder)
        parts = [*relative.parent.parts, relative.name[: -len(ending_of(self.path))], *self.group.split("/")]
        return "-".join(filter(None, parts)).replace(" ", "_").strip(".") or "test"


class ProposedTests(NamedTuple):
    """Proposed tests, the source of their roles or kinds, open questions, and what is unsure about the roles."""

    tests: list[TestText]
    why: str
    notes: list[str]
    doubt: str


def shared_channels(files: Sequence[FoundFile]) -> dict[str, Guess]:
    """Return the channels of the campaign: those of all files, each with the guess that most files share.

    A channel that some files lack belongs to the tests that have it, because the reader would look for its column in
    every file.
    """
    names = list(dict.fromkeys(key for item in files for key in item.layout.channels))
    shared = {}
    for key in names:
        if any(key not in item.layout.channels for item in files):
            continue
        guesses = [item.layout.channels[key] for item in files if key in item.layout.channels]
        shared[key] = max(
            guesses, key=lambda guess: sum((g.column, g.unit) == (guess.column, guess.unit) for g in guesses)
        )
    return shared
