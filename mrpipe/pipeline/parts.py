"""The parts of the report that stages leave in the run directory: texts, tables and figures."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrpipe.artifacts import atomic_path, atomic_write_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

PARTS = "report-parts"


@dataclass
class PartWriter:
    """Collects one stage's part of the report in `report-parts/<stage>.json` and files in the same folder."""

    stage: str
    run_directory: Path
    items: list[dict[str, Any]] = field(default_factory=list)

    def text(self, paragraph: str) -> None:
        """Add a paragraph."""
        self.items.append({"kind": "text", "text": " ".join(paragraph.split())})

    def table(self, name: str, frame: pd.DataFrame, caption: str) -> None:
        """Add a table and save it as CSV."""
        file = f"tables/{self.stage}-{name}.csv"
        with atomic_path(self.run_directory / file) as temporary:
            frame.map(_readable).to_csv(temporary, index=False)
        self.items.append({"kind": "table", "file": file, "caption": caption})

    def figure(self, name: str, figure: Figure, caption: str) -> None:
        """Add a figure and save it as SVG."""
        from mrpipe.reporting.style import as_svg

        file = f"figures/{self.stage}-{name}.svg"
        atomic_write_text(self.run_directory / file, f'<?xml version="1.0" encoding="utf-8"?>\n{as_svg(figure)}')
        self.items.append({"kind": "figure", "file": file, "caption": caption})

    @property
    def files(self) -> list[str]:
        """Files of the part, relative to the run directory."""
        return [f"{PARTS}/{self.stage}.json", *(str(item["file"]) for item in self.items if "file" in item)]

    def save(self) -> None:
        """Write the part."""
        atomic_write_text(
            self.run_directory / PARTS / f"{self.stage}.json",
            json.dumps({"stage": self.stage, "items": self.items}),
        )


def _readable(cell: Any) -> Any:
    """Return a list as people write it; other cells are left alone."""
    return ", ".join(str(item) for item in cell) if isinstance(cell, list | tuple) else cell


def read_part(run_directory: Path, stage: str) -> list[dict[str, Any]]:
    """Return the items of a stage's part; empty where it left none, and one sentence where the file is damaged."""
    path = run_directory / PARTS / f"{stage}.json"
    if not path.is_file():
        return []
    try:
        items = json.loads(path.read_text(encoding="utf-8"))["items"]
        if all(isinstance(item, dict) and "kind" in item for item in items):
            return list(items)
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return [{"kind": "text", "text": f"The file {PARTS}/{stage}.json is damaged; `mrpipe run` builds it again."}]
