"""The report: one HTML file that opens offline, and the same in Markdown.

It answers first (:mod:`mrpipe.reporting.front`); what each stage did follows in an appendix.
"""

from __future__ import annotations

import base64
import html
import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader, select_autoescape
from markupsafe import Markup

from mrpipe.artifacts import atomic_write_text
from mrpipe.reporting.facts import ReportStage, RunFacts
from mrpipe.reporting.front.sections import sections
from mrpipe.reporting.front.statements import statements
from mrpipe.reporting.words import readable_unit
from mrpipe.reporting.writer import Section
from mrpipe.words import listed, number

__all__ = ["ReportStage", "RunFacts", "first_screen", "write_report"]

_ROWS_SHOWN = 15

_NUMBER_AND_UNIT = re.compile(r"(\d) (?=(?:%|[µmk]?(?:m|N|A|V|s|g|Hz|rad|kg|min|h|J)(?:/|\b)))")
"""A space that a line must not break at, because the unit belongs to the number."""


_IS_NUMBER = re.compile(r"-?|[-+]?[\d.]+(?:e[-+]?\d+)?")
"""A number, or a cell without one."""


def first_screen(facts: RunFacts, columns: int = 100) -> list[str]:
    """Return the first screen as lines for a terminal.

    Parameters
    ----------
    facts
        The run.
    columns
        Longest line.
    """
    indent, width = " " * 12, max(columns, 40)
    lines = [facts.title, _source_line(facts), *textwrap.wrap(facts.description, width), ""]
    for item in statements(facts):
        text = item.text.replace("**", "").replace("`", "")
        kept_together = _NUMBER_AND_UNIT.sub("\\1\N{NO-BREAK SPACE}", f"{item.topic:{len(indent)}}{text}")
        wrapped = textwrap.wrap(kept_together, width, subsequent_indent=indent, break_on_hyphens=False)
        lines += [line.replace("\N{NO-BREAK SPACE}", " ") for line in wrapped]
    return lines


def _source_line(facts: RunFacts) -> str:
    from mrpipe import __version__

    parts = [
        f"campaign {listed(facts.campaigns)}" if facts.campaigns else "",
        facts.date,
        f"mrpipe {__version__}",
    ]
    return " - ".join(part for part in parts if part)


def write_report(facts: RunFacts, formats: Sequence[str]) -> list[Path]:
    """Write report.html and report.md of a run directory.

    Parameters
    ----------
    facts
        The run.
    formats
        `html`, `markdown` or both.

    Returns
    -------
    The files written.
    """
    from mrpipe.reporting.headlines import headline

    environment = Environment(
        loader=PackageLoader("mrpipe.reporting", "templates"),
        autoescape=select_autoescape(["html"]),
        trim_blocks=True,
        lstrip_blocks=True,
    )
    front = sections(facts)
    content = {
        "title": facts.title,
        "source": _source_line(facts),
        "description": facts.description,
        "sections": front,
        "stages": [
            {"part": stage, "headline": stage.skipped or headline(stage.name, stage.summary), "anchor": stage.name}
            for stage in facts.stages
        ],
    }
    written = []
    if "html" in formats:
        environment.filters["item"] = lambda item: _item_html(facts.directory, item)
        text = environment.get_template("report.html").render(content)
        atomic_write_text(facts.directory / "report.html", text)
        written.append(facts.directory / "report.html")
    if "markdown" in formats:
        _save_figures(facts.directory, front)
        environment.filters["item"] = lambda item: _item_markdown(facts.directory, item)
        environment.filters["cell"] = _cell
        text = environment.get_template("report.md").render(content)
        atomic_write_text(facts.directory / "report.md", re.sub(r"\n{3,}", "\n\n", text))
        written.append(facts.directory / "report.md")
    return written


def _save_figures(directory: Path, front: Sequence[Section]) -> None:
    """Save the figures of the sections, to which the Markdown report links."""
    for section in front:
        for item in section.items:
            if item["kind"] == "figure":
                item["file"] = f"figures/{section.anchor}-{item['name']}.svg"
                atomic_write_text(directory / item["file"], _standalone(item["svg"]))


def _standalone(svg: str) -> str:
    return f'<?xml version="1.0" encoding="utf-8"?>\n{svg}'


