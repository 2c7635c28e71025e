"""`mrpipe benchmark NAME`: the benchmark structures of chapter 6 and paper P4."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from mrpipe.cli.options import CommonOptions, with_common_options
from mrpipe.cli.stage_commands import build_and_print
from mrpipe.errors import UserError
from mrpipe.words import in_percent

NAMES = {"ten-storey": "ten_storey", "base-isolated": "base_isolated", "wind": "wind"}
_MODEL_KEY = {"ten-storey": "structures", "base-isolated": "model", "wind": "model"}
_MOTION_KEY = {"ten-storey": "motion.file", "base-isolated": "motion.file", "wind": "load.file"}


def overrides_of(
    name: str, model: str | None, motion: str | None, laws: list[str] | None, everything: bool
) -> list[str]:
    """Return the `section.key=value` texts that the options of the command stand for.

    Raises
    ------
    UserError
        If there is no such benchmark, a file is missing, or `--all` is given for a benchmark without a set of motions.
    """
    if name not in NAMES:
        from mrpipe.artifacts.yaml_source import nearest

        raise UserError("benchmark", name, "is not a benchmark structure", nearest(name, list(NAMES)))
    section = f"benchmark.{NAMES[name]}"
    result = []
    if model is not None:
        value = _file("--model", model, needs_file=name != "ten-storey" and model != "published")
        result.append(f"{section}.{_MODEL_KEY[name]}={json.dumps([value] if name == 'ten-storey' else value)}")
    if motion is not None:
        result.append(f"{section}.{_MOTION_KEY[name]}={json.dumps(_file('--motion', motion))}")
    if laws:
        result.append(f"{section}.laws={json.dumps(laws)}")
    if everything:
        if name != "base-isolated":
            raise UserError("--all", name, "has no set of motions", "use it with base-isolated, or give --motion")
        result.append(f"{section}.all_motions=true")
    return result


def table_of(name: str, summary: Mapping[str, Any]) -> list[str]:
    """Return the lines that a person reads: the structure, and the indices with those of the thesis in brackets."""
    periods = ", ".join(f"{value:.4g}" for value in summary["periods_s"][:5])
    lines = [
        f"{name}: {summary['model']} model, {summary['total_mass_kg'] / 1e3:.6g} t, periods {periods} .. s",
        f"source: {summary['source']}",
        *_more_facts(summary),
        f"largest energy balance error {summary['energy_balance_error']:.1e}",
        "",
    ]
    laws, thesis = summary["laws"], summary["thesis"]
    lines.append("[number]: value that the thesis prints; docs/benchmarks.md explains the indices")
    lines.append(f"{'':6}" + "".join(f"{law:>19}" for law in laws) + f"    {summary['model']} model")
    for index in next(iter(laws.values())):
        cells = []
        for law, values in laws.items():
            printed = thesis.get(law, {}).get(index)
            cells.append(f"{values[index]:.4g}" + (f" [{printed:g}]" if printed is not None else ""))
        lines.append(f"{index:6}" + "".join(f"{cell:>19}" for cell in cells))
    further = {
        **{
            f"{structure}, {variant}": table
            for structure, variants in summary.get("variants", {}).items()
            for variant, table in variants.items()
        },
        **summary.get("motions", {}),
    }
    for title, table in further.items():
        lines += ["", f"{title} ({summary['model']} model)"]
        for law, values in table.items():
            row = " ".join(f"{key} {value:.3g}" for key, value in values.items() if key.startswith("J"))
            lines.append(f"  {law:12} {row}")
    return [*lines, "", f"why the values differ from the thesis: {summary['why_different']}"]


def _more_facts(summary: Mapping[str, Any]) -> list[str]:
    lines = []
    if "fixed_base_periods_s" in summary:
        fixed = ", ".join(f"{value:.4g}" for value in summary["fixed_base_periods_s"][:3])
        isolated, ratio = summary["isolated_period_s"], summary["isolated_damping_ratio"]
        lines.append(
            f"fixed base {fixed} s; isolated {isolated:.4g} s at {in_percent(ratio, 1)} "
            "(rigid building on its bearings)"
        )
    if "motion_details" in summary:
        details = summary["motion_details"]
        peaks = ", ".join(f"{value:.4g}" for value in details["peaks_m_s2"])
        lines.append(
            f"motion {summary['motion']}: peaks {peaks} m/s², {details['duration_s']:.4g} s at "
            f"{details['interval_s']:g} s, unit in the file {details['unit_in_file']} ({details['unit_from']})"
        )
        lines += [f"  {note}" for note in details["notes"]]
    else:
        lines.append(f"{summary['motion']}; device: {summary['position']}, {summary['dampers']:g} dampers")
    return lines


def _file(option: str, value: str, needs_file: bool = False) -> str:
    """Return an absolute path where the value is a file, else the value: the name of a bundled file."""
    path = Path(value)
    if path.is_file():
        return str(path.resolve())
    if needs_file or path.suffix or "/" in value:
        raise UserError(option, value, "no such file", "give the path of an existing file")
    return value


@with_common_options("campaign")
def benchmark(
    options: CommonOptions,
    name: Annotated[str, typer.Argument(metavar="NAME", help="ten-storey, base-isolated or wind.")],
    model: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="File of the published model, or published. Default: the surrogate model that mrpipe assembles.",
        ),
    ] = None,
    motion: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Ground motion (AT2, text, CSV or MATLAB file, or a name such as elcentro or kobe), or file of wind "
            "forces.",
        ),
    ] = None,
    law: Annotated[
        list[str] | None, typer.Option(metavar="LAW", help="Control law. May be given several times.")
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Run all seven motions and all laws (base-isolated only).")
    ] = False,
) -> None:
    """Run a benchmark structure and compare its indices with those of the thesis."""
    extra = overrides_of(name, model, motion, law, everything)
    chosen = replace(options, overrides=[*extra, *options.overrides])
    if options.json:
        build_and_print([f"benchmark-{name}"], chosen)
        return
    from mrpipe.cli.session import session

    with session(chosen) as pipeline:
        if options.force:
            pipeline.force = frozenset([f"benchmark-{name}"])
        outcome = pipeline.build(f"benchmark-{name}")
    print("\n".join(table_of(name, outcome.manifest.summary)))
    for warning in outcome.manifest.warnings:
        print(f"warning: {warning}")
    print(f"in {pipeline.run_directory}")


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(name="benchmark")(benchmark)
