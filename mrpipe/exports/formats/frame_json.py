"""A frame as JSON: matrices, the discrete step and test vectors."""

from __future__ import annotations

from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.frame import described
from mrpipe.exports.json_text import as_json


def _files(subject: Subject) -> Files:
    return {f"{subject.name}.json": as_json(subject, described(subject.model))}


FORMAT = ExportFormat(
    kind="frame",
    name="json",
    files=_files,
    usage="## JSON\n\n`{name}.json` holds mass, damping and stiffness, and the matrices of the step, by rows.",
)
