"""Delimited text of any encoding, also compressed with gzip."""

from __future__ import annotations

import codecs
import gzip
from pathlib import Path

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.lvm import FIRST_WORDS, read_lvm
from mrpipe.campaigns.readers.reader import LARGEST_BYTES, Reader, require_size
from mrpipe.campaigns.schema import TextEntry
from mrpipe.campaigns.tables import table_of_text

_MARKS = ((codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))


def decode(path: Path) -> str:
    """Return the text of a file: UTF-8, UTF-16 and UTF-32 by their marks, else UTF-8 or Latin-1; gzip is unpacked.

    Raises
    ------
    UserError
        If a compressed file unpacks to more than plausible.
    """
    raw = _unpacked(path) if path.suffix.lower() == ".gz" else path.read_bytes()
    for mark, encoding in _MARKS:
        if raw.startswith(mark):
            return raw.decode(encoding)
    head = raw[:400]
    if head.count(0) > 0.3 * len(head) > 0:
        # text of two bytes a letter without a mark: the side of the zeros shows the order
        return raw.decode("utf-16-le" if head[1::2].count(0) > head[::2].count(0) else "utf-16-be", errors="replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _unpacked(path: Path) -> bytes:
    stored = path.stat().st_size
    pieces, total = [], 0
    with gzip.open(path, "rb") as handle:
        while piece := handle.read(2**22):
            total += len(piece)
            require_size(path, total, stored)
            if total > LARGEST_BYTES // 4:
                require_size(path, LARGEST_BYTES + 1, stored)
            pieces.append(piece)
    return b"".join(pieces)


def _read(path: Path, layout: TextEntry | None = None) -> DataFile:
    text = decode(path)
    if text[:200].lstrip().startswith(FIRST_WORDS):
        return read_lvm(path, text)
    return table_of_text(path, text, layout)


ENDINGS = (".csv", ".txt", ".dat", ".tsv", ".asc")
READER = Reader((*ENDINGS, *(f"{ending}.gz" for ending in ENDINGS)), _read)
