"""Where a section of the report is written to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class Sink(Protocol):
    """Takes texts, tables and figures in the order in which the report shows them."""

    def text(self, paragraph: str) -> None:
        """Add a paragraph (Markdown inline marks allowed)."""

    def table(self, name: str, frame: pd.DataFrame, caption: str) -> None:
        """Add a table; it is also saved as tables/<stage>-<name>.csv."""

    def figure(self, name: str, figure: Figure, caption: str) -> None:
        """Add a figure; it is also saved in figures/."""
