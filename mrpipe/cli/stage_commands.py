"""One command for each stage; stages of one family share a command."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mrpipe.cli.options import CommonOptions, with_common_options
from mrpipe.control.laws import law_names
from mrpipe.errors import CheckFailed, UserError
from mrpipe.words import shell_word

if TYPE_CHECKING:
    from pathlib import Path

    from mrpipe.pipeline.execution import Outcome
    from mrpipe.pipeline.runner import Pipeline

_EXPORTS = ("controller", "damper", "frame", "forward", "inverse", "opensees")
_ONE_DAMPER = frozenset({"controller", "damper", "frame"})
"""Exports that contain exactly one damper, its control law or its place in the structure."""
_FORMATS = ("c", "json", "matlab", "onnx")
_FORMATS_OF: dict[str, tuple[str, ...]] = {"controller": ("c", "json"), "opensees": ()}
"""Formats of the exports that are always written in the same formats."""
_RIGS = ("bench", "frame", "closed-loop")


def build_and_print(
    names: list[str], options: CommonOptions, together: tuple[str, ...] = (), *, where_possible: bool = False
) -> None:
    """Bring stages up to date and print the summary of each.

    Parameters
    ----------
    names
        Stages.
    options
        Options of the command.
    together
        Kinds of stages, such as `simulate` and `resonance`, whose results for one law are printed as one document under
        the name of the first kind.
    where_possible
        Whether stages without data are left out with a message while others can run.

    Raises
    ------
    UserError
        If a requested stage has no data, if it needs an inverse model and the drive of the campaign never changes, or
        if it traces effects and the campaign declares an unknown one.
    """
    from mrpipe.cli.campaign_refusal import refuse_before_building, refuse_constant_drive
    from mrpipe.cli.output import print_brief, print_json, print_summary
    from mrpipe.cli.session import session
    from mrpipe.reporting.headlines import in_brief
    from mrpipe.reporting.prepared_rows import to_read

    with session(options) as pipeline:
        if options.campaign is not None:
            _require_use(names, pipeline, options.campaign)
        if options.force:
            pipeline.force = frozenset(names)
        refuse_before_building(pipeline, names, where_possible=where_possible)
        if where_possible:
            names = _without_constant_drive(pipeline, names)
        else:
            refuse_constant_drive(pipeline, names)
        outcomes = _with_data([pipeline.build(name) for name in names], where_possible)
    if options.json:
        # a caller that reads standard output alone sees them too
        summaries = {
            outcome.stage: {"warnings": outcome.manifest.warnings, **outcome.manifest.summary} for outcome in outcomes
        }
        merged = _merged(summaries, together)
        print_json(merged if len(merged) > 1 else next(iter(merged.values())))
        _raise_failures(outcomes, pipeline)
        return
    for outcome in outcomes:
        note = " (up to date)" if outcome.what == "reused" else ""
        brief = in_brief(outcome.stage, outcome.manifest.summary)
        if brief:
            print_brief(f"{outcome.stage}{note}", brief, outcome.manifest.warnings)
        else:
            summary = to_read(outcome.stage, outcome.manifest.summary)
            print_summary(f"{outcome.stage}{note}", summary, outcome.manifest.warnings)
    print(f"in {pipeline.run_directory}; next: mrpipe report {shell_word(pipeline.run_directory)}")
    _raise_failures(outcomes, pipeline)


def _without_constant_drive(pipeline: Pipeline, names: Sequence[str]) -> list[str]:
    """Return the stages that can be built with the drive of the campaign; the others are named on standard error."""
    from mrpipe.cli.campaign_refusal import constant_drive

    possible = []
    for name in names:
        error = constant_drive(pipeline, [name])
        if error is not None:
            reason = f"the {error.where} {error.problem}, and an inverse model needs two drives"
            print(f"{name} is left out: {reason}", file=sys.stderr)
            continue
        possible.append(name)
    return possible


def _with_data(outcomes: Sequence[Outcome], where_possible: bool) -> list[Outcome]:
    """Return the outcomes of stages that had data; the others are an error, or named on standard error."""
    built = [outcome for outcome in outcomes if outcome.what != "skipped"]
    for outcome in outcomes:
        if outcome.what != "skipped":
            continue
        if not (where_possible and built):
            raise UserError(
                outcome.stage,
                "",
                f"cannot run: {outcome.manifest.skipped}",
                "change the data or the setting that the reason names",
            )
        print(f"{outcome.stage} is left out: {outcome.manifest.skipped}", file=sys.stderr)
    return built


def _require_use(names: Sequence[str], pipeline: Pipeline, campaign: Path) -> None:
    """Refuse a campaign on the command line that no requested stage reads, itself or through its inputs."""
    from mrpipe.cli.session import rig_key

    used: set[str] = set()

    def collect(name: str) -> None:
        stage = pipeline.stages[name]
        for item in (*stage.inputs, *stage.preferred_inputs, *stage.optional_inputs):
            if item.startswith("campaign:"):
                used.add(item.partition(":")[2])
            elif item in pipeline.stages and item not in seen:
                seen.add(item)
                collect(item)

    seen: set[str] = set(names)
    for name in names:
        collect(name)
    given = rig_key(campaign).replace("_", "-")
    if used and given not in used:
        kinds = {
            "bench": "a damper-bench campaign",
            "frame": "a campaign of a structure",
            "closed-loop": "closed-loop tests",
        }
        held = kinds[given]
        # closed-loop tests are tests of a structure too, but they do not show its modes
        kinds["frame"] = "a campaign of a structure with sweep, random, ambient or free-decay tests"
        wanted = " or ".join(kinds[item] for item in ("bench", "frame", "closed-loop") if item in used)
        raise UserError("--campaign", str(campaign), f"holds {held}; {names[0]} reads {wanted}", f"give {wanted}")


def _raise_failures(outcomes: Sequence[Outcome], pipeline: Pipeline) -> None:
    """Raise CheckFailed where a part of a stage or an optional stage before it failed; the results were printed."""
    before = [item for item in pipeline.outcomes.values() if item.what == "failed"]
    failed = [f"{item.stage}: {item.manifest.failed}" for item in (*before, *outcomes) if item.manifest.failed]
    if failed:
        raise CheckFailed("; ".join(failed))


def _merged(summaries: dict[str, dict[str, Any]], kinds: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Return one document per law: what later kinds found is added to that of the first kind."""
    merged: dict[str, dict[str, Any]] = {}
    for name, summary in summaries.items():
        kind = next((kind for kind in kinds if name.startswith(f"{kind}-")), "")
        key = f"{kinds[0]}-{name.removeprefix(f'{kind}-')}" if kind else name
        known = merged.setdefault(key, {"warnings": []})
        warnings = [*known["warnings"], *summary["warnings"]]
        known.update(summary)
        known["warnings"] = warnings
    return merged


