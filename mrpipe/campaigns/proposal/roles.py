"""Which tests train and which validate: by their names, by repeated conditions, else by their drive."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.plausibility.reference import mean_frequency
from mrpipe.campaigns.proposal.words import split_words

VALIDATION = {"val", "valid", "validation", "vali", "validierung", "verification", "check", "holdout"}
TRAINING = {"train", "training", "cal", "calibration", "identification", "ident", "lernen"}
_DRIVE = re.compile(r"(?<![A-Za-z\d.,])(\d+(?:[.,p]\d+)?)\s*_?(mA|A|V)(?![A-Za-z])")


@dataclass(frozen=True)
class Condition:
    """Motion and drive of a bench test: mean frequency [Hz], RMS displacement [m], mean and spread of the drive."""

    frequency: float
    amplitude: float
    drive: float
    drive_spread: float

    def like(self, other: Condition, largest_drive: float) -> bool:
        """Return whether another test repeats this one."""
        return (
            abs(self.frequency - other.frequency) <= 0.08 * max(self.frequency, other.frequency)
            and abs(self.amplitude - other.amplitude) <= 0.08 * max(self.amplitude, other.amplitude)
            and abs(self.drive - other.drive) <= 0.04 * largest_drive
            and abs(self.drive_spread - other.drive_spread) <= 0.08 * largest_drive
        )


def condition_of(displacement: FloatArray, drive: FloatArray, rate: float) -> Condition:
    """Return the condition of a test from its samples, shape (n,) each."""
    return Condition(
        mean_frequency(displacement, rate),
        float(np.std(displacement)),
        float(np.mean(np.abs(drive))),
        float(np.std(drive)),
    )


def drive_in_name(name: str) -> tuple[float, str] | None:
    """Return a drive that a file name states, such as (0.5, A) for `sine_1Hz_0.5A`."""
    found = _DRIVE.search(name)
    return (float(found[1].replace(",", ".").replace("p", ".")), found[2]) if found else None


@dataclass(frozen=True)
class Roles:
    """The role of each test, and how it was found, in a sentence."""

    roles: tuple[str, ...]
    why: str


def _named_roles(paths: Sequence[Path]) -> list[str]:
    """Return the role that each file name states, empty where it states none."""
    words = [{word for part in (path.stem, path.parent.name) for word in split_words(part)} for path in paths]
    return ["validation" if item & VALIDATION else "training" if item & TRAINING else "" for item in words]


def propose_frame_roles(paths: Sequence[Path], kinds: Sequence[str]) -> list[str]:
    """Return a role for each test of a frame.

    Names decide where they state roles. Otherwise one test validates: the last of the forced tests of the kind with
    the most tests, where there are at least two forced tests. The last of several closed-loop tests validates too.
    """
    named = _named_roles(paths)
    if "validation" in named and any(role != "validation" for role in named):
        return [role or "training" for role in named]
    roles = ["training"] * len(paths)
    forced = [index for index, kind in enumerate(kinds) if kind in ("sweep", "random")]
    if len(forced) > 1:
        most = max(("sweep", "random"), key=lambda kind: sum(kinds[index] == kind for index in forced))
        roles[[index for index in forced if kinds[index] == most][-1]] = "validation"
    loops = [index for index, kind in enumerate(kinds) if kind == "closed-loop"]
    if len(loops) > 1:
        roles[loops[-1]] = "validation"
    return roles


def propose_roles(paths: Sequence[Path], conditions: Sequence[Condition]) -> Roles:
    """Return a role for each test.

    Names decide where they state roles. Else one of each group of repeated tests validates. Else about a quarter of the
    tests validate, chosen so that their drive lies between those of training tests.
    """
    named = _named_roles(paths)
    if "validation" in named and any(role != "validation" for role in named):
        return Roles(tuple(role or "training" for role in named), "by the names of the files")
    if len(paths) == 1:
        return Roles(("training",), "there is one file: its first part trains, its last part validates")
    largest = max((item.drive for item in conditions), default=0.0)
    groups: list[list[int]] = []
    for index, condition in enumerate(conditions):
        group = next((item for item in groups if conditions[item[0]].like(condition, largest)), None)
        groups.append([index]) if group is None else group.append(index)
    roles = ["training"] * len(paths)
    repeated = [group for group in groups if len(group) > 1]
    if repeated:
        for group in repeated:
            roles[group[-1]] = "validation"
        several = f"each of the {len(repeated)} groups" if len(repeated) > 1 else "the only group"
        return Roles(tuple(roles), f"the last of {several} of repeated tests validates")
    order = sorted(range(len(paths)), key=lambda index: (conditions[index].drive, conditions[index].amplitude))
    inner = order[1:-1] if len(order) > 2 else order[-1:]
    wanted = max(1, len(paths) // 4)
    for index in np.linspace(0, len(inner) - 1, wanted + 2)[1:-1] if len(inner) > wanted else range(len(inner)):
        roles[inner[round(float(index))]] = "validation"
    return Roles(tuple(roles), "no test repeats another: a quarter of the tests validates, none of extreme drive")
