"""Writing and reading artifacts.

Each dataset has the attributes `unit` (SI, "1" for a pure number) and `dims`, and dimension scales for netCDF-4. The
attributes of the root state how the file was made.
Structured notes are kept as JSON text in datasets, never as pickles.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike

from mrpipe import __version__
from mrpipe.artifacts.atomic import atomic_path
from mrpipe.artifacts.dimension_scales import SCALE_ATTRIBUTES, attach_scales, is_scale
from mrpipe.artifacts.types import FloatArray
from mrpipe.errors import UserError

SCHEMA = "mrpipe-artifact-1"
_OLDER = f"{SCHEMA!r} expected: another program or version wrote the file; build it again with --force"


@dataclass(frozen=True)
class Provenance:
    """Origin of an artifact, which is written into the root of every file.

    Attributes
    ----------
    stage
        Name of the stage that writes.
    config
        The resolved configuration as YAML.
    inputs
        Name -> SHA-256 of each file read, as `sha256sum` prints it.
    seed
        Seed of the run.
    content
        Declared input -> digest of its content, as the manifest keeps it. It stays the same where an artifact is built
        again with the same numbers. It is not written.
    """

    stage: str
    config: str = ""
    inputs: Mapping[str, str] = field(default_factory=dict)
    seed: int = 0
    content: Mapping[str, str] = field(default_factory=dict)


def library_versions() -> dict[str, str]:
    """Return the versions of the numerical libraries, without importing the slow ones."""
    from importlib.metadata import version

    return {name: version(name) for name in ("numpy", "scipy", "scikit-learn")}


@contextmanager
def hdf5_in_memory(path: Path) -> Iterator[h5py.File]:
    """Yield a new HDF5 file that is put together in memory and written to `path` at the end.

    The HDF5 library ends the process where a disk is full; an ordinary write raises OSError.
    """
    with h5py.File(path.name, "w", driver="core", backing_store=False, track_order=True) as handle:
        yield handle
        handle.flush()
        image = handle.id.get_file_image()
    Path(path).write_bytes(image)


class ArtifactWriter:
    """Fills one artifact; use :meth:`create`, which moves it into place only when all went well."""

    def __init__(self, handle: h5py.File) -> None:
        self._handle = handle

    @classmethod
    @contextmanager
    def create(cls, path: Path, provenance: Provenance) -> Iterator[ArtifactWriter]:
        """Open a new artifact that appears at `path` when the block ends without an exception."""
        with atomic_path(path) as temporary, hdf5_in_memory(temporary) as handle:
            attributes = handle.attrs
            attributes["schema"] = SCHEMA
            attributes["stage"] = provenance.stage
            attributes["mrpipe_version"] = __version__
            attributes["inputs"] = json.dumps(dict(provenance.inputs))
            attributes["seed"] = provenance.seed
            attributes["created_utc"] = datetime.now(UTC).isoformat(timespec="seconds")
            for library, version in library_versions().items():
                attributes[f"{library}_version"] = version
            # a long text does not fit the 64 KiB of a compact attribute
            attributes["config"] = provenance.config[:60000]
            yield cls(handle)
            attach_scales(handle)

    def put(self, name: str, values: ArrayLike, *, unit: str, dims: Sequence[str] = (), description: str = "") -> None:
        """Store an array (any path of groups as `name`), its unit and the names of its axes.

        Raises
        ------
        ValueError
            If `dims` does not name every axis.
        """
        array = np.asarray(values)
        if len(dims) != array.ndim:
            raise ValueError(f"{name}: {array.ndim} axes, but dims {tuple(dims)}")
        options: dict[str, Any] = {}
        if array.size > 1024:
            options = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        dataset = self._handle.create_dataset(name, data=array, **options)
        dataset.attrs["unit"] = unit
        dataset.attrs["dims"] = list(dims) if dims else ""
        if description:
            dataset.attrs["description"] = description

    def put_text(self, name: str, text: str) -> None:
        """Store a text."""
        dataset = self._handle.create_dataset(name, data=text, dtype=h5py.string_dtype())
        dataset.attrs["unit"] = "1"
        dataset.attrs["dims"] = ""

    def put_json(self, name: str, content: Any) -> None:
        """Store a structure of dicts, lists, strings and numbers as JSON text."""
        self.put_text(name, json.dumps(content, allow_nan=True))

    def attributes(self, group: str, **values: str | float | int | bool) -> None:
        """Set plain attributes of a group (made if missing)."""
        target = self._handle.require_group(group)
        for key, value in values.items():
            target.attrs[key] = value


class Artifact:
    """Read access to one artifact; the file is opened and closed with every call.

    Parameters
    ----------
    path
        The HDF5 file.

    Raises
    ------
    UserError
        If the file is missing or is not an artifact of mrpipe.
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise UserError(self.path, "", "no such artifact", "run the stage that writes it")
        try:
            with h5py.File(self.path, "r") as handle:
                self.root: dict[str, Any] = {key: _plain(value) for key, value in handle.attrs.items()}
        except (OSError, RuntimeError, KeyError) as error:
            raise UserError(self.path, "", "not a readable HDF5 file", "build it again with --force") from error
        if self.root.get("schema") != SCHEMA:
            raise UserError(self.path, "attribute schema", f"is {self.root.get('schema')!r}", _OLDER)

    @property
    def stage(self) -> str:
        """Name of the stage that wrote the file."""
        return str(self.root["stage"])

    @contextmanager
    def _open(self) -> Iterator[h5py.File]:
        try:
            with h5py.File(self.path, "r") as handle:
                yield handle
        except (OSError, RuntimeError) as error:
            raise UserError(
                self.path, "", f"is damaged ({' '.join(str(error).split())[:120]})", "run the stage that writes it"
            ) from error

    def __contains__(self, name: str) -> bool:
        with self._open() as handle:
            return name in handle

    def array(self, name: str) -> FloatArray:
        """Return a dataset as a float array."""
        return np.asarray(self._read(name), dtype=np.float64)

    def raw(self, name: str) -> Any:
        """Return a dataset in its stored type (text as str)."""
        return _plain(self._read(name))

    def scalar(self, name: str) -> float:
        """Return a dataset without axes as a float."""
        return float(self._read(name))

    def text(self, name: str) -> str:
        """Return a text dataset."""
        return str(_plain(self._read(name)))

    def json(self, name: str) -> Any:
        """Return what :meth:`ArtifactWriter.put_json` stored."""
        return json.loads(self.text(name))

    def unit(self, name: str) -> str:
        """Return the unit of a dataset."""
        with self._open() as handle:
            return str(handle[name].attrs["unit"])

    def attributes(self, group: str) -> dict[str, Any]:
        """Return the attributes of a group or dataset."""
        with self._open() as handle:
            found = handle[group].attrs.items()
            return {key: _plain(value) for key, value in found if key not in SCALE_ATTRIBUTES}

    def members(self, group: str = "/") -> list[str]:
        """Return the names inside a group in the order of writing (empty where there is no such group)."""
        with self._open() as handle:
            return [name for name, item in handle[group].items() if not is_scale(item)] if group in handle else []

    def _read(self, name: str) -> Any:
        with self._open() as handle:
            if name not in handle:
                raise UserError(self.path, name, "no such dataset", "build the artifact again with --force")
            return handle[name][()]


def _plain(value: Any) -> Any:
    """Turn what h5py returns into plain Python."""
    if isinstance(value, bytes):
        return value.decode("utf-8")
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [_plain(item) for item in value.tolist()]
    return value
