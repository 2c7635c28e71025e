"""A network as JSON: weights, scaling, meaning of the features and test vectors."""

from __future__ import annotations

from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.json_text import as_json
from mrpipe.exports.network import described


def _files(subject: Subject) -> Files:
    return {f"{subject.name}.json": as_json(subject, described(subject.model))}


FORMAT = ExportFormat(
    kind="network",
    name="json",
    files=_files,
    usage="## JSON\n\n`{name}.json` holds weights, scaling and the meaning of each feature. Its entry `formula` states "
    "how they are evaluated.",
)
