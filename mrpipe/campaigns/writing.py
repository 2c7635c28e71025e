"""Writing a campaign directory in the form that :func:`mrpipe.campaigns.load_campaign` reads."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml

from mrpipe.artifacts import FloatArray, atomic_path, atomic_write_text
from mrpipe.artifacts.hdf5 import hdf5_in_memory
from mrpipe.campaigns.model import CAMPAIGN_FILE


@dataclass(frozen=True)
class TestFile:
    """One test to be written.

    Attributes
    ----------
    name, role
        As in campaign.yaml; role is training, validation or repeat.
    columns
        Name of the column in the file -> samples, shape (n,), in the unit that the campaign's channels name.
    details
        Other keys of the test (`kind`, `mode`, `law`, `gains`, `segments_s`, `channels`, `about`, ...).
    """

    __test__ = False  # the name is not a test case, whatever a test runner makes of it

    name: str
    role: str
    columns: Mapping[str, FloatArray]
    details: Mapping[str, Any] = field(default_factory=dict)


def write_campaign(
    directory: Path,
    *,
    campaign: str,
    rig: str,
    sampling_rate_hz: float,
    channels: Mapping[str, tuple[str, str]],
    tests: Sequence[TestFile],
    extra: Mapping[str, Any] | None = None,
    data_format: Literal["h5", "csv"] = "h5",
) -> Path:
    """Write `campaign.yaml` and one data file a test, and return the path of `campaign.yaml`.

    The data files come first and `campaign.yaml` last, so that a directory which holds it is whole.

    Parameters
    ----------
    directory
        Made if missing.
    campaign, rig, sampling_rate_hz
        As in campaign.yaml; rig is damper-bench or shear-frame.
    channels
        Quantity (`time`, `displacement`, `drive`, `floor_acceleration_1`, ...) -> (column, unit).
    tests
        At least one; the name of the data file is made from the test's name.
    extra
        Other top-level keys (`frame: {floor_masses_kg: [...]}`, `declared_effects: [...]`, `about: {...}`).
    data_format
        `h5` (one dataset a column, at the root) or `csv` (one header line, 12 digits).

    Raises
    ------
    ValueError
        If the columns of a test differ in length, or two tests would share a file.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    (directory / CAMPAIGN_FILE).unlink(missing_ok=True)
    units = dict(channels.values())
    entries: list[dict[str, Any]] = []
    files: set[str] = set()
    for test in tests:
        file = f"{_file_stem(test.name)}.{data_format}"
        if file in files:
            raise ValueError(f"two tests would be written to {file}")
        files.add(file)
        columns = {key: np.asarray(values, dtype=np.float64) for key, values in test.columns.items()}
        if len({values.shape for values in columns.values()}) != 1:
            raise ValueError(f"test {test.name}: columns differ in length")
        _write_columns(directory / file, columns, units, sampling_rate_hz)
        entries.append({"name": test.name, "file": file, "role": test.role, **_plain(test.details)})
    content: dict[str, Any] = {
        "campaign": campaign,
        "rig": rig,
        "sampling_rate_hz": float(sampling_rate_hz),
        **_plain(extra or {}),
        "channels": {quantity: {"column": column, "unit": unit} for quantity, (column, unit) in channels.items()},
        "tests": entries,
    }
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    atomic_write_text(directory / CAMPAIGN_FILE, text)
    return directory / CAMPAIGN_FILE


def _file_stem(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9._+-]+", "_", name).strip("._") or "test"


def _write_columns(
    path: Path, columns: Mapping[str, FloatArray], units: Mapping[str, str], sampling_rate_hz: float
) -> None:
    with atomic_path(path) as temporary:
        if path.suffix == ".h5":
            with hdf5_in_memory(temporary) as handle:
                handle.attrs["sampling_rate_hz"] = sampling_rate_hz
                for key, values in columns.items():
                    dataset = handle.create_dataset(key, data=values)
                    dataset.attrs["unit"] = units.get(key, "1")
        else:
            np.savetxt(
                temporary,
                np.column_stack(list(columns.values())),
                fmt="%.12g",
                delimiter=",",
                header=",".join(columns),
                comments="",
            )


def _plain(value: Any) -> Any:
    """Turn numpy scalars, arrays and tuples into what YAML can hold."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value
