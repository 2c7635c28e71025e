"""Sections of the report that are made when the report is written, held in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass
class Section:
    """One section: a title and its items in order; takes texts, tables and figures like the sink of a stage.

    Attributes
    ----------
    anchor, title
        Identifier of links, and heading.
    items
        `kind` (text, points, table, figure) and what belongs to it.
    """

    anchor: str
    title: str
    items: list[dict[str, Any]] = field(default_factory=list)

    def text(self, paragraph: str) -> None:
        """Add a paragraph."""
        self.items.append({"kind": "text", "text": " ".join(paragraph.split())})

    def points(self, lines: Sequence[str], *, kind: str = "points") -> None:
        """Add a list; kind `warnings` marks what is to be distrusted."""
        if lines:
            self.items.append({"kind": kind, "lines": [" ".join(line.split()) for line in lines]})

    def table(self, name: str, frame: pd.DataFrame, caption: str) -> None:
        """Add a table, shown whole; cells are texts already, or numbers."""
        if len(frame):
            self.items.append({"kind": "table", "name": name, "frame": frame, "caption": caption})

    def figure(self, name: str, figure: Figure, caption: str) -> None:
        """Add a figure."""
        from mrpipe.reporting.style import as_svg

        self.items.append({"kind": "figure", "name": name, "svg": as_svg(figure), "caption": caption})