# --- HTML ------------------------------------------------------------------------------------------------------------
def _item_html(directory: Path, item: Mapping[str, Any]) -> Markup:
    kind = item["kind"]
    if kind == "text":
        return Markup(f"<p>{_inline(str(item['text']))}</p>")
    if "lines" in item:
        rows = "".join(f"<li>{_inline(line)}</li>" for line in item["lines"])
        return Markup(f"<ul class='{kind}'>{rows}</ul>")
    caption = _inline(str(item["caption"]))
    if "svg" in item:
        return _figure_html(str(item["svg"]), str(item["caption"]))
    if "frame" in item:
        table = _table_html(item["frame"])
        return Markup(f"<div class='table'><p class='caption'>{caption}</p><div class='scroll'>{table}</div></div>")
    path = directory / str(item["file"])
    if not path.is_file():
        return Markup(f"<p class='missing'>{html.escape(str(item['file']))} is missing: build the stage again.</p>")
    if kind == "figure":
        if path.suffix == ".svg":
            return _figure_html(path.read_text(encoding="utf-8"), str(item["caption"]))
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        alt = html.escape(str(item["caption"]), quote=True)
        return Markup(
            f"<figure><img alt='{alt}' src='data:image/png;base64,{data}'><figcaption>{caption}</figcaption></figure>"
        )
    frame = _table(path)
    more = f" ({len(frame)} rows, the first {_ROWS_SHOWN} shown)" if len(frame) > _ROWS_SHOWN else ""
    name = html.escape(str(item["file"]))
    return Markup(
        f"<div class='table'><p class='caption'>{caption}{more} <code>{name}</code></p>"
        f"<div class='scroll'>{_table_html(frame.head(_ROWS_SHOWN))}</div></div>"
    )


def _table_html(frame: pd.DataFrame) -> str:
    """Return a table; columns of numbers, or of texts that are numbers, are aligned to the right with their heading."""
    columns = [(str(name), [_shown(str(name), value) for value in frame.iloc[:, k]]) for k, name in enumerate(frame)]
    kinds = [" class='number'" if all(map(_IS_NUMBER.fullmatch, cells)) else "" for _, cells in columns]
    heads = "".join(f"<th{kind}>{html.escape(name)}</th>" for kind, (name, _) in zip(kinds, columns, strict=True))
    rows = "".join(
        f"<tr>{''.join(f'<td{kind}>{html.escape(cell)}</td>' for kind, cell in zip(kinds, row, strict=True))}</tr>\n"
        for row in zip(*(cells for _, cells in columns), strict=True)
    )
    return f"<table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table>"


def _shown(column: str, value: Any) -> str:
    """Return a cell as people read it: a few digits, `-` for a missing value, no unit for a ratio."""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if column == "unit":
        return readable_unit("" if pd.isna(value) else str(value))
    return "-" if pd.isna(value) else _four_digits(float(value)) if isinstance(value, float) else str(value)


def _figure_html(svg: str, caption: str) -> Markup:
    svg = svg[svg.index("<svg") :]
    # the width is that of the page; the height follows from the view box
    start = svg.index(">")
    svg = re.sub(r'\s(?:width|height)="[\d.]+pt"', "", svg[:start]) + svg[start:]
    box = re.search(r'viewBox="[\d.]+ [\d.]+ ([\d.]+) ', svg)
    width = round(float(box.group(1)) * 96.0 / 72.0) if box else 640
    alt = html.escape(caption, quote=True)
    return Markup(
        f"<figure><div class='scroll'><div class='drawing' role='img' aria-label='{alt}' style='max-width:{width}px'>"
        f"{svg}</div></div><figcaption>{_inline(caption)}</figcaption></figure>"
    )


# --- Markdown --------------------------------------------------------------------------------------------------------
def _item_markdown(directory: Path, item: Mapping[str, Any]) -> str:
    kind = item["kind"]
    if kind == "text":
        return f"{item['text']}\n"
    if "lines" in item:
        return "\n".join(f"- {line}" for line in item["lines"]) + "\n"
    if kind == "figure":
        return f"![{item['caption']}]({item['file']})\n\n*{item['caption']}*\n"
    if "frame" in item:
        return f"*{item['caption']}*\n\n{_markdown_table(item['frame'])}\n"
    path = directory / str(item["file"])
    if not path.is_file():
        return f"{item['file']} is missing: build the stage again.\n"
    return (
        f"*{item['caption']}* ([{item['file']}]({item['file']}))\n\n{_markdown_table(_table(path).head(_ROWS_SHOWN))}\n"
    )


def _markdown_table(frame: pd.DataFrame) -> str:
    rows = ["| " + " | ".join(str(name) for name in frame.columns) + " |", "|" + " --- |" * len(frame.columns)]
    for values in frame.itertuples(index=False):
        rows.append("| " + " | ".join(_cell(value) for value in values) + " |")
    return "\n".join(rows)


def _table(path: Path) -> pd.DataFrame:
    # only an empty cell is missing: the unit N/A (newton per ampere) and the text "None" are not
    return pd.read_csv(path, keep_default_na=False, na_values=[""])


def _four_digits(value: float) -> str:
    return number(value, 4)


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return _four_digits(value)
    return str(value).replace("|", "\\|")


def _inline(text: str) -> str:
    """Turn `code`, **strong** and *emphasis* of a text into HTML; everything else is escaped."""
    escaped = html.escape(text)
    escaped = re.sub(r"`([^`]+)`", r"<code>\1</code>", escaped)
    escaped = re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", escaped)
    escaped = re.sub(r"(?<!\*)\*([^*\s][^*]*)\*(?!\*)", r"<em>\1</em>", escaped)
    pieces = re.split(r"(<code>.*?</code>)", escaped)
    pieces[::2] = [_NUMBER_AND_UNIT.sub("\\1\N{NO-BREAK SPACE}", piece) for piece in pieces[::2]]
    return "".join(pieces)
