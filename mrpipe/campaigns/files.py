"""Opening a data file by its ending: csv and text, MATLAB v5 to v7.3, HDF5, JSON, UFF 58."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.schema import TextEntry
from mrpipe.campaigns.tables import read_table
from mrpipe.errors import UserError

ENDINGS = (".csv", ".txt", ".dat", ".tsv", ".mat", ".h5", ".hdf5", ".json", ".uff", ".unv")


def open_data_file(path: Path, layout: TextEntry | None = None) -> DataFile:
    """Open a data file; only the columns asked for are turned into numbers.

    Nothing in a file is ever executed: no pickles, and MATLAB objects are not built.

    Raises
    ------
    UserError
        If the file is missing, of an unknown kind, or damaged.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if not path.is_file():
        raise UserError(path, "", "no such file", "mend `file` in campaign.yaml or put the file there")
    readers: dict[str, Callable[[Path], DataFile]] = {
        **dict.fromkeys((".csv", ".txt", ".dat", ".tsv"), lambda table: read_table(table, layout)),
        ".mat": _read_matlab,
        ".h5": _read_hdf5,
        ".hdf5": _read_hdf5,
        ".json": _read_json,
        ".uff": _read_uff,
        ".unv": _read_uff,
    }
    if ending not in readers:
        raise UserError(path, "", f"files that end in {ending!r} are not read", f"use one of {', '.join(ENDINGS)}")
    try:
        return readers[ending](path)
    except UserError:
        raise
    except Exception as error:
        raise UserError(
            path, "", f"is damaged or not what its ending says ({str(error).strip()})", "export it again"
        ) from error


def _flatten(content: Any, prefix: str = "") -> dict[str, Any]:
    """Return dotted name -> leaf of nested mappings."""
    leaves: dict[str, Any] = {}
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            leaves.update(_flatten(value, f"{name}."))
        else:
            leaves[name] = value
    return leaves


def _read_matlab(path: Path) -> DataFile:
    if h5py.is_hdf5(path):
        return _read_hdf5(path, matlab=True)
    import scipy.io

    content = scipy.io.loadmat(path, simplify_cells=True)
    leaves = _flatten({key: value for key, value in content.items() if not key.startswith("__")})
    return DataFile(path=path, names=tuple(leaves), fetch=leaves.__getitem__)


def _read_hdf5(path: Path, matlab: bool = False) -> DataFile:
    names: list[str] = []

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            fields = item.dtype.names
            names.extend(f"{name}/{field}" for field in fields) if fields else names.append(name)

    with h5py.File(path, "r") as handle:
        handle.visititems(note)
        rate = handle.attrs.get("sampling_rate_hz")

    def fetch(name: str) -> Any:
        with h5py.File(path, "r") as handle:
            table, _, field = name.rpartition("/")
            inside = name not in handle or not isinstance(handle[name], h5py.Dataset)
            values = np.asarray(handle[table][field] if inside else handle[name][()])
        # MATLAB stores columns first, so its matrices appear transposed
        return values.T if matlab else values

    aliases = {f"/{name}": name for name in names} | {name.replace("/", "."): name for name in names if "/" in name}
    return DataFile(
        path=path,
        names=tuple(names),
        fetch=fetch,
        sampling_rate_hz=None if rate is None else float(rate),
        aliases=aliases,
    )


def _read_json(path: Path) -> DataFile:
    content = json.loads(path.read_text(encoding="utf-8-sig"))
    if isinstance(content, list) and content and isinstance(content[0], Mapping):
        content = {key: [row.get(key) for row in content] for key in content[0]}
    if not isinstance(content, Mapping):
        raise UserError(path, "", "holds no named columns", 'write {"t": [...], "x": [...]}')
    leaves = {
        name: np.asarray([np.nan if item is None else item for item in value]) if isinstance(value, list) else value
        for name, value in _flatten(content).items()
    }
    return DataFile(path=path, names=tuple(leaves), fetch=leaves.__getitem__)


def _read_uff(path: Path) -> DataFile:
    """Read the functions at nodal degrees of freedom (dataset 58) of a universal file."""
    try:
        import pyuff
    except ImportError:
        raise UserError(
            path, "", "UFF files need the package pyuff, which is not installed", "pip install 'mrpipe[uff]'"
        ) from None
    file = pyuff.UFF(str(path))
    types = file.get_set_types()
    sets = [file.read_sets(int(index)) for index in np.flatnonzero(np.asarray(types) == 58)]
    if not sets:
        raise UserError(path, "", "holds no dataset 58", "export time histories as universal dataset 58")
    names, columns = [], {}
    for position, item in enumerate(sets):
        name = str(item.get("id1", "")).strip()
        if not name or name.upper() == "NONE" or name in columns:
            name = f"{int(item.get('rsp_node', 0))}:{int(item.get('rsp_dir', 0))}"
        if name in columns:
            name = str(position)
        names.append(name)
        columns[name] = np.real(np.asarray(item["data"]))
    first = sets[0]
    abscissa = np.asarray(first["x"], dtype=np.float64)
    step = float(first.get("abscissa_inc") or 0.0) or float(np.median(np.diff(abscissa)))
    return DataFile(
        path=path,
        names=tuple(names),
        fetch=columns.__getitem__,
        table=True,
        time_s=abscissa,
        sampling_rate_hz=1.0 / step,
    )
