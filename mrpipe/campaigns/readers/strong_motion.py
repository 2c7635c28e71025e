"""Strong-motion records as they are downloaded: COSMOS and CSMIP V2, PEER AT2, SMC, GeoNet V2A, and zips of them."""

from __future__ import annotations

import io
import lzma
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers import geonet, peer, smc
from mrpipe.campaigns.readers.cosmos import BLOCK_LINE, UNCORRECTED, cosmos_channels, holds_uneven_pairs
from mrpipe.campaigns.readers.cosmos import ENDINGS as COSMOS_ENDINGS
from mrpipe.campaigns.readers.motion import StrongMotion
from mrpipe.campaigns.readers.reader import Reader, require_size
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError
from mrpipe.units import conversion

NOT_READ = {
    ".vt2": ("a record of velocity", "give the .AT2 file of the same component"),
    ".dt2": ("a record of displacement", "give the .AT2 file of the same component"),
    ".v3": ("a file of response spectra", "give the .V2 file of the same record"),
    ".v3c": ("a file of response spectra", "give the .V2c file of the same record"),
    ".v1a": ("an uncorrected record of GeoNet, which is not read", "give the .V2A file of the same record"),
}
"""Endings of files of data centres that hold no acceleration in a known form -> what they are, and a remedy."""
_SHARED = 0.8
"""Share of the longest channel below which the proposal says that the channels were cut."""
DEEPEST_ARCHIVE = 3
"""Archives within archives that are opened; a download of several stations has two."""
ENDINGS = (*COSMOS_ENDINGS, *peer.ENDINGS, *smc.ENDINGS, *geonet.ENDINGS, ".zip")


def read_strong_motion(path: Path) -> list[StrongMotion]:
    """Return the accelerations of all channels of a record, or of all records in a zip and the zips in it.

    Uncorrected records (V1) are left out where a zip contains corrected ones.

    Raises
    ------
    UserError
        If no acceleration is found, or a file is not what its ending says.
    """
    found: list[StrongMotion] = []
    files: list[str] = []
    others: list[tuple[Path, str]] = []
    for name, read in _files(path):
        text = read()
        channels = _channels(path, name, text)
        found += channels
        files += [name.stem] * len(channels)
        others += [] if channels else [(name, text)]
    if not found:
        raise _no_acceleration(path, others)
    names = _made_different([item.name for item in found], [f" ({file})" for file in files])
    names = _made_different(names, [f" #{index + 1}" for index in range(len(names))])
    return [replace(item, name=name) for item, name in zip(found, names, strict=True)]


def _no_acceleration(path: Path, records: Sequence[tuple[Path, str]]) -> UserError:
    """Return the error for a file, or for the records of a zip, without a channel of acceleration."""
    if not records:
        problem = f"holds no file that ends in {', '.join(ending for ending in ENDINGS if ending != '.zip')}"
        return UserError(path, "", problem, "give a zip that contains such records")
    name, text = records[0]
    if any(holds_uneven_pairs(other) for _, other in records):
        problem = "is a digitised film record: its samples are pairs of time and acceleration at uneven times"
        return UserError(_within(path, name), "", problem, "download the corrected record (volume 2, .V2)")
    first = next((line.strip() for line in text.splitlines() if line.strip()), "")
    if not first:
        return UserError(_within(path, name), "", "is empty", "download the record again")
    problem = f"begins with {first[:40]!r}, and no line such as {BLOCK_LINE!r} follows"
    return UserError(_within(path, name), "line 1", problem, "download the record in CSMIP or COSMOS V2 form")


def refuse_other_records(path: Path) -> None:
    """Refuse a record of another quantity, or in a form that is not read.

    Raises
    ------
    UserError
        If the ending is that of such a record.
    """
    said = NOT_READ.get(path.suffix.lower())
    if said:
        raise UserError(path, "", f"is {said[0]}", said[1])


def _made_different(names: list[str], additions: list[str]) -> list[str]:
    """Return names with an addition where a name occurs several times."""
    return [
        name if names.count(name) == 1 else f"{name}{addition}" for name, addition in zip(names, additions, strict=True)
    ]


def _channels(path: Path, name: Path, text: str) -> list[StrongMotion]:
    """Return the channels of one record, by its ending."""
    ending, within = name.suffix.lower(), _within(path, name)
    if ending in COSMOS_ENDINGS:
        return list(cosmos_channels(within, text))
    if ending in smc.ENDINGS:
        return [smc.smc_record(within, text)]
    return list(geonet.geonet_channels(within, text)) if ending in geonet.ENDINGS else [_peer(path, name, text)]


