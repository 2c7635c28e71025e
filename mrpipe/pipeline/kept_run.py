"""Reading of a run directory for the comparison with another run."""

from __future__ import annotations

from pathlib import Path

from mrpipe.artifacts.yaml_source import read_yaml
from mrpipe.errors import UserError
from mrpipe.pipeline.fingerprint import flatten
from mrpipe.pipeline.manifest import Manifest
from mrpipe.pipeline.sources import ABSENT
from mrpipe.reporting.compare import KeptRun, KeptStage

_REMEDY = "name a directory that `mrpipe run` wrote, such as runs/my-rig"


def read_run(directory: Path) -> KeptRun:
    """Read the resolved configuration and the manifests of a run; no artifact is opened.

    Raises
    ------
    UserError
        If the directory is missing or is not a run directory, or if its configuration is not valid YAML.
    """
    if not directory.is_dir():
        problem = "is a file and no run directory" if directory.exists() else "no such run directory"
        raise UserError(directory, "", problem, _REMEDY)
    files = sorted(path for path in (directory / "manifests").glob("*.json") if not path.name.startswith("."))
    if not files or not (directory / "config.yaml").is_file():
        missing = "config.yaml" if files else "manifests of stages"
        raise UserError(directory, "", f"is not a run directory, because it has no {missing}", _REMEDY)
    content = read_yaml(directory / "config.yaml").content
    listed = [str(name) for name in content.get("stages") or []]
    names = sorted((path.stem for path in files), key=lambda name: (_place(name, listed), name))
    return KeptRun(directory, flatten(content), {name: _stage(directory / "manifests", name) for name in names})


def require_two_runs(first: Path, second: Path) -> None:
    """Check that two paths are different runs.

    Raises
    ------
    UserError
        If both paths name one directory.
    """
    if first.is_dir() and second.is_dir() and first.samefile(second):
        raise UserError(second, "", f"is the same directory as {first}", "name two different runs")


def _place(name: str, listed: list[str]) -> int:
    """Return the place of a stage in the configuration; recorders, which it need not list, come first."""
    return listed.index(name) if name in listed else -1 if name.startswith("record-") else len(listed)


def _stage(manifests: Path, name: str) -> KeptStage:
    manifest = Manifest.load(manifests, name)
    if manifest is None:
        return KeptStage(not_built=f"the manifest {name}.json is damaged")
    inputs = {item: None if digest == ABSENT else digest for item, digest in manifest.key.inputs.items()}
    settings = {**flatten(manifest.key.settings), "seed": manifest.key.seed} if manifest.key.settings else {}
    return KeptStage(inputs, settings, manifest.key.code, manifest.summary, manifest.skipped)
