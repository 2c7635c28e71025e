"""Models and records by name: names refer to the public data, everything else is a path."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from mrpipe.artifacts import public_data_directory
from mrpipe.artifacts.yaml_source import nearest
from mrpipe.errors import UserError


def named_file(option: str, value: str, public: Mapping[str, str]) -> Path:
    """Return the file of a path or of a name in the public data; an existing path has priority.

    Parameters
    ----------
    option
        Option that gave the value, for the message.
    value
        Name or path.
    public
        Name -> path within the folder of public data.

    Raises
    ------
    UserError
        If it is a public name and the public data are not there, or a bare word that is neither name nor file.
    """
    path = Path(value)
    if path.is_file():
        return path
    if value not in public:
        if path.suffix or path.name != value:
            return path
        raise UserError(option, value, "is neither a file nor a name", nearest(value, list(public)))
    folder = public_data_directory()
    if folder is None:
        raise UserError(
            option, value, "the public data are not there", "set MRPIPE_DATA to their folder, or give a file"
        )
    return folder / public[value]
