"""Strong-motion records as they are downloaded: COSMOS and CSMIP V2, PEER AT2, and the zips of CESMD and PEER."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers import peer
from mrpipe.campaigns.readers.cosmos import ENDINGS as COSMOS_ENDINGS
from mrpipe.campaigns.readers.cosmos import StrongMotion, cosmos_channels
from mrpipe.campaigns.readers.reader import Reader, require_size
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError
from mrpipe.units import conversion

DEEPEST_ARCHIVE = 3
"""Archives within archives that are opened; a download of several stations has two."""
ENDINGS = (*COSMOS_ENDINGS, *peer.ENDINGS, ".zip")


def read_strong_motion(path: Path) -> list[StrongMotion]:
    """Return the accelerations of all channels of a V2 or AT2 file, or of all such files in a zip and the zips in it.

    Uncorrected records (V1) are left out where a zip contains corrected ones.

    Raises
    ------
    UserError
        If no acceleration is found, or a file is not what its ending says.
    """
    found: list[StrongMotion] = []
    for name, read in _files(path):
        found += list(cosmos_channels(path, read())) if _is_cosmos(name) else [_peer_channel(path, name, read())]
    if not found:
        raise UserError(
            path, "", "holds no acceleration in V2 or AT2 form", "give a .V2 or .AT2 file, or a zip that contains some"
        )
    names = [item.name for item in found]
    return [
        item if names.count(item.name) == 1 else replace(item, name=f"{item.name} #{index + 1}")
        for index, item in enumerate(found)
    ]


def _is_cosmos(name: Path) -> bool:
    return name.suffix.lower() in COSMOS_ENDINGS


def _peer_channel(path: Path, name: Path, text: str) -> StrongMotion:
    record = peer.peer_record(path if path.suffix.lower() != ".zip" else path / name, text)
    factor = conversion(record.unit, where=f"{name}: header", quantity="acceleration")
    return StrongMotion(name.stem, record.samples * factor, record.interval_s, peer.is_vertical(name.stem))


def _files(path: Path) -> list[tuple[Path, Callable[[], str]]]:
    """Return name and reader of each record, in the order of the names."""
    if path.suffix.lower() != ".zip":
        return [(path, lambda: path.read_text(encoding="latin-1"))]
    try:
        members = _members(path, path.read_bytes())
    except zipfile.BadZipFile as error:
        raise UserError(path, "", f"is not a zip file that can be read ({error})", "download it again") from error
    corrected = [item for item in members if not item[0].suffix.lower().startswith(".v1")]
    return [(name, partial(content.decode, "latin-1")) for name, content in sorted(corrected or members)]


def _members(path: Path, content: bytes, depth: int = 0) -> list[tuple[Path, bytes]]:
    """Return name and content of the records in an archive and in the archives within it."""
    found: list[tuple[Path, bytes]] = []
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        # a Mac adds a file ._NAME to each file
        items = [item for item in archive.infolist() if not Path(item.filename).name.startswith("._")]
        chosen = [item for item in items if Path(item.filename).suffix.lower() in ENDINGS]
        require_size(path, sum(item.file_size for item in chosen), len(content))
        for item in chosen:
            if not item.filename.lower().endswith(".zip"):
                found.append((Path(item.filename), archive.read(item)))
            elif depth < DEEPEST_ARCHIVE:
                inner = _members(path, archive.read(item), depth + 1)
                found += [(Path(item.filename) / name, text) for name, text in inner]
    return found


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    """Return the channels as columns in m/s^2; all must have the clock of the first."""
    channels = read_strong_motion(path)
    interval = channels[0].interval_s
    if any(abs(item.interval_s / interval - 1.0) > 1e-6 for item in channels):
        raise UserError(path, "", "its channels differ in sampling interval", "give the channels in separate files")
    columns = {item.name: item.acceleration_m_s2 for item in channels}
    aliases = {name.partition(":")[0]: name for name in columns}
    length = channels[0].acceleration_m_s2.size
    return DataFile(
        path=path,
        names=tuple(columns),
        fetch=columns.__getitem__,
        time_s=np.asarray(interval * np.arange(length), dtype=np.float64),
        sampling_rate_hz=1.0 / interval,
        aliases=aliases,
    )


READER = Reader(ENDINGS, _read)
