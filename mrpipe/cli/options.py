"""Options that all commands share, put on a command by a decorator."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from mrpipe.errors import UserError
from mrpipe.words import shell_word


@dataclass(frozen=True)
class CommonOptions:
    """Values of the common options as the user gave them; None where an option was not given."""

    config: Path | None = None
    run: Path | None = None
    overrides: list[str] = field(default_factory=list)
    settings: list[Path] = field(default_factory=list)
    campaign: Path | None = None
    jobs: int | None = None
    seed: int | None = None
    force: bool = False
    quiet: bool = False
    json: bool = False

    def changes_in_words(self) -> list[str]:
        """Return campaign, changed settings and seed as words of a command that can be copied into a shell."""
        words: list[str | Path | int] = ["--campaign", self.campaign] if self.campaign else []
        words += [word for file in self.settings for word in ("--settings", file)]
        words += [word for change in self.overrides for word in ("--set", change)]
        words += ["--seed", self.seed] if self.seed is not None else []
        return [shell_word(str(word)) for word in words]


_RUN = "Run directory. Default: runs/NAME, with the name of the configuration, or of the campaign of --campaign."
_RUN_OF = {
    frozenset({"campaign"}): "Run directory. Default: runs/NAME, with the name of the configuration.",
    frozenset({"campaign", "config"}): "Run directory. Default: runs/demo.",
}
"""Options that a command does not have -> help of --run, which otherwise names them."""

_COMMON: dict[str, tuple[Any, Any]] = {
    "config": (
        Annotated[
            Path | None,
            typer.Option(
                metavar="FILE",
                help="Configuration file, or the name of a configuration that comes with the program. The word "
                "--config may be left out. Default: the one in ./configs, else thesis.",
            ),
        ],
        None,
    ),
    "run": (
        Annotated[
            Path | None,
            typer.Option(
                metavar="DIR",
                help=_RUN,
            ),
        ],
        None,
    ),
    "overrides": (
        Annotated[
            list[str] | None,
            typer.Option("--set", metavar="SECTION.KEY=VALUE", help="Change one setting. May be given several times."),
        ],
        None,
    ),
    "settings": (
        Annotated[
            list[Path] | None,
            typer.Option(
                metavar="FILE",
                help="YAML file with settings that replace those of the configuration, for example next-tests.yaml or "
                "corrections.yaml, which close-loop writes. May be given several times.",
            ),
        ],
        None,
    ),
    "campaign": (
        Annotated[
            Path | None,
            typer.Option(metavar="DIR", help="Measured campaign: directory with campaign.yaml, or a campaign file."),
        ],
        None,
    ),
    "jobs": (
        Annotated[
            int | None,
            typer.Option(min=1, metavar="N", help="Number of processes that a stage may use. Default: one per core."),
        ],
        None,
    ),
    "seed": (Annotated[int | None, typer.Option(min=0, metavar="N", help="Seed of all random numbers.")], None),
    "force": (
        Annotated[bool, typer.Option("--force", help="Build the requested stages again, also if nothing has changed.")],
        False,
    ),
    "quiet": (Annotated[bool, typer.Option("--quiet", help="Print only errors and the result.")], False),
    "json": (
        Annotated[
            bool, typer.Option("--json", help="Print one JSON document on standard output, and nothing else there.")
        ],
        False,
    ),
}


_POSITIONAL = Annotated[
    Path | None, typer.Argument(metavar="CONFIG", help="Configuration; the same as --config FILE.", show_default=False)
]

_CONFIGURATIONS = {".yaml", ".yml"}
"""Endings of configuration files."""


def one_config(named: Path | None, positional: Path | None) -> Path | None:
    """Return the configuration that was given with or without `--config`.

    Raises
    ------
    UserError
        If two different ones were given, or the file is a campaign or no YAML file.
    """
    from mrpipe.campaigns.model import CAMPAIGN_FILE

    if named is not None and positional is not None and named != positional:
        raise UserError("--config", str(named), f"and {positional} are two configurations", "give one of them")
    chosen = named or positional
    if chosen is not None and (chosen.name == CAMPAIGN_FILE or (chosen / CAMPAIGN_FILE).is_file()):
        folder = chosen.parent if chosen.name == CAMPAIGN_FILE else chosen
        raise UserError(chosen, "", "is a campaign and not a configuration", f"use --campaign {folder}")
    if chosen is not None and chosen.is_file() and chosen.suffix.lower() not in _CONFIGURATIONS:
        problem = "is not a configuration, because it does not end in .yaml"
        raise UserError(chosen, "", problem, "name a YAML file, such as configs/my-rig.yaml")
    return chosen


def _run_option(left_out: Collection[str]) -> Any:
    """Return the option --run, whose help names no option that the command does not have."""
    text = _RUN_OF.get(frozenset({"campaign", "config"} & set(left_out)), _RUN)
    return Annotated[Path | None, typer.Option(metavar="DIR", help=text)]


def with_common_options(*left_out: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the common options (but those left out); it gets them as one `options` argument.

    The configuration can be given as `--config FILE` and, unless `positional` is left out, as the last argument.
    """

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(function, eval_str=True)
        parameters = [item for name, item in own.parameters.items() if name != "options"]
        positional = not {"config", "positional"} & set(left_out)
        if positional:
            parameters.append(
                inspect.Parameter("config_file", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=_POSITIONAL)
            )
        for name, (annotation, default) in _COMMON.items():
            if name not in left_out:
                annotation = _run_option(left_out) if name == "run" else annotation
                parameters.append(
                    inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
                )

        @functools.wraps(function)
        def command(**values: Any) -> None:
            common = {name: values.pop(name) for name in _COMMON if name not in left_out}
            if "config" in common:
                common["config"] = one_config(common["config"], values.pop("config_file", None))
            common["overrides"] = common.get("overrides") or []
            common["settings"] = common.get("settings") or []
            function(options=CommonOptions(**common), **values)

        signature = own.replace(parameters=sorted(parameters, key=lambda item: item.kind))
        command.__signature__ = signature  # type: ignore[attr-defined]
        command.__annotations__ = {item.name: item.annotation for item in signature.parameters.values()}
        del command.__wrapped__
        return command

    return decorate
