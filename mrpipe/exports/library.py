"""Find the formats of `exports/formats` and write the folder of a model."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import mrpipe.exports.formats
from mrpipe.artifacts import atomic_path
from mrpipe.errors import UserError, install_extra
from mrpipe.exports.contract import ExportFormat, Subject

LOADS_FROM = ("mrpipe.exports.formats",)
"""Packages whose modules are found at run time: they belong to the code version of a stage."""

_FILES = "Files of this export: "
"""Start of the line of README.md that lists the files."""


@cache
def formats_of(kind: str) -> dict[str, ExportFormat]:
    """Return name -> format of one kind of model."""
    names = sorted(item.name for item in pkgutil.iter_modules(mrpipe.exports.formats.__path__))
    found = (
        importlib.import_module(f"mrpipe.exports.formats.{name}").FORMAT
        for name in names
        if name.startswith(f"{kind}_")
    )
    return {item.name: item for item in found}


def chosen_formats(kind: str, names: Iterable[str]) -> list[ExportFormat]:
    """Return the formats that a user named; without names, all formats whose packages are installed.

    Raises
    ------
    UserError
        If the kind of model has no such format, or the package that the format needs is not installed.
    """
    known = formats_of(kind)
    named = list(dict.fromkeys(names))
    if not named:
        return [item for item in known.values() if not item.needs or importlib.util.find_spec(item.needs)]
    for name in named:
        if name not in known:
            raise UserError("--format", name, f"is not a format of a {kind}", f"one of {', '.join(known)}")
        needs = known[name].needs
        if needs and not importlib.util.find_spec(needs):
            raise UserError("--format", name, f"needs the package {needs}", install_extra(name))
    return [known[name] for name in named]


def write_export(subject: Subject, folder: Path, names: Iterable[str] = ()) -> list[str]:
    """Write a model, its test vectors and a README; return the names of the files.

    Files of an earlier export that this one does not write are removed, because they may hold another model.

    Parameters
    ----------
    subject
        The model.
    folder
        Folder of the files, made if missing.
    names
        Formats; none: all that are possible.

    Raises
    ------
    UserError
        See :func:`chosen_formats`; or if a step of a damper cannot be translated.
    """
    chosen = chosen_formats(subject.kind, names)
    files: dict[str, str | bytes] = {}
    for item in chosen:
        files.update(item.files(subject))
    files["vectors.csv"] = subject.vectors.as_csv()
    files["README.md"] = _readme(subject, chosen, [*files, "README.md"])
    outdated = _files_of(folder) - set(files)
    for name, content in files.items():
        with atomic_path(folder / name) as temporary:
            temporary.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
    for name in outdated:
        (folder / name).unlink(missing_ok=True)
    return list(files)


def _files_of(folder: Path) -> set[str]:
    """Return the files that an earlier export wrote into a folder, as its README lists them; other files are kept."""
    readme = folder / "README.md"
    text = readme.read_text(encoding="utf-8", errors="replace") if readme.is_file() else ""
    line = next((line for line in text.splitlines() if line.startswith(_FILES)), "")
    return {name for name in re.findall(r"`([^`]+)`", line) if Path(name).name == name}


def _readme(subject: Subject, chosen: Iterable[ExportFormat], files: Iterable[str]) -> str:
    vectors = subject.vectors
    inputs = ", ".join(f"`{item.name}` [{item.unit}]" for item in vectors.inputs)
    outputs = ", ".join(f"`{item.name}` [{item.unit}]" for item in vectors.outputs)
    interval = f", {vectors.sample_time_s:g} s apart" if vectors.sample_time_s else ""
    parts = [
        f"# Exported {subject.kind}: {subject.name}",
        *([subject.about] if subject.about else []),
        f"Inputs: {inputs}.\n\nOutputs: {outputs}.",
        f"`vectors.csv` holds {len(vectors.inputs[0].values)} rows of inputs{interval}, and the outputs that mrpipe "
        "computes from them. In double precision every format reproduces the outputs to 1e-9 of their largest "
        "magnitude.",
        f"{_FILES}{', '.join(f'`{name}`' for name in files)}.",
    ]
    if subject.left_out:
        parts.append("## Not contained\n\n" + "\n".join(f"- {sentence}." for sentence in subject.left_out))
    parts += [
        item.usage.format(name=subject.name, prefix=subject.prefix, upper=subject.prefix.upper()) for item in chosen
    ]
    return "\n\n".join(parts) + "\n"
