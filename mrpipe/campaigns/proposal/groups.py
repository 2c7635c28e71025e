"""Several tests in one file: groups of columns (`run1/force`, `run2/force`), each of which is a separate test."""

from __future__ import annotations

import re
from collections.abc import Sequence

from mrpipe.campaigns.proposal.columns import Column
from mrpipe.words import some

_INDEX = re.compile(r"\[[^\]]*\]$")


def same_length(columns: Sequence[Column]) -> list[Column]:
    """Return the columns with the most samples; others do not belong to the same record."""
    longest = max((item.values.size for item in columns), default=0)
    return [item for item in columns if item.values.size == longest]


def tests_in_file(columns: Sequence[Column], separator: str) -> list[tuple[str, list[Column]]]:
    """Return the tests that a file holds: name of the group and columns of each.

    A group is a test if the headers of its columns name a force and a displacement. Columns outside of all groups, such
    as a common clock, belong to every test of the same length. A file with less than two such groups holds one test,
    whose group has the name "".
    """
    groups: dict[str, list[Column]] = {}
    for item in columns:
        groups.setdefault(_INDEX.sub("", item.name).rpartition(separator)[0] if separator else "", []).append(item)
    common = groups.pop("", [])
    tests = {
        group: same_length(members)
        for group, members in groups.items()
        if {"force", "displacement"} <= {item.header.quantity or item.header.unit_quantity for item in members}
    }
    if len(tests) < 2:
        return [("", same_length(columns))]
    return [
        (group, [*members, *(item for item in common if item.values.size == members[0].values.size)])
        for group, members in tests.items()
    ]


def groups_taken(places: Sequence[tuple[str, str]]) -> list[str]:
    """Return a line for each file whose groups are proposed as tests; `places` has file and group of each test."""
    groups: dict[str, list[str]] = {}
    for file, group in places:
        if group:
            groups.setdefault(file, []).append(group)
    return [
        f"file {name}: its {len(found)} groups of columns ({some(found)}) are taken as tests; delete those that are "
        "none, such as a filtered copy"
        for name, found in groups.items()
    ]
