"""The effects that a campaign declares: those that its rig is known to have."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from mrpipe.artifacts.yaml_source import nearest, read_yaml
from mrpipe.dampers.library import base_forms

Kind = TypeVar("Kind")


def declared_effects(
    names: Sequence[str], known: Mapping[str, Kind], file: Path, of_damper: Collection[str] = ()
) -> list[Kind]:
    """Return the effects of the key `declared_effects` of a campaign.

    Parameters
    ----------
    names
        Names that the campaign declares.
    known
        Name -> effect: the library, and the effects of the user's files.
    file
        File of the campaign, for the message.
    of_damper
        Names of the user's own effects on a damper if the campaign is one of a structure, which cannot declare them.

    Raises
    ------
    UserError
        If a name is unknown; see :func:`require_known`.
    """
    require_known(names, known, file, of_damper)
    return [known[name] for name in names]


def require_known(names: Sequence[str], known: Collection[str], file: Path, of_damper: Collection[str] = ()) -> None:
    """Refuse a name under `declared_effects` that is not known.

    Parameters
    ----------
    names
        Names that the campaign declares.
    known
        Names of the library, and of the effects of the user's files.
    file
        File of the campaign, for the message.
    of_damper
        Names of the user's own effects on a damper if the campaign is one of a structure, which cannot declare them.

    Raises
    ------
    UserError
        If a name is unknown; the message names the line of the file and the nearest known name, or says that it is a
        base form or an effect of the user on a damper.
    """
    for index, name in enumerate(names):
        if name in known:
            continue
        problem, remedy = f"unknown effect {name!r}", nearest(name, known)
        forms = sorted(form.name for form in base_forms().values() if name in (form.name, form.family))
        if forms:
            problem = f"{name!r} is a base form of the damper and no effect"
            remedy = f"leave it out here, and begin the tracing with close_loop.model: {' or '.join(forms)}"
        elif name in of_damper:
            problem = (
                f"{name!r} of close_loop.effect_files is an effect on a damper, and this is a campaign of a structure"
            )
            remedy = "leave it out here, and trace it on a bench campaign of the damper"
        raise read_yaml(file).error(("declared_effects", index), problem, remedy)
