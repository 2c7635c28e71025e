"""Writing of a recorded campaign and its sealed truth."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from mrpipe.artifacts import atomic_write_text
from mrpipe.campaigns import CAMPAIGN_FILE

SEALED = "sealed.json"


@contextmanager
def campaign_directory(final: Path) -> Iterator[Path]:
    """Yield an empty directory next to `final` that replaces it when the block ends without an exception."""
    final = Path(final)
    final.parent.mkdir(parents=True, exist_ok=True)
    for left in final.parent.glob(f".{final.name}.*.tmp"):
        shutil.rmtree(left, ignore_errors=True)
    temporary = final.with_name(f".{final.name}.{os.getpid()}.tmp")
    temporary.mkdir()
    try:
        yield temporary
        if final.exists():
            # two renames: after an interruption between them there is no campaign, and the next call records it again
            aside = final.with_name(f".{final.name}.{os.getpid()}.old.tmp")
            final.rename(aside)
            temporary.rename(final)
            shutil.rmtree(aside)
        else:
            temporary.rename(final)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def write_scales(folder: Path, scales: Mapping[str, float]) -> None:
    """Add the conversion factors of the sensors to the channels of a written campaign.yaml."""
    file = folder / CAMPAIGN_FILE
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    for quantity, scale in scales.items():
        content["channels"][quantity]["scale"] = float(scale)
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    atomic_write_text(file, text)


def sealed_path(campaign: Path) -> Path:
    """Return the path of the truth of a campaign: next to the campaign, never inside it."""
    campaign = Path(campaign)
    return campaign.with_name(f"{campaign.name}.truth") / SEALED


def write_sealed(campaign: Path, truth: Mapping[str, Any]) -> Path:
    """Write the truth of a campaign and return the file."""
    path = sealed_path(campaign)
    atomic_write_text(path, json.dumps(truth, indent=1))
    return path


def open_sealed(campaign: Path) -> dict[str, Any]:
    """Read the truth of a campaign; for tests and benchmarks, after the verdict."""
    content: dict[str, Any] = json.loads(sealed_path(campaign).read_text(encoding="utf-8"))
    return content
