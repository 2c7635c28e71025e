"""Place of a wrong setting: the file and the line in which it stands.

The functions that use a setting know its section (`structure`), but not the file that it was read from. Their errors
are completed here, where the configuration is known.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from mrpipe.artifacts.yaml_source import read_yaml
from mrpipe.config.loader import LoadedConfig
from mrpipe.errors import UserError

_KEY = re.compile(r"[A-Za-z_]\w*(\.\w+|\[\d+\])*")


def located(error: UserError, loaded: LoadedConfig) -> UserError:
    """Return an error about a setting with its file and line; an error about anything else as it is.

    Parameters
    ----------
    error
        Its source is a section of the configuration, such as `structure`, or a setting within, such as
        `structure.reduction`.
    loaded
        The configuration. A setting that an option `--set` gave is named with this option.
    """
    section, *_ = keys = [*_keys(error.source)]
    # a file of the user may have the name of a section: `design.py`
    if section not in type(loaded.config).model_fields or Path(error.source).is_file():
        return error
    further = [*_keys(error.where)]
    # the name of a file may look like keys: `no.at2`
    is_key = _KEY.fullmatch(error.where) is not None and _exists(loaded.config, [*keys, *further])
    if is_key:
        keys += further
    where = f"{error.source}{'.' if is_key else ', ' if error.where else ''}{error.where}"
    given = [override.partition("=")[0].strip() for override in loaded.overrides]
    if any(".".join(map(str, keys[:depth])) in given for depth in range(1, len(keys) + 1)):
        return UserError("--set", where, error.problem, error.remedy)
    lines = read_yaml(loaded.path).lines if loaded.path.is_file() else {}
    known = next((place for depth in range(len(keys), 0, -1) if (place := tuple(keys[:depth])) in lines), None)
    return UserError(
        loaded.path, where if known is None else f"line {lines[known]}, {where}", error.problem, error.remedy
    )


def _exists(content: Any, keys: Sequence[str | int]) -> bool:
    """Return whether keys and indices lead to a value of the configuration."""
    for key in keys:
        if isinstance(content, BaseModel) and key in type(content).model_fields:
            content = getattr(content, str(key))
        elif _holds(content, key):
            content = content[key]
        else:
            return False
    return True


def _holds(content: Any, key: str | int) -> bool:
    if isinstance(content, tuple | list):
        return isinstance(key, int) and key < len(content)
    return isinstance(content, Mapping) and key in content


def _keys(setting: str) -> Iterator[str | int]:
    """Yield the keys of a setting up to a colon: `structure`, `dampers` and 0 for `structure.dampers[0]: base`."""
    for part in setting.partition(":")[0].split("."):
        yield part.partition("[")[0]
        yield from map(int, re.findall(r"\[(\d+)\]", part))
