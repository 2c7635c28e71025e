"""A recorded base acceleration from a text file of two columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.units import to_si


def read_ground_record(
    path: Path,
    unit: str,
    *,
    file_setting: str = "simulate.excitation.file",
    unit_setting: str = "simulate.excitation.file_unit",
) -> tuple[FloatArray, FloatArray]:
    """Return time [s] and acceleration [m/s^2], shape (m,) each.

    Parameters
    ----------
    path
        Text or CSV: time [s] and acceleration in two columns, numbers divided by blanks, commas or semicolons; lines
        that do not begin with a number are headers.
    unit
        Of the acceleration.
    file_setting, unit_setting
        Settings that name file and unit, for messages.

    Raises
    ------
    UserError
        If the file is missing, a row has fewer than two numbers, or the clock does not rise.
    """
    if not path.name:
        raise UserError(file_setting, "", "is empty", "name a text file of two columns, time [s] and acceleration")
    if not path.is_file():
        raise UserError(file_setting, str(path), "there is no such file", "name a text file of two columns")
    rows = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words = line.replace(",", " ").replace(";", " ").split()
        if not words or not (words[0][0].isdigit() or words[0][0] in "+-."):
            continue
        try:
            rows.append((float(words[0]), float(words[1])))
        except (ValueError, IndexError) as error:
            raise UserError(path, f"line {number}", "has no two numbers", "write time and acceleration") from error
    table = np.array(rows, dtype=np.float64).reshape(-1, 2)
    if len(table) < 2:
        raise UserError(path, "", f"holds {len(table)} rows of numbers", "give at least two")
    wrong = np.flatnonzero(~(np.diff(table[:, 0]) > 0.0))
    if wrong.size:
        raise UserError(path, f"row {wrong[0] + 2}", "time does not rise", "give a strictly rising clock in seconds")
    if not np.all(np.isfinite(table)):
        raise UserError(path, "", "holds a number that is not finite", "give finite accelerations")
    return table[:, 0], to_si(table[:, 1], unit, where=unit_setting, quantity="acceleration")
