"""From a folder of measured files to the text of campaign.yaml."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from mrpipe import units
from mrpipe.campaigns.checks import drive_varies
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.files import all_readers, ending_of
from mrpipe.campaigns.proposal.columns import (
    Column,
    Guess,
    floor_columns,
    lay_out_bench,
    lay_out_frame,
    open_columns,
    separator_of,
    share_units,
)
from mrpipe.campaigns.proposal.found import FoundFile, ProposedTests, shared_channels
from mrpipe.campaigns.proposal.frame_tests import frame_tests
from mrpipe.campaigns.proposal.groups import groups_taken, same_length, tests_in_file
from mrpipe.campaigns.proposal.records import lay_out_record
from mrpipe.campaigns.proposal.roles import (
    Condition,
    condition_of,
    drive_in_name,
    propose_roles,
)
from mrpipe.campaigns.proposal.text import TestText, campaign_text
from mrpipe.campaigns.proposal.unreadable import unreadable_channels, why_no_columns
from mrpipe.errors import UserError
from mrpipe.words import counted, listed, noun, some

Rig = Literal["bench", "frame", "both"]

_ONE_ZIP = "put the channels of a record into one zip file"


@dataclass(frozen=True)
class Proposal:
    """A proposed campaign.

    Attributes
    ----------
    rig
        `bench` or `frame`.
    text
        Text of campaign.yaml, with comments.
    channels
        Channel -> column and unit, for a summary.
    tests
        Name of each test and its role or kind.
    unsure
        What the user should check, one line each.
    skipped
        Files that could not be read, with the reason.
    drive_varies
        Whether the training tests of a bench have more than one drive, as an inverse model needs.
    """

    rig: Literal["bench", "frame"]
    text: str
    channels: dict[str, str]
    tests: tuple[tuple[str, str], ...]
    unsure: tuple[str, ...]
    skipped: tuple[str, ...]
    drive_varies: bool = True


def propose_campaigns(folder: Path, name: str, rig: Rig | None, beside: Path) -> list[Proposal]:
    """Propose one campaign for each rig whose tests a folder holds.

    Parameters
    ----------
    folder
        Folder of data files; files in folders within it count too.
    name
        Name of the campaign.
    rig
        Rig, or None to find it from the channels.
    beside
        Folder of the future campaign.yaml.

    Raises
    ------
    UserError
        If the folder holds no readable data file, or none that fits the requested rig.
    """
    paths, skipped, remedies = _data_files(folder), [], []
    kinds = f"one of {', '.join(sorted(all_readers()))}"
    files: list[FoundFile] = []
    for path in paths:
        try:
            file, columns = open_columns(path)
        except UserError as error:
            skipped.append(f"{path.relative_to(folder)}: {_reason(path, error)}")
            remedies.append(error.remedy)
            continue
        if len(columns) < 2:
            reason = f"one channel; {_ONE_ZIP}" if file.accelerations else why_no_columns(file)
            skipped.append(f"{path.relative_to(folder)}: {reason}")
            remedies.append(_ONE_ZIP if file.accelerations else kinds)
            continue
        files += _tests_of(path, file, columns, rig)
    if not files:
        reason = f" ({skipped[0].removesuffix(f'; {_ONE_ZIP}')})" if skipped else ""
        raise UserError(folder, "", f"holds no readable data file{reason}", remedies[0] if remedies else kinds)
    layouts = share_units([item.layout for item in files])
    files = [replace(item, layout=layout) for item, layout in zip(files, layouts, strict=True)]
    proposals = []
    for kind, wanted in (("bench", "damper-bench"), ("frame", "shear-frame")):
        chosen = [item for item in files if item.layout.rig == wanted]
        if chosen:
            label = f"{name}-{kind}" if len({item.layout.rig for item in files}) > 1 else name
            proposals.append(_propose(chosen, folder, label, kind == "bench", beside, skipped))
    found = {item.rig for item in proposals}
    missing = {"bench", "frame"} - found if rig == "both" else {rig} - found if rig else set()
    if missing:
        raise UserError(folder, f"--rig {rig}", f"no test of a {missing.pop()} was found", "name another folder or rig")
    return proposals


def _reason(path: Path, error: UserError) -> str:
    """Return why a file cannot be read, with the file in an archive and the line that are wrong."""
    within = error.source.rpartition(f"{path.name}/")[2] if f"{path.name}/" in error.source else ""
    return ": ".join(filter(None, (within, error.where, error.problem)))


def _tests_of(path: Path, file: DataFile, columns: list[Column], rig: Rig | None) -> list[FoundFile]:
    """Return the tests of a file: one, or several of a bench where groups of columns are tests."""
    groups = tests_in_file(columns, separator_of(file))
    of_a_frame = bool(file.accelerations) or max(floor_columns(members) for _, members in groups) >= 2
    if rig == "frame" or (rig != "bench" and of_a_frame):
        members = same_length(columns)
        layout = lay_out_record(members, file) if file.accelerations else lay_out_frame(members, file)
        return [FoundFile(path, file, members, layout)]
    tests = []
    for group, members in groups:
        own = file.with_clock_of(item.name for item in members)
        tests.append(FoundFile(path, own, members, lay_out_bench(members, own), group))
    return tests


def _data_files(folder: Path) -> list[Path]:
    known = all_readers()
    found = sorted(path for path in folder.rglob("*") if path.is_file() and ending_of(path) in known)
    return [path for path in found if not any(part.startswith(".") for part in path.relative_to(folder).parts)][:500]


def _propose(
    files: list[FoundFile], folder: Path, name: str, bench: bool, beside: Path, skipped: Sequence[str]
) -> Proposal:
    shared = shared_channels(files)
    unsure = _guessed(shared)
    if bench:
        unsure += [
            f"channel {key}: not found; write its column and unit"
            for key in ("displacement", "force")
            if not any(key in item.layout.channels for item in files)
        ]
        unsure += [
            f"test {item.test_name(folder)}: no {key} found in {item.path.name}; write its column and unit"
            for key in ("displacement", "force")
            for item in files
            if key not in item.layout.channels and any(key in other.layout.channels for other in files)
        ]
    unsure += _not_used(files)
    unsure += [f"{item.path.name}: {note}" for item in files for note in (*item.layout.notes, *item.file.notes)]
    found_tests = _bench_tests(files, folder, shared) if bench else frame_tests(files, folder, shared)
    tests, doubt = found_tests.tests, found_tests.doubt
    unsure += [*_guessed_in_tests(tests), *found_tests.notes, *([f"roles: {doubt}"] if doubt else [])]
    unused = sorted({column for item in files for column in item.layout.unused})
    has_clock = all("time" in item.layout.channels or item.file.time_s is not None for item in files)
    rated = has_clock or all(item.file.sampling_rate_hz for item in files)
    if not rated:
        unsure.append("sampling rate: no clock in the files; 1000 Hz is a placeholder")
    text = campaign_text(
        name=name,
        rig="damper-bench" if bench else "shear-frame",
        directory=os.path.relpath(folder.resolve(), beside.resolve()),
        sampling_rate_hz=None if rated else 1000.0,
        channels=shared,
        tests=tests,
        why=found_tests.why,
        doubt=doubt,
        unused=unused,
        unsure=unsure,
        skipped=skipped,
        columns=[(item.name, item.header.quantity, item.header.unit) for item in files[0].columns],
    )
    found: dict[str, Guess] = dict(shared)
    for item in files:
        for key, guess in item.layout.channels.items():
            found.setdefault(key, guess)
    channels = {key: f"{guess.column or guess.value} [{guess.unit}]" for key, guess in found.items()}
    listed = tuple((item.name, ", ".join(word for word in (item.kind, item.role) if word)) for item in tests)
    varies = not bench or _drive_varies(files, tests)
    return Proposal("bench" if bench else "frame", text, channels, listed, tuple(unsure), tuple(skipped), varies)


def _guessed(channels: Mapping[str, Guess]) -> list[str]:
    """Return a line for each doubt about the channels of the campaign; channels with the same doubt share it."""
    found: dict[str, list[str]] = {}
    for key, guess in channels.items():
        if guess.unsure:
            found.setdefault(guess.unsure, []).append(key)
    return [f"{noun(len(keys), 'channel')} {listed(keys)}: {doubt}" for doubt, keys in found.items()]


def _not_used(files: list[FoundFile]) -> list[str]:
    """Return a line for each column that names a channel and cannot be read; files with the same column share it."""
    found: dict[str, list[str]] = {}
    for path in dict.fromkeys(item.path for item in files):
        parts = [item for item in files if item.path == path]
        columns = [column for item in parts for column in item.columns]
        for name, why in unreadable_channels(parts[0].file, columns).items():
            found.setdefault(name, []).append(f"{path.name}: {why}")
    return [
        f"column {column} is not used: {lines[0]}"
        + (f" (and in {counted(len(lines) - 1, 'other file')})" if lines[1:] else "")
        for column, lines in found.items()
    ]


def _guessed_in_tests(tests: Sequence[TestText]) -> list[str]:
    """Return a line for each guess that belongs to single tests only; tests with the same guess share it."""
    found: dict[tuple[str, str, str], list[str]] = {}
    for test in tests:
        for key, guess in test.channels.items():
            if guess.unsure and guess.column:
                found.setdefault((key, guess.column, guess.unsure), []).append(test.name)
    return [
        f"channel {key} of {counted(len(names), 'test')} ({some(names)}), column {column}: {why}"
        for (key, column, why), names in found.items()
    ]


def _bench_tests(files: list[FoundFile], folder: Path, shared: dict[str, Guess]) -> ProposedTests:
    notes = groups_taken([(item.path.name, item.group) for item in files])
    tests, conditions, without = [], [], []
    for item in files:
        own = item.own(shared)
        drive = item.layout.channels.get("drive")
        if drive is None:
            stated = drive_in_name(item.group) or drive_in_name(item.path.stem)
            value, unit = stated or (0.0, "A")
            own["drive"] = Guess(
                "", unit, "" if stated else "no drive in the file or its name: 0 A is a placeholder", value=value
            )
            if not stated:
                without.append(item.test_name(folder))
        conditions.append(_condition(item, own))
        tests.append(TestText(name=item.test_name(folder), file=item.path.relative_to(folder).as_posix(), channels=own))
    if without:
        notes.append(
            f"drive: neither a column nor the name of the file gives it in {counted(len(without), 'test')} "
            f"({some(without)}): 0 A is a placeholder; write the current or voltage at which they were made"
        )
    found = propose_roles([item.path if not item.group else item.path / item.group for item in files], conditions)
    if len(files) == 1:
        time = files[0].layout.channels.get("time")
        clock = files[0].samples(time.column) * units.conversion(time.unit) if time else None
        first, last = (
            (clock[0], clock[-1]) if clock is not None else (0.0, files[0].columns[0].values.size / files[0].rate)
        )
        middle = float(first + 0.65 * (last - first))
        tests = [
            replace(tests[0], name=f"{tests[0].name}-1", role="training", segments=((float(first), middle),)),
            replace(tests[0], name=f"{tests[0].name}-2", role="validation", segments=((middle, float(last)),)),
        ]
        return ProposedTests(
            tests, found.why, notes, "one file only, so training and validation are parts of one record"
        )
    tests = [replace(test, role=role) for test, role in zip(tests, found.roles, strict=True)]
    certain = "repeated" in found.why or "names" in found.why
    return ProposedTests(tests, found.why, notes, "" if certain else found.why)


def _drive_varies(files: list[FoundFile], tests: Sequence[TestText]) -> bool:
    drives = []
    for item, test in zip(files, tests, strict=False):
        if test.role == "training":
            drive = item.layout.channels.get("drive") or test.channels["drive"]
            values = item.samples(drive.column) if drive.column else np.full(2, drive.value or 0.0)
            drives.append(np.nan_to_num(values) * units.conversion(drive.unit))
    return not drives or drive_varies(drives)


def _condition(item: FoundFile, own: dict[str, Guess]) -> Condition:
    displacement = item.layout.channels.get("displacement")
    values = item.samples(displacement.column) if displacement else np.zeros(100)
    size = units.conversion(displacement.unit) if displacement else 1.0
    drive = item.layout.channels.get("drive")
    if drive is not None:
        levels = item.samples(drive.column) * units.conversion(drive.unit)
    else:
        stated = own["drive"]
        levels = np.full(values.size, (stated.value or 0.0) * units.conversion(stated.unit))
    return condition_of(np.nan_to_num(values) * size, np.nan_to_num(levels), item.rate)