def _plain_command(name: str) -> Callable[..., None]:
    @with_common_options()
    def command(options: CommonOptions) -> None:
        build_and_print([name], options)

    return command


@with_common_options("campaign")
def record(
    options: CommonOptions,
    rig: Annotated[
        str | None,
        typer.Option(metavar="RIG", help="bench, frame or closed-loop. Default: all that the configuration lists."),
    ] = None,
) -> None:
    """Record a campaign in the virtual laboratory."""
    from mrpipe.cli.session import load
    from mrpipe.config.sections.campaigns import LABORATORY

    if rig is not None and rig not in _RIGS:
        raise UserError("--rig", rig, "is not a rig", f"one of {', '.join(_RIGS)}")
    config = load(options).config
    sources = {key.replace("_", "-"): source for key, source in config.campaigns.model_dump().items()}
    listed = [name.removeprefix("record-") for name in config.stages if name.startswith("record-")]
    rigs = [rig] if rig else listed or ["bench"]
    for name in rigs:
        if sources[name] not in (None, LABORATORY):
            raise UserError(
                "record",
                name,
                f"the run has measured data ({sources[name]}): virtual data do not enter it",
                f"record into another run: mrpipe record --rig {name} --config thesis --run DIR",
            )
    build_and_print([f"record-{name}" for name in rigs], options)


def _with_damper(options: CommonOptions, damper: str) -> CommonOptions:
    """Return the options with the damper of --damper; one that is not there is refused before any stage is built."""
    from dataclasses import replace

    from mrpipe.effects.damper import require_damper

    require_damper(damper)
    return replace(options, overrides=[*options.overrides, f"simulate.damper={damper}"])


def _several_dampers(options: CommonOptions) -> bool:
    """Return whether the configuration gives the dampers of the structure one by one."""
    from mrpipe.cli.session import load

    structure = getattr(load(options).config, "structure", None)
    return structure is not None and bool(structure.dampers)


@with_common_options()
def simulate(
    options: CommonOptions,
    law: Annotated[str | None, typer.Option(metavar="LAW", help=f"{', '.join(law_names())}; or all.")] = None,
    resonance: Annotated[
        bool,
        typer.Option("--resonance", help="Also find the resonance of the closed loop and its response over frequency."),
    ] = False,
    damper: Annotated[
        str | None,
        typer.Option(
            metavar="DAMPER",
            help="Damper in the structure: identified, traced (by close-loop), a parameter set of configs/dampers, or "
            "a file. With traced, the controller remains the one for the identified damper.",
        ),
    ] = None,
    gains: Annotated[
        str | None,
        typer.Option(metavar="GAINS", help="calibrated, or design: the best gains that mrpipe design found."),
    ] = None,
) -> None:
    """Run the closed loop under a control law."""
    from dataclasses import replace

    from mrpipe.artifacts.yaml_source import nearest

    known = law_names()
    if _several_dampers(options):
        if law is not None or resonance or damper is not None:
            raise UserError(
                "simulate",
                "--law, --resonance or --damper",
                "does not suit the configuration, because each damper of structure.dampers has its own model and law",
                "leave the option out; mrpipe design gives the response over frequency",
            )
        build_and_print(["simulate-dampers"], options)
        return
    if law is None:
        raise UserError("--law", "", "is missing", f"one of {', '.join((*known, 'all'))}")
    if law != "all" and law not in known:
        raise UserError("--law", law, "is not a control law", nearest(law, [*known, "all"]))
    if damper is not None:
        options = _with_damper(options, damper)
    if gains is not None:
        options = replace(options, overrides=[*options.overrides, f"gains.source={gains}"])
    laws = known if law == "all" else (law,)
    kinds = ("simulate", "resonance") if resonance else ("simulate",)
    build_and_print([f"{kind}-{item}" for item in laws for kind in kinds], options, together=kinds)


