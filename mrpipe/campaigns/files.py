"""Opening a data file by its ending; the readers of the formats are the modules of `readers`."""

from __future__ import annotations

import importlib
import pkgutil
import unicodedata
from functools import cache
from pathlib import Path

import mrpipe.campaigns.readers as package
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader
from mrpipe.campaigns.readers.strong_motion import refuse_other_records
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError

_SAVE_AS = {".xls": ".xlsx", ".xlsb": ".xlsx", ".ods": ".xlsx or .csv"}
"""Ending of spreadsheets that are not read -> ending as which their program saves them."""

LOADS_FROM = ("mrpipe.campaigns.readers",)


@cache
def all_readers() -> dict[str, Reader]:
    """Return ending -> reader of every module of the package that defines READER."""
    modules = (
        importlib.import_module(f"{package.__name__}.{item.name}") for item in pkgutil.iter_modules(package.__path__)
    )
    readers = [module.READER for module in modules if hasattr(module, "READER")]
    return {ending: reader for reader in readers for ending in reader.endings}


def ending_of(path: Path) -> str:
    """Return the ending of a file in lower case, `.csv.gz` for compressed text."""
    ending = path.suffix.lower()
    return f"{Path(path.stem).suffix.lower()}.gz" if ending == ".gz" else ending


def not_found(path: Path) -> UserError:
    """Return the error for a data file that is missing.

    It names the file of the folder whose name differs in case, spaces, signs or ending alone. A name with other digits
    is that of another test and is not offered.
    """
    remedy = "correct `file:` in the campaign file, or put the file there"
    try:
        names = sorted(item.name for item in path.parent.iterdir())
    except (OSError, ValueError):
        names = []
    if "\\" in path.name and (path.parent / path.name.replace("\\", "/")).is_file():
        return UserError(path, "", "data file not found", "write / in place of \\ between folder and file")
    wanted = {_letters(path.name), _letters(path.stem)}
    alike = next((name for name in names if {_letters(name), _letters(Path(name).stem)} & wanted), "")
    return UserError(path, "", "data file not found", f"did you mean {alike}? {remedy}" if alike else remedy)


def _letters(name: str) -> str:
    return "".join(letter for letter in unicodedata.normalize("NFKD", name).casefold() if letter.isalnum())


def open_data_file(path: Path, layout: TextEntry | None = None) -> DataFile:
    """Open a data file; only requested columns are converted to numbers.

    Nothing in a file is ever executed: no pickles are loaded, and MATLAB objects are not built.

    Raises
    ------
    UserError
        If the file is missing, of an unknown kind, damaged, or claims more memory than plausible.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise UserError(path, "", "is a directory", "name a data file within it")
        found = path.is_file()
    except (OSError, ValueError):
        found = False
    if not found:
        raise not_found(path)
    readers = all_readers()
    ending = ending_of(path)
    refuse_other_records(path)
    if ending not in readers:
        known = ", ".join(sorted(readers))
        remedy = f"save it as {_SAVE_AS[ending]}" if ending in _SAVE_AS else f"use one of {known}"
        raise UserError(path, "", f"files that end in {ending!r} are not read", remedy)
    try:
        return readers[ending].read(path, layout)
    except UserError:
        raise
    except Exception as error:
        said = " ".join(str(error).split())[:200] or type(error).__name__
        raise UserError(path, "", f"is damaged or not what its ending says ({said})", "export it again") from error
