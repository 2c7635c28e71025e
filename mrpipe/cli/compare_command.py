"""`mrpipe compare RUN RUN`: differences between two runs in settings, data and results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mrpipe.cli.options import CommonOptions, with_common_options
from mrpipe.errors import UserError
from mrpipe.words import in_percent, noun, number

if TYPE_CHECKING:
    from mrpipe.reporting.compare import KeptRun

_WIDEST = 48
_ROWS_OF_A_STAGE = 12


@with_common_options("config", "run", "overrides", "settings", "campaign", "jobs", "seed", "force")
def compare(
    options: CommonOptions,
    first: Annotated[Path, typer.Argument(metavar="RUN", help="First run directory.")],
    second: Annotated[Path, typer.Argument(metavar="RUN", help="Second run directory.")],
    tolerance: Annotated[
        float, typer.Option(min=0.0, help="Numbers count as equal up to this relative difference.")
    ] = 1e-6,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE.html|DIR", help="Also write overlaid figures and all tables: a page, or a folder."),
    ] = None,
) -> None:
    """Compare two runs: settings, data and results that differ.

    The exit status is 0 also where the runs differ. Example: mrpipe compare runs/before runs/after --plot compare.html
    """
    from mrpipe.cli.output import print_json
    from mrpipe.pipeline.kept_run import read_run, require_two_runs
    from mrpipe.reporting.compare import compare_runs

    require_two_runs(first, second)
    if plot is not None:
        _require_place(plot)
    runs = read_run(first), read_run(second)
    content = compare_runs(*runs, tolerance)
    if plot is not None:
        content["plot"] = [str(path) for path in _write(plot, content, *runs)]
    if options.json:
        print_json(content)
    else:
        _print(content)


def _is_page(plot: Path) -> bool:
    return plot.suffix.lower() in {".html", ".htm"}


def _require_place(plot: Path) -> None:
    """Refuse a place that is neither a page nor a folder, before anything is read."""
    if _is_page(plot):
        if plot.is_dir():
            raise UserError("--plot", str(plot), "is a directory", "name a file that ends in .html")
    elif plot.is_file() or (plot.suffix and not plot.is_dir()):
        raise UserError("--plot", str(plot), "is neither a page nor a folder", "end it in .html, or name a folder")


def _write(plot: Path, content: Mapping[str, Any], first: KeptRun, second: KeptRun) -> list[Path]:
    from mrpipe.reporting.compare_figures import overlays, write_folder, write_page

    return (write_page if _is_page(plot) else write_folder)(plot, content, overlays(first, second))


# --- for a person ----------------------------------------------------------------------------------------------------
def _print(content: Mapping[str, Any]) -> None:

    print(f"first:  {content['runs'][0]}")
    print(f"second: {content['runs'][1]}")
    for name, verdict in zip(("first", "second"), content["verdicts"], strict=True):
        if verdict is not None:
            before, after = (number(verdict[key]) for key in ("before_nrmse", "after_nrmse"))
            print(f"verdict of the {name} run: {verdict['verdict']} (NRMSE {before} before, {after} after)")
    _print_rows(
        "settings",
        ["setting", "first", "second", "read by"],
        [
            [row["setting"], _short(row["first"]), _short(row["second"]), _readers(row["stages"])]
            for row in content["settings"]
        ],
    )
    _print_rows(
        "data",
        ["input", "first", "second"],
        [[row["input"], _data(row["first"]), _data(row["second"])] for row in content["data"]],
    )
    _print_stages(content["stages"])
    _print_results(content["results"], len(content["stages"]["both"]))
    for path in content.get("plot", []):
        print(f"written: {path}")


def _print_rows(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from mrpipe.cli.showing import print_table

    print(f"\n{title}: {len(rows) or 'no'} {noun(len(rows), 'difference')}")
    if rows:
        print_table(header, rows)


def _print_stages(stages: Mapping[str, Any]) -> None:
    print(f"\nstages: {len(stages['both'])} built in both runs")
    for key, text in (
        ("only_first", "only in the first run"),
        ("only_second", "only in the second run"),
        ("code_differs", "built by different versions of the program"),
    ):
        if stages[key]:
            print(f"  {text}: {', '.join(stages[key])}")
    for row in stages["not_built"]:
        print(f"  {row['stage']} of {row['run']}: {row['reason']}")


def _print_results(results: Sequence[Mapping[str, Any]], compared: int) -> None:
    from mrpipe.cli.showing import print_table

    if not compared:
        print("\nresults: nothing to compare, because no stage was built in both runs")
        return
    print(f"\nresults: {len(results) or 'no'} {noun(len(results), 'difference')}")
    for stage in dict.fromkeys(row["stage"] for row in results):
        rows = [row for row in results if row["stage"] == stage]
        print(f"{stage}")
        print_table(
            ["result", "first", "second", "change"],
            [
                [row["key"], _value(row, "first"), _value(row, "second"), _change(row)]
                for row in rows[:_ROWS_OF_A_STAGE]
            ],
        )
        if len(rows) > _ROWS_OF_A_STAGE:
            print(f"  ... {len(rows) - _ROWS_OF_A_STAGE} more (--json and --plot list all)")


def _value(row: Mapping[str, Any], run: str) -> str:
    return _short(row[run]) if row["present"] in {"both", run} else "not there"


def _change(row: Mapping[str, Any]) -> str:
    relative = row["relative_difference"]
    return "-" if relative is None else in_percent(relative, digits=3, signed=True)


def _readers(stages: Sequence[str]) -> str:
    shown = ", ".join(stages[:2]) or "-"
    return f"{shown} and {len(stages) - 2} more" if len(stages) > 2 else shown


def _data(item: Mapping[str, Any] | None) -> str:
    if item is None:
        return "not read"
    name = item["campaign"] or item["path"] or ""
    return f"{name} {item['sha256'][:10]}".strip()


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    text = "-" if value is None else str(value)
    return text if len(text) <= _WIDEST else f"{text[: _WIDEST - 4]} ..."


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(name="compare")(compare)
