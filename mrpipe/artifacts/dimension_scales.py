"""HDF5 dimension scales, so that programs for netCDF-4 (xarray, ncview, Panoply) read the axes of an artifact.

Each axis name becomes a dimension in the root of the file, where all groups see it. netCDF-4 allows one length for each
dimension. An axis of the same name and another length becomes `time_2`, `time_3` and so on. The attribute `dims` of a
dataset keeps the plain names.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
"""Start of the name of a scale without values, as netCDF-4 defines it."""

SCALE_ATTRIBUTES = frozenset({"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid"})
"""Attributes that HDF5 and netCDF-4 keep for scales; they contain no results."""


def is_scale(item: Any) -> bool:
    """Return whether an object of a file is a dimension without values, which is not a result."""
    if not isinstance(item, h5py.Dataset):
        return False
    name = item.attrs.get("NAME", b"")
    text = name.decode("ascii", "replace") if isinstance(name, bytes | np.bytes_) else str(name)
    return text.startswith(_NO_VARIABLE)


def attach_scales(handle: h5py.File) -> None:
    """Attach a dimension scale to every axis that the attribute `dims` of a dataset names."""
    named: list[tuple[h5py.Dataset, list[str]]] = []

    def visit(_: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.ndim:
            names = [str(name) for name in np.atleast_1d(item.attrs.get("dims", ""))]
            if len(names) == item.ndim:
                named.append((item, names))

    handle.visititems(visit)
    scales: dict[tuple[str, int, int], h5py.Dataset] = {}
    for dataset, names in named:
        used: dict[tuple[str, int], int] = {}
        for axis, (name, size) in enumerate(zip(names, dataset.shape, strict=True)):
            # a dataset cannot have the same dimension twice
            turn = used[name, size] = used.get((name, size), 0) + 1
            if (name, size, turn) not in scales:
                scales[name, size, turn] = _scale(handle, name, size)
            dataset.dims[axis].attach_scale(scales[name, size, turn])


def _scale(handle: h5py.File, name: str, size: int) -> h5py.Dataset:
    free, number = name, 1
    while free in handle:
        number += 1
        free = f"{name}_{number}"
    scale = handle.create_dataset(free, shape=(size,), dtype=np.float32)
    scale.attrs["unit"] = "1"
    scale.attrs["dims"] = [name]
    scale.make_scale(f"{_NO_VARIABLE}{size:10d}")
    return scale
