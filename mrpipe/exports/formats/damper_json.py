"""A damper as JSON: form, parameters with units, laws of the drive, effects, steps and test vectors."""

from __future__ import annotations

from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.damper import described
from mrpipe.exports.json_text import as_json


def _files(subject: Subject) -> Files:
    return {f"{subject.name}.json": as_json(subject, described(subject.model))}


FORMAT = ExportFormat(
    kind="damper",
    name="json",
    files=_files,
    usage="## JSON\n\n`{name}.json` holds form, parameters with units, laws of the drive and effects. `steps` lists "
    "the numbers of each step of the model in the order of evaluation.",
)