def _within(path: Path, name: Path) -> Path:
    """Return the path of a record for messages, also within an archive."""
    return path / name if path.suffix.lower() == ".zip" else path


def _peer(path: Path, name: Path, text: str) -> StrongMotion:
    record = peer.peer_record(_within(path, name), text)
    factor = conversion(record.unit, where=f"{_within(path, name)}: header", quantity="acceleration")
    vertical = peer.is_vertical(name.stem, record.component)
    return StrongMotion(name.stem, record.samples * factor, record.interval_s, vertical)


def _files(path: Path) -> list[tuple[Path, Callable[[], str]]]:
    """Return name and reader of each record, in the order of the names."""
    if path.suffix.lower() != ".zip":
        return [(path, lambda: path.read_text(encoding="latin-1"))]
    try:
        members = _members(path, path.read_bytes())
    except UserError:
        raise
    except RuntimeError as error:
        # a password is wanted, or the archive is compressed by a method that Python lacks
        problem = "is encrypted, or compressed in a way that is not read"
        raise UserError(path, "", problem, "unpack it, and pack the records again as an ordinary zip") from error
    except (zipfile.BadZipFile, zlib.error, EOFError, lzma.LZMAError, OSError) as error:
        raise UserError(path, "", f"is not a zip file that can be read ({error})", "download it again") from error
    corrected = [item for item in members if item[0].suffix.lower() not in UNCORRECTED]
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


def common_window(path: Path, channels: Sequence[StrongMotion]) -> tuple[FloatArray, FloatArray]:
    """Return the time [s] from the common start on, shape (m,), and the accelerations [m/s^2], shape (m, k).

    Recorders of a structure start and stop at their own times. Channels whose headers state different starts are
    shifted by whole samples, and all are cut to the time that they share. Recorders of a structure may also have
    different sampling intervals. All channels are brought to the shortest one, because that loses nothing.

    Raises
    ------
    UserError
        If the channels share no time.
    """
    interval = min(item.interval_s for item in channels)
    channels = [item.at_interval(interval) for item in channels]
    starts = [item.start_s for item in channels if item.start_s is not None]
    skipped = [0] * len(channels)
    if len(starts) == len(channels):
        skipped = [round((max(starts) - start) / interval) for start in starts]
    length = min(item.acceleration_m_s2.size - skip for item, skip in zip(channels, skipped, strict=True))
    if length <= 1 and any(skipped):
        problem = f"its channels share no time: they start up to {max(starts) - min(starts):g} s apart"
        raise UserError(path, "", problem, "give one file for each station")
    if length <= 1:
        raise UserError(path, "", "holds a channel with fewer than two samples", "download the record again")
    parts = [item.acceleration_m_s2[skip : skip + length] for item, skip in zip(channels, skipped, strict=True)]
    return interval * np.arange(length, dtype=np.float64), np.column_stack(parts)


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    """Return the channels as columns in m/s^2, on the time that they share."""
    channels = read_strong_motion(path)
    time_s, histories = common_window(path, channels)
    columns = {item.name: histories[:, place] for place, item in enumerate(channels)}
    numbers = [name.partition(":")[0] for name in columns]
    return DataFile(
        path=path,
        names=tuple(columns),
        fetch=columns.__getitem__,
        time_s=time_s,
        sampling_rate_hz=1.0 / float(time_s[1]),
        accelerations={item.name: not item.vertical for item in channels},
        notes=_cut_note(channels, time_s.size * float(time_s[1])),
        aliases={number: name for number, name in zip(numbers, columns, strict=True) if numbers.count(number) == 1},
    )


def _cut_note(channels: Sequence[StrongMotion], shared_s: float) -> tuple[str, ...]:
    """Return a line where the channels share clearly less time than the longest of them has."""
    lengths = {item.name: item.acceleration_m_s2.size * item.interval_s for item in channels}
    longest = max(lengths, key=lambda name: lengths[name])
    if shared_s >= _SHARED * lengths[longest]:
        return ()
    known = all(item.start_s is not None for item in channels)
    starts = {item.name: (item.start_s or 0.0) if known else 0.0 for item in channels}
    last = max(starts, key=lambda name: starts[name])
    first = min(starts, key=lambda name: starts[name] + lengths[name])
    late = f"{last} starts last and " if len(set(starts.values())) > 1 else ""
    return (
        f"its channels share {shared_s:.4g} of {lengths[longest]:.4g} s, because {late}{first} ends first; if more of "
        "the record is needed, leave such a channel out of the zip",
    )


READER = Reader(ENDINGS, _read)
