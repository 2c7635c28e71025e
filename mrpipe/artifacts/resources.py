"""Files that come with the program: configurations, campaign mappings and parameter sets."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from mrpipe.artifacts.types import FloatArray
from mrpipe.errors import UserError


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
    from mrpipe.units import to_si

    path = Path(name)
    if path.suffix not in {".yaml", ".yml"}:
        path = config_directory() / kind / f"{name}.yaml"
    if not path.is_file():
        known = sorted(item.stem for item in (config_directory() / kind).glob("*.yaml"))
        raise UserError(path, "", "no such parameter set", f"known sets: {', '.join(known)}")
    try:
        content: Any = yaml.safe_load(path.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        raise UserError(path, "", f"not valid YAML ({error})", "correct the syntax") from error
    values: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    for key, entry in content["parameters"].items():
        if not isinstance(entry, dict) or not {"value", "unit"} <= entry.keys():
            raise UserError(path, f"parameters.{key}", "has no value or no unit", "write {value: …, unit: …}")
        values[key] = np.asarray(
            to_si(np.asarray(entry["value"], dtype=np.float64), str(entry["unit"]), where=str(path))
        )
        units[key] = str(entry["unit"])
    return ParameterSet(
        name=str(content.get("name", path.stem)),
        model=str(content["model"]),
        source=str(content["source"]),
        values=values,
        units=units,
        notes=str(content.get("notes", "")),
    )
