"""Files that come with the program: configurations, campaign mappings and parameter sets."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts.types import FloatArray
from mrpipe.artifacts.yaml_source import YamlSource, read_yaml, shown
from mrpipe.errors import UserError
from mrpipe.words import shortest


def config_directory() -> Path:
    """Return the folder `configs`: of the source tree, or the copy inside the installed package."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_configs"
    return installed if installed.is_dir() else package.parent / "configs"


def public_data_directory() -> Path | None:
    """Return the folder of the public measurements: $MRPIPE_DATA, else ../shared/data next to the project.

    Returns None if neither exists; the caller reports this.
    """
    named = os.environ.get("MRPIPE_DATA")
    if named:
        return Path(named) if Path(named).is_dir() else None
    beside = config_directory().parent.parent / "shared" / "data"
    return beside if beside.is_dir() else None


@dataclass(frozen=True)
class ParameterSet:
    """A named set of physical parameters with units and the place they come from.

    Attributes
    ----------
    name, model, source
        Name of the set, the model it belongs to, and the publication.
    values
        Parameter -> number or array, SI.
    units
        Parameter -> unit as written in the file.
    notes
        Limits of the set, such as values that no source states.
    """

    name: str
    model: str
    source: str
    values: Mapping[str, FloatArray]
    units: Mapping[str, str]
    notes: str = ""

    def scalar(self, name: str) -> float:
        """Return one number."""
        return float(self.values[name])


def load_parameter_set(kind: str, name: str | Path) -> ParameterSet:
    """Read `configs/<kind>/<name>.yaml`, or a file of the user's own.

    Parameters
    ----------
    kind
        Folder: `dampers`, `frames` or `structures`.
    name
        Name of a set that comes with the program, or the path of a YAML file (ends in .yaml).

    Raises
    ------
    UserError
        If there is no such set, or an entry lacks its value or unit.
    """

    path = Path(name)
    if path.suffix not in {".yaml", ".yml"}:
        path = config_directory() / kind / f"{name}.yaml"
    if not path.is_file():
        known = sorted(item.stem for item in (config_directory() / kind).glob("*.yaml"))
        raise UserError(path, "", "no such parameter set", f"known sets: {', '.join(known)}")
    file = read_yaml(path)
    content = file.content
    for key in ("model", "source", "parameters"):
        if content.get(key) is None:
            raise UserError(path, key, "is missing", f"write {key}: ... as the sets of configs/{kind} do")
    if not isinstance(content["parameters"], dict):
        raise file.error(("parameters",), "is not a mapping", "write a line `name: {value: ..., unit: ...}` for each")
    values = {str(key): _in_si(file, str(key), entry) for key, entry in content["parameters"].items()}
    return ParameterSet(
        name=str(content.get("name", path.stem)),
        model=str(content["model"]),
        source=str(content["source"]),
        values=values,
        units={str(key): str(entry["unit"]) for key, entry in content["parameters"].items()},
        notes=str(content.get("notes", "")),
    )


def require_parameter_set(kind: str, name: str, setting: str, others: str = "") -> None:
    """Refuse the name of a parameter set that is not there.

    Parameters
    ----------
    kind, name
        As in :func:`load_parameter_set`.
    setting
        Setting that gives the name, for the message.
    others
        What else the setting may be, such as `identified`.

    Raises
    ------
    UserError
        If there is no such set, or its file is wrong.
    """
    try:
        load_parameter_set(kind, name)
    except UserError as error:
        if "no such parameter set" not in error.problem:
            raise
        remedy = f"{f'{others}, ' if others else ''}a YAML file, or one of the {error.remedy}"
        raise UserError(setting, "", f"no such {kind.removesuffix('s')} {shortest(name)!r}", remedy) from None


def _in_si(file: YamlSource, key: str, entry: Any) -> FloatArray:
    """Return the value of a parameter in SI units."""
    from mrpipe.units import to_si

    place = ("parameters", key)
    if not isinstance(entry, dict) or not {"value", "unit"} <= entry.keys():
        raise file.error(place, "has no value or no unit", "write {value: ..., unit: ...}")
    try:
        value = np.asarray(entry["value"], dtype=np.float64)
    except (TypeError, ValueError):
        problem = f"is {shown(entry['value'])}"
        raise file.error(
            (*place, "value"), problem, "a number, or lists of numbers of equal length, expected"
        ) from None
    if not np.all(np.isfinite(value)):
        raise file.error((*place, "value"), "is not finite", "write a finite number")
    return np.asarray(to_si(value, str(entry["unit"]), where=f"{file.path}: {file.where((*place, 'unit'))}"))
