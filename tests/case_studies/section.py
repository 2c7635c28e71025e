"""A section of a report that keeps what is written to it."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure


class Kept:
    """A section of a report that keeps what is written to it."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.tables: dict[str, pd.DataFrame] = {}
        self.figures: dict[str, Figure] = {}
        self.captions: dict[str, str] = {}

    def text(self, paragraph: str) -> None:
        self.texts.append(paragraph)

    def table(self, name: str, frame: pd.DataFrame, caption: str) -> None:
        assert name not in self.tables and caption.endswith(".")
        self.tables[name] = frame

    def figure(self, name: str, figure: Figure, caption: str) -> None:
        assert name not in self.figures and caption.endswith(".")
        self.figures[name] = figure
        self.captions[name] = caption
