"""The report: one HTML file that opens offline, and the same in Markdown."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, select_autoescape
from markupsafe import Markup

from mrpipe.artifacts import atomic_write_text

_ROWS_SHOWN = 15


@dataclass(frozen=True)
class ReportStage:
    """One stage's part: what it left, its summary, its warnings, or why it was skipped."""

    name: str
    about: str
    items: Sequence[Mapping[str, Any]]
    summary: Mapping[str, Any]
    warnings: Sequence[str]
    skipped: str
    seconds: float


def write_report(
    directory: Path, *, title: str, description: str, stages: Sequence[ReportStage], formats: Sequence[str]
) -> list[Path]:
    """Write report.html and report.md of a run directory.

    Parameters
    ----------
    directory
        Run directory; figures and tables are read from it.
    formats
        `html`, `markdown` or both.

    Returns
    -------
    The files written.
    """
    from mrpipe import __version__
    from mrpipe.reporting.headlines import headline

    environment = Environment(
        loader=PackageLoader("mrpipe.reporting", "templates"),
        autoescape=select_autoescape(["html"]),
        trim_blocks=True,
        lstrip_blocks=True,
    )
    content = {
        "title": title,
        "description": description,
        "version": __version__,
        "stages": [
            {"part": stage, "headline": stage.skipped or headline(stage.name, stage.summary), "anchor": stage.name}
            for stage in stages
        ],
    }
    written = []
    if "html" in formats:
        environment.filters["item"] = lambda item: _item_html(directory, item)
        atomic_write_text(directory / "report.html", environment.get_template("report.html").render(content))
        written.append(directory / "report.html")
    if "markdown" in formats:
        environment.filters["item"] = lambda item: _item_markdown(directory, item)
        text = environment.get_template("report.md").render(content)
        atomic_write_text(directory / "report.md", re.sub(r"\n{3,}", "\n\n", text))
        written.append(directory / "report.md")
    return written


def _item_html(directory: Path, item: Mapping[str, Any]) -> Markup:
    if item["kind"] == "text":
        return Markup(f"<p>{_inline(str(item['text']))}</p>")
    caption = _inline(str(item["caption"]))
    path = directory / str(item["file"])
    if not path.is_file():
        return Markup(f"<p class='missing'>{html.escape(str(item['file']))} is gone: build the stage again.</p>")
    if item["kind"] == "figure":
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        alt = html.escape(str(item["caption"]), quote=True)
        return Markup(
            f"<figure><img alt='{alt}' src='data:image/png;base64,{data}'><figcaption>{caption}</figcaption></figure>"
        )
    frame = _table(path)
    more = f" ({len(frame)} rows, the first {_ROWS_SHOWN} shown)" if len(frame) > _ROWS_SHOWN else ""
    link = html.escape(str(item["file"]), quote=True)
    table = frame.head(_ROWS_SHOWN).to_html(index=False, border=0, na_rep="-", justify="left", float_format=_number)
    return Markup(
        f"<div class='table'><p class='caption'>{caption}{more} <a href='{link}'>{link}</a></p>"
        f"<div class='scroll'>{table}</div></div>"
    )


def _item_markdown(directory: Path, item: Mapping[str, Any]) -> str:
    if item["kind"] == "text":
        return f"{item['text']}\n"
    path = directory / str(item["file"])
    if item["kind"] == "figure":
        return f"![{item['caption']}]({item['file']})\n\n*{item['caption']}*\n"
    if not path.is_file():
        return f"{item['file']} is gone: build the stage again.\n"
    frame = _table(path).head(_ROWS_SHOWN)
    rows = ["| " + " | ".join(str(name) for name in frame.columns) + " |", "|" + " --- |" * len(frame.columns)]
    for values in frame.itertuples(index=False):
        rows.append("| " + " | ".join(_cell(value) for value in values) + " |")
    return f"*{item['caption']}* ([{item['file']}]({item['file']}))\n\n" + "\n".join(rows) + "\n"


def _table(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, keep_default_na=True)


def _number(value: float) -> str:
    return f"{value:.4g}"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "-" if value != value else _number(value)
    return str(value).replace("|", "\\|")


def _inline(text: str) -> str:
    """Turn `code`, **strong** and *emphasis* of a text into HTML; everything else is escaped."""
    escaped = html.escape(text)
    escaped = re.sub(r"`([^`]+)`", r"<code>\1</code>", escaped)
    escaped = re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", escaped)
    return re.sub(r"(?<!\*)\*([^*\s][^*]*)\*(?!\*)", r"<em>\1</em>", escaped)
