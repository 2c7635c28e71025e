"""The effects that a campaign declares: those that its rig is known to have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from mrpipe.artifacts.yaml_source import nearest, read_yaml

Kind = TypeVar("Kind")


def declared_effects(names: Sequence[str], known: Mapping[str, Kind], file: Path) -> list[Kind]:
    """Return the effects of the key `declared_effects` of a campaign.

    Parameters
    ----------
    names
        Names that the campaign declares.
    known
        Name -> effect: the library, and the effects of the user's files.
    file
        File of the campaign, for the message.

    Raises
    ------
    UserError
        If a name is unknown; the message names the line of the file and the nearest known name.
    """
    for index, name in enumerate(names):
        if name not in known:
            raise read_yaml(file).error(("declared_effects", index), f"unknown effect {name!r}", nearest(name, known))
    return [known[name] for name in names]
