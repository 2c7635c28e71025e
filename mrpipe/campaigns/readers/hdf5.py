"""HDF5 files, and MATLAB 7.3 files, which are HDF5."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from mrpipe.campaigns.columns import NUMERIC_IN_MATLAB, DataFile
from mrpipe.campaigns.readers.reader import Reader, require_size
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError

_SPARSE = "MATLAB_sparse"
"""Attribute of a group that holds a sparse matrix of MATLAB 7.3; its value is the number of rows."""

UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units", "UNIT", "UNITS")
"""Attributes of a dataset that hold its unit; `units` is that of netCDF."""


def read_hdf5(path: Path, matlab: bool = False) -> DataFile:
    """Return the datasets of an HDF5 file; each field of a compound dataset is one column."""
    names: list[str] = []
    objects: dict[str, str] = {}
    units: dict[str, str] = {}

    def note(name: str, item: Any) -> None:
        if _SPARSE in item.attrs:
            names.append(name)
        elif name.rpartition("/")[0] in names:
            return  # a part of a sparse matrix
        elif isinstance(item, h5py.Dataset) and not name.startswith("#"):
            if matlab and ("MATLAB_object_decode" in item.attrs or item.dtype.kind == "O"):
                objects[name] = np.bytes_(item.attrs.get("MATLAB_class", b"object")).decode("utf-8", "replace")
            fields = item.dtype.names
            names.extend(f"{name}/{field}" for field in fields) if fields else names.append(name)
            if not fields and (unit := _unit(item.attrs)):
                units[name] = unit

    with h5py.File(path, "r") as handle:
        handle.visititems(note)
        rate = handle.attrs.get("sampling_rate_hz")

    def fetch(name: str) -> Any:
        if name in objects:
            raise UserError(path, f"variable {name}", f"is a {objects[name]} of MATLAB", NUMERIC_IN_MATLAB)
        with h5py.File(path, "r") as handle:
            if name in handle and _SPARSE in handle[name].attrs:
                return _sparse(path, handle[name])
            table, _, field = name.rpartition("/")
            inside = name not in handle or not isinstance(handle[name], h5py.Dataset)
            dataset = handle[table] if inside else handle[name]
            require_size(path, int(dataset.size) * dataset.dtype.itemsize, dataset.id.get_storage_size())
            values = np.asarray(dataset[field] if inside else dataset[()])
        # MATLAB stores columns first, so its matrices appear transposed
        return values.T if matlab else values

    aliases = {f"/{name}": name for name in names} | {name.replace("/", "."): name for name in names if "/" in name}
    return DataFile(
        path=path,
        names=tuple(names),
        fetch=fetch,
        sampling_rate_hz=None if rate is None else float(rate),
        aliases=aliases,
        units=units,
    )


def _unit(attributes: Any) -> str:
    """Return the unit that the attributes of a dataset state, empty where they state none."""
    stated = (attributes[key] for key in UNIT_ATTRIBUTES if key in attributes)
    texts = (item.decode("utf-8", "replace") if isinstance(item, bytes) else item for item in stated)
    return next((text.strip() for text in texts if isinstance(text, str)), "")


def _sparse(path: Path, group: Any) -> Any:
    """Return a sparse matrix of MATLAB: column starts `jc`, and rows `ir` and values `data` where it is not empty."""
    from scipy.sparse import csc_matrix

    starts = np.asarray(group["jc"][()], dtype=np.int64)
    rows = int(group.attrs[_SPARSE])
    require_size(path, 8 * rows * (starts.size - 1), group.file.id.get_filesize())
    values, places = (np.asarray(group[name][()]) if name in group else np.zeros(0) for name in ("data", "ir"))
    return csc_matrix((values, places.astype(np.int64), starts), shape=(rows, starts.size - 1)).toarray()


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    return read_hdf5(path)


READER = Reader((".h5", ".hdf5"), _read)
