"""Record of a stage that ran, and its comparison with the present inputs, settings and code."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from mrpipe.artifacts import atomic_write_text
from mrpipe.pipeline.fingerprint import FileHashes, flatten


@dataclass(frozen=True)
class StageKey:
    """Everything on which the result of a stage depends.

    Attributes
    ----------
    inputs
        Declared input -> digest; `absent` for an optional input that is not there.
    settings
        Dotted name -> value, of the settings that the stage reads.
    code
        Module -> hash of its source.
    seed
        Seed of the run.
    """

    inputs: Mapping[str, str]
    settings: Mapping[str, Any]
    code: Mapping[str, str]
    seed: int


@dataclass(frozen=True)
class Manifest:
    """Record of a finished stage: key, outputs, summary and warnings.

    Attributes
    ----------
    stage
        Name of the stage.
    key
        Key of all that the result depends on.
    outputs
        File, relative to the run directory -> digest: artifacts, and the stage's part of the report.
    summary
        Summary that the stage printed.
    warnings
        Warnings of the stage.
    skipped
        Why the stage was skipped or has failed; empty if it ran.
    seconds
        Wall time.
    failed
        What went wrong, in one line: of the whole stage where `skipped` says the same, else of a part of it.
    """

    stage: str
    key: StageKey
    outputs: Mapping[str, str]
    summary: Mapping[str, Any]
    warnings: list[str] = field(default_factory=list)
    skipped: str = ""
    seconds: float = 0.0
    failed: str = ""

    @property
    def has_no_key(self) -> bool:
        """Whether the stage was skipped before it could run, so that there is nothing to compare with."""
        return bool(self.skipped) and not (self.key.inputs or self.key.settings or self.key.code)

    def save(self, directory: Path) -> None:
        """Write `<directory>/<stage>.json` atomically."""
        atomic_write_text(directory / f"{self.stage}.json", json.dumps(asdict(self), indent=1))

    @classmethod
    def load(cls, directory: Path, stage: str) -> Manifest | None:
        """Read the manifest of a stage, or None if it does not exist or cannot be read."""
        try:
            found: Manifest = _adapter().validate_json((directory / f"{stage}.json").read_bytes())
            return found
        except (OSError, ValueError):
            return None


@cache
def _adapter() -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(Manifest)


def reasons_stale(manifest: Manifest | None, key: StageKey, run_directory: Path, hashes: FileHashes) -> list[str]:
    """Return the reasons why a stage has to run; empty if the existing result can be used."""
    if manifest is not None and manifest.failed and manifest.skipped:
        return [f"the last run of it failed: {manifest.failed}"]
    if manifest is None or manifest.has_no_key:
        return ["never built"]
    reasons = []
    for name in sorted({*manifest.key.inputs, *key.inputs}):
        before, now = manifest.key.inputs.get(name), key.inputs.get(name)
        if before != now:
            reasons.append(f"input {name} {_change(before, now)}")
    before_settings, now_settings = (
        flatten(manifest.key.settings),
        flatten(json.loads(json.dumps(key.settings))),
    )
    for name in sorted({*before_settings, *now_settings}):
        before, now = before_settings.get(name), now_settings.get(name)
        if before != now:
            reasons.append(f"setting {name} was {before}, is {now}")
    changed = sorted(
        name for name in {*manifest.key.code, *key.code} if manifest.key.code.get(name) != key.code.get(name)
    )
    if changed:
        shown = ", ".join(changed[:3]) + (f" and {len(changed) - 3} more" if len(changed) > 3 else "")
        reasons.append(f"code of {shown} changed")
    if manifest.key.seed != key.seed:
        reasons.append(f"seed was {manifest.key.seed}, is {key.seed}")
    for name, digest in manifest.outputs.items():
        path = run_directory / name
        if not path.exists():
            reasons.append(f"output {name} is missing")
        elif hashes.digest(path) != digest:
            reasons.append(f"output {name} was changed or damaged after it was written")
    return reasons


def _change(before: str | None, now: str | None) -> str:
    if now is None or now == "absent":
        return "is missing"
    if before is None or before == "absent":
        return "is new"
    return "changed"
