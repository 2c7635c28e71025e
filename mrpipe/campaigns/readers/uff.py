"""Universal files: functions at nodal degrees of freedom (dataset 58)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, optional
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    pyuff = optional("pyuff", "pyuff", "uff", path)
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


READER = Reader((".uff", ".unv"), _read)
