"""Whether an export replaces that of another damper in the same folder."""

from __future__ import annotations

import json
import re
from pathlib import Path

from mrpipe.exports.damper import ORIGINS

_ABOUT = re.compile(r"^(.+): base form `", re.MULTILINE)
"""Start of the line of README.md that states where an exported damper comes from."""


def replaced_export(folder: Path, damper: str) -> str:
    """Return a sentence if a folder holds the export of another damper, which a new export will replace; else "".

    Parameters
    ----------
    folder
        Folder of the export of a damper, or of a controller.
    damper
        Damper of the new export, as in `simulate.damper`.
    """
    held = _held(folder)
    if held in ("", damper):
        return ""
    return (
        f"{folder.name}/ held the export with the {_called(held)}, which is replaced by that with the "
        f"{_called(damper)}; to keep both, export one of them into another run directory (--run)"
    )


def _held(folder: Path) -> str:
    """Return the damper of the export in a folder; empty if there is none, or if it does not say."""
    description, readme = folder / "controller.json", folder / "README.md"
    try:
        if description.is_file():
            content = json.loads(description.read_text(encoding="utf-8"))
            return str(content.get("damper") or "") if isinstance(content, dict) else ""
        text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    except (OSError, ValueError):
        return ""  # the user's own file, which the export replaces as any file of this name
    found = _ABOUT.search(text)
    origin = found[1] if found else ""
    known = {said: name for name, said in ORIGINS.items()}
    return known.get(origin, origin.removeprefix("The damper ") if origin.startswith("The damper ") else "")


def _called(damper: str) -> str:
    """Return a damper as words: `identified damper`, or `damper set-c`."""
    return f"{damper} damper" if damper in ORIGINS else f"damper {damper}"
