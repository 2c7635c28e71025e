"""The effects that a campaign declares: those that its rig is known to have."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from mrpipe.artifacts.yaml_source import nearest, read_yaml
from mrpipe.dampers.library import base_forms

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
        If a name is unknown; see :func:`require_known`.
    """
    require_known(names, known, file)
    return [known[name] for name in names]


def require_known(names: Sequence[str], known: Collection[str], file: Path) -> None:
    """Refuse a name under `declared_effects` that is not known.

    Parameters
    ----------
    names
        Names that the campaign declares.
    known
        Names of the library, and of the effects of the user's files.
    file
        File of the campaign, for the message.

    Raises
    ------
    UserError
        If a name is unknown; the message names the line of the file and the nearest known name, or says that it is a
        base form.
    """
    for index, name in enumerate(names):
        if name in known:
            continue
        problem, remedy = f"unknown effect {name!r}", nearest(name, known)
        forms = sorted(form.name for form in base_forms().values() if name in (form.name, form.family))
        if forms:
            problem = f"{name!r} is a base form of the damper and no effect"
            remedy = f"leave it out here, and begin the tracing with close_loop.model: {' or '.join(forms)}"
        raise read_yaml(file).error(("declared_effects", index), problem, remedy)
