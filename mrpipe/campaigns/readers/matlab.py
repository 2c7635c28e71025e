"""MATLAB files, versions 5 to 7.3."""

from __future__ import annotations

import zlib
from pathlib import Path

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.hdf5 import read_hdf5
from mrpipe.campaigns.readers.reader import LARGEST_BYTES, Reader, flatten, require_size, short_names
from mrpipe.campaigns.schema import TextEntry

_COMPRESSED = 15
_HEADER = 128


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    import h5py
    import scipy.io

    if h5py.is_hdf5(path):
        return read_hdf5(path, matlab=True)
    require_size(path, _unpacked_bytes(path), path.stat().st_size)
    content = scipy.io.loadmat(path, simplify_cells=True)
    leaves = flatten({key: value for key, value in content.items() if not key.startswith("__")})
    aliases = short_names(list(leaves), ".")
    return DataFile(path=path, names=tuple(leaves), fetch=leaves.__getitem__, aliases=aliases)


def _unpacked_bytes(path: Path) -> int:
    """Return how many bytes the compressed variables of a file unpack to; counting stops at the limit.

    Only files that could exceed a limit are unpacked, because zlib reaches a ratio of at most about 1000.
    """
    size = path.stat().st_size
    if size * 1100 < 2**28:
        return size
    total = 0
    with path.open("rb") as handle:
        order = handle.read(_HEADER)[-2:]
        byteorder = "little" if order == b"IM" else "big"
        while len(tag := handle.read(8)) == 8 and total <= LARGEST_BYTES:
            kind = int.from_bytes(tag[:4], byteorder)  # type: ignore[arg-type]
            length = int.from_bytes(tag[4:], byteorder)  # type: ignore[arg-type]
            if kind != _COMPRESSED:
                total += length
                handle.seek(length, 1)
                continue
            unpacker, left = zlib.decompressobj(), length
            while left > 0 and total <= LARGEST_BYTES:
                packed = handle.read(min(left, 2**16))
                if not packed:
                    break
                left -= len(packed)
                while packed and total <= LARGEST_BYTES:
                    total += len(unpacker.decompress(packed, 2**22))
                    packed = unpacker.unconsumed_tail
    return total


READER = Reader((".mat",), _read)
