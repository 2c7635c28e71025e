"""Section of the report: an exported model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mrpipe.reporting.sink import Sink

if TYPE_CHECKING:
    from mrpipe.exports.contract import Subject


def describe(sink: Sink, subject: Subject, files: Sequence[str], folder: str) -> None:
    """Write the section: what was exported, and where the files are."""
    rows = len(subject.vectors.inputs[0].values)
    sink.text(f"{subject.kind.capitalize()} `{subject.name}` in `{folder}/`: {', '.join(files)}; {rows} test vectors.")
