"""Head of a campaign file, read without the data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mrpipe.artifacts.yaml_source import read_yaml
from mrpipe.campaigns.model import CAMPAIGN_FILE
from mrpipe.campaigns.schema import CampaignEntry
from mrpipe.errors import UserError


@dataclass(frozen=True)
class CampaignHeader:
    """Path of the file, name, rig, kinds of the tests (empty on a bench), declared effects, and control laws.

    `laws` maps the index of a test to its control law and the names of its gains, for tests that state a law.
    """

    file: Path
    campaign: str
    rig: str
    kinds: frozenset[str]
    declared_effects: tuple[str, ...] = ()
    laws: Mapping[int, tuple[str, tuple[str, ...]]] = field(default_factory=dict)


def campaign_file(path: Path) -> Path:
    """Return the campaign file of a campaign, which is given as its directory or as the file.

    Raises
    ------
    UserError
        If there is none.
    """
    path = Path(path)
    file = path / CAMPAIGN_FILE if path.is_dir() else path
    remedy = f"name a directory that holds {CAMPAIGN_FILE}, or such a file"
    if not file.is_file():
        raise UserError(file, "", "no such campaign", remedy)
    if file.suffix.lower() not in (".yaml", ".yml"):
        raise UserError(file, "", "is not a campaign file, because it does not end in .yaml", remedy)
    return file


def read_header(path: Path) -> CampaignHeader:
    """Read the head of a campaign without its data.

    Raises
    ------
    UserError
        If there is no campaign at `path`, or its file is faulty.
    """
    file = campaign_file(path)
    source = read_yaml(file)
    entry = source.build(CampaignEntry, source.content, ())
    kinds = {
        str(test.get("kind") or ("closed-loop" if test.get("law") else ""))
        for test in entry.tests
        if isinstance(test, dict)
    }
    laws = {
        index: (test["law"], tuple(str(name) for name in _gains(test)))
        for index, test in enumerate(entry.tests)
        if isinstance(test, dict) and isinstance(test.get("law"), str)
    }
    return CampaignHeader(file, entry.campaign, entry.rig, frozenset(kinds - {""}), entry.declared_effects, laws)


def _gains(test: Mapping[str, Any]) -> Mapping[str, Any]:
    given = test.get("gains")
    return given if isinstance(given, dict) else {}
