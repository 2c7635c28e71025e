"""The JSON file of an export."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from mrpipe import __version__
from mrpipe.exports.contract import Channel, Subject

SCHEMA = "mrpipe-export-1"


def as_json(subject: Subject, model: Mapping[str, Any]) -> str:
    """Return the description of a model with its test vectors as JSON.

    Parameters
    ----------
    subject
        The model that is exported.
    model
        The model as plain values.
    """
    vectors = subject.vectors
    content = {
        "schema": SCHEMA,
        "kind": subject.kind,
        "name": subject.name,
        "mrpipe_version": __version__,
        **subject.details,
        "model": dict(model),
        "vectors": {
            "sample_time_s": vectors.sample_time_s,
            "inputs": _plain(vectors.inputs),
            "outputs": _plain(vectors.outputs),
        },
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _plain(channels: tuple[Channel, ...]) -> list[dict[str, Any]]:
    return [
        {"name": item.name, "unit": item.unit, "values": [float(value) for value in item.values]} for item in channels
    ]
