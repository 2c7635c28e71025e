"""Reads a configuration: YAML with line numbers, overrides, validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from mrpipe.artifacts import config_directory
from mrpipe.artifacts.yaml_source import Place, YamlSource, closest, nearest, parse, read_yaml
from mrpipe.config.errors import explain, section_of
from mrpipe.config.model import RunSettings, config_model, options
from mrpipe.config.sections.campaigns import LABORATORY, CampaignsSettings
from mrpipe.errors import UserError


@dataclass(frozen=True)
class LoadedConfig:
    """A validated configuration and where it came from."""

    config: RunSettings
    path: Path
    overrides: tuple[str, ...] = ()

    def as_yaml(self) -> str:
        """Return the resolved configuration (every default written out) as YAML."""
        return yaml.safe_dump(self.config.model_dump(mode="json"), sort_keys=False, allow_unicode=True)


def default_config_path() -> Path:
    """Return the configuration of the project in the working directory, else the one that comes with the program.

    A project has its configurations in `configs/`. `configs/thesis.yaml` is taken where it is there; otherwise the only
    one is taken.

    Raises
    ------
    UserError
        If the project has several configurations, or none.
    """
    folder = Path("configs")
    here = folder / "thesis.yaml"
    if here.is_file():
        return here
    if not folder.is_dir():
        return config_directory() / "thesis.yaml"
    found = sorted(path for path in folder.iterdir() if path.suffix in {".yaml", ".yml"} and path.is_file())
    if len(found) == 1:
        return found[0]
    names = ", ".join(str(path) for path in found)
    if found:
        raise UserError(folder, "", f"holds {len(found)} configurations ({names})", "name one with --config")
    raise UserError(
        folder,
        "",
        "holds no configuration",
        "`mrpipe init DIR` makes a project, `mrpipe demo` needs none",
    )


def load_config(path: Path, overrides: Sequence[str] = (), overlays: Sequence[Path] = ()) -> LoadedConfig:
    """Read and validate a configuration.

    Parameters
    ----------
    path
        YAML file; a bare name such as `utfsm` means the file of that name that comes with the program.
    overrides
        `section.key=value`, the value in YAML; they count last.
    overlays
        YAML files with some settings, laid over the configuration one after another.

    Raises
    ------
    UserError
        If the file is missing, no YAML, has a key twice, an unknown key or a wrong value.
    """
    path = _locate(path)
    source = read_yaml(path)
    content = source.content
    content.setdefault("name", path.stem)
    laid = [(overlay, _read_overlay(overlay)) for overlay in overlays]
    for _, over in laid:
        _lay_over(content, over.content)
    for override in overrides:
        _apply(content, override)
    try:
        config = config_model().model_validate(content)
    except ValidationError as error:
        at = tuple(error.errors()[0]["loc"])
        if any(_override_path(item) == at[: len(_override_path(item))] for item in overrides):
            raise explain(error, config_model(), "--set", {}) from error
        # the file that has the most of the keys; of several, the one that counts last
        origin = max([*reversed(laid), (path, source)], key=lambda item: _known_depth(item[1].lines, at))
        raise explain(error, config_model(), origin[0], origin[1].lines) from error
    return LoadedConfig(_with_absolute_paths(config, path.resolve().parent), path.resolve(), tuple(overrides))


def _read_overlay(path: Path) -> YamlSource:
    if not path.is_file():
        raise UserError("--settings", str(path), "no such file", "name a YAML file with settings")
    return read_yaml(path)


def _lay_over(content: dict[str, Any], over: dict[str, Any]) -> None:
    """Put settings over those that are there, section by section; lists are replaced."""
    for key, value in over.items():
        there = content.get(key)
        if isinstance(there, dict) and isinstance(value, dict):
            _lay_over(there, value)
        else:
            content[key] = value


def _with_absolute_paths(config: RunSettings, base: Path) -> RunSettings:
    """Resolve paths of measurements and matrices against the folder of the configuration.

    A copy of the configuration in the run directory then names the same files.
    """
    resolved = {
        rig: source if source in (None, LABORATORY) else str((base / source).resolve())
        for rig, source in config.campaigns.model_dump().items()
    }
    changes: dict[str, Any] = {"campaigns": CampaignsSettings(**resolved)}
    structure = getattr(config, "structure", None)
    if structure is not None:
        changes["structure"] = structure.in_folder(base)
    return config.model_copy(update=changes)


def _locate(path: Path) -> Path:
    if path.is_file():
        return path
    named = config_directory() / f"{path.name.removesuffix('.yaml')}.yaml"
    if str(path) in {named.stem, f"configs/{named.name}"} and named.is_file():
        return named
    known = sorted(item.stem for item in config_directory().glob("*.yaml"))
    # configurations of the user: in the folder of the path, and those of a project in the working directory
    files = [item for folder in (path.parent, Path("configs")) for item in sorted(folder.glob("*.yaml"))]
    own = {item.stem: str(item) for item in files if item.stem not in known}
    meant = path.name.removesuffix(".yaml")
    likeliest = meant if meant in own else closest(meant, [*known, *own])
    every = f"give a YAML file, or one of {', '.join([*own.values(), *known])}"
    remedy = f"did you mean {own.get(likeliest, likeliest)}?" if likeliest else every
    raise UserError(path, "", "no such configuration", remedy)


def _known_depth(lines: Mapping[Place, int], place: Place) -> int:
    """Return the number of leading keys of a place that a file has; a number as a key is a text in `lines`."""
    for depth in range(len(place), 0, -1):
        if place[:depth] in lines or (*place[: depth - 1], str(place[depth - 1])) in lines:
            return depth
    return 0


def _override_path(override: str) -> tuple[str, ...]:
    return tuple(override.partition("=")[0].strip().split("."))


def _with_section(key: str) -> str:
    """Return a remedy that names the settings of this name within sections; empty without any."""
    found = [name for name, _, _ in options() if name.endswith(f".{key}") and "[]" not in name]
    if not found:
        return ""
    return f"did you mean {found[0]}?" if len(found) == 1 else f"name the section: {', '.join(found[:6])}"


def _apply(content: dict[str, Any], override: str) -> None:
    """Set one `section.key=value` in place."""
    keys, separator, text = override.partition("=")
    if not separator or not keys.strip():
        raise UserError("--set", override, "is not an assignment", "write section.key=value")
    path = _override_path(override)
    for depth, key in enumerate(path):
        section = section_of(config_model(), path[:depth])
        if section is None:
            break
        if key not in section.model_fields:
            remedy = _with_section(key) if depth == 0 else ""
            remedy = remedy or nearest(str(key), list(section.model_fields))
            raise UserError("--set", ".".join(map(str, path)), "unknown key", remedy)
    try:
        _, value = parse(text, "--set")
    except UserError as error:
        raise UserError("--set", override[:120], f"value: {error.problem}", "put it in quotes") from error
    target = content
    for key in path[:-1]:
        inner = target.setdefault(str(key), {})
        if not isinstance(inner, dict):
            inner = target[str(key)] = {}
        target = inner
    target[str(path[-1])] = value