@with_common_options()
def design(
    options: CommonOptions,
    damper: Annotated[
        str | None,
        typer.Option(
            metavar="DAMPER",
            help="Damper in the structure: identified, traced (by close-loop), a parameter set of configs/dampers, or "
            "a file. With traced, the result also says how much worse the design without the tracing is.",
        ),
    ] = None,
) -> None:
    """Find the best law and gains; the help text is that of the stage."""

    if damper is not None:
        if _several_dampers(options):
            raise UserError(
                "design",
                "--damper",
                "does not suit the configuration, because each damper of structure.dampers has its own model",
                "leave the option out",
            )
        options = _with_damper(options, damper)
    build_and_print(["design"], options)


@with_common_options()
def export(
    options: CommonOptions,
    what: Annotated[str, typer.Argument(metavar="WHAT", help=f"{', '.join(_EXPORTS)}; or all.")] = "controller",
    law: Annotated[
        str | None,
        typer.Option(
            metavar="LAW",
            help="Control law of the controller, written to controller/LAW. Default: the setting export.law.",
        ),
    ] = None,
    damper: Annotated[
        str | None,
        typer.Option(
            metavar="DAMPER",
            help="identified, traced (by close-loop), a parameter set of configs/dampers, or a file. The exported "
            "controller is adapted to this damper; simulate --damper traced keeps the controller for the identified "
            "damper.",
        ),
    ] = None,
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            metavar="FORMAT",
            help="c, json, matlab or onnx. May be given several times. Default: every format that is possible.",
        ),
    ] = None,
    gains: Annotated[
        str | None,
        typer.Option(metavar="GAINS", help="calibrated, or design: the best gains that mrpipe design found."),
    ] = None,
) -> None:
    """Write the calibrated controller or a model as code or data for other programs, with test vectors."""
    from mrpipe.artifacts.yaml_source import nearest

    if what not in (*_EXPORTS, "all"):
        raise UserError("export", what, "cannot be exported", f"one of {', '.join((*_EXPORTS, 'all'))}")
    if law is not None and law not in law_names():
        raise UserError("--law", law, "is not a control law", nearest(law, law_names()))
    if _ONE_DAMPER.intersection(_EXPORTS if what == "all" else (what,)) and _several_dampers(options):
        raise UserError(
            "export",
            what,
            "is not supported with structure.dampers, because it knows one damper and one law",
            "export opensees for the structure, or describe a single damper by calibrate.damper, "
            "calibrate.damper_floor and calibrate.damper_across_storey in place of structure.dampers",
        )
    for name in formats or ():
        if name not in _FORMATS:
            raise UserError("--format", name, "is not a format", nearest(name, _FORMATS))
        if name not in _FORMATS_OF.get(what, _FORMATS):
            remedy = f"leave --format out; it is written as {' and '.join(_FORMATS_OF[what]) or 'a Python script'}"
            raise UserError("--format", name, f"is not a format of {what}", remedy)
    options = options if damper is None else _with_damper(options, damper)
    given = {"gains.source": gains}
    overrides = [f"{name}={value}" for name, value in given.items() if value is not None]
    if formats:
        overrides.append(f"export.formats=[{', '.join(formats)}]")
    chosen = replace(options, overrides=[*options.overrides, *overrides])
    stages = {name: f"export-{name}" for name in _EXPORTS}
    if law is not None:
        stages["controller"] += f"-{law}"
    wanted = [stages[name] for name in (_EXPORTS if what == "all" else (what,))]
    build_and_print(wanted, chosen, where_possible=what == "all")


_FAMILIES: dict[str, Callable[..., None]] = {"record": record, "simulate": simulate, "export": export}
"""Commands that run one stage of a family, chosen by an option (`benchmark` has its own module)."""

_WITH_OPTIONS: dict[str, Callable[..., None]] = {"design": design}
"""Stages that are a command with further options."""


def register(app: typer.Typer) -> None:
    """Add the commands to the program, in the order of the pipeline."""
    from mrpipe.stages.registry import all_stages

    families: set[str] = set()
    for name, stage in all_stages().items():
        if not stage.family:
            command = _WITH_OPTIONS[name] if name in _WITH_OPTIONS else _plain_command(name)
            app.command(name=name, help=stage.summary)(command)
        elif stage.family in _FAMILIES and stage.family not in families:
            families.add(stage.family)
            app.command(name=stage.family)(_FAMILIES[stage.family])
