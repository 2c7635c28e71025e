"""Every command line that the documentation shows is understood by the program."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer

from mrpipe.cli.app import app
from mrpipe.config.loader import load_config
from mrpipe.control.laws import law_names
from tests.docs.shown import ROOT, Shown, pages, shown

CALLS = [call for page in pages() for call in shown(page)]
PLACES = {"DIR", "FOLDER", "CONFIG", "RUN", "LAW", "NAME", "FILE", "WHAT"}
"""Words of the documentation in whose place the user puts something."""


def _place(word: str) -> bool:
    return word in PLACES or "$" in word or any(part in PLACES for part in re.split(r"[/.]", word))


def _rows() -> list[Shown]:
    return list({call.words: call for call in CALLS}.values())


@pytest.mark.property
def test_the_pages_show_commands() -> None:
    assert len(CALLS) > 80
    assert {"README.md", "docs/cluster.md", "docs/export.md", "docs/compare.md"} <= {call.page for call in CALLS}


@pytest.mark.property
@pytest.mark.parametrize("call", _rows(), ids=str)
def test_arguments_and_options_exist(call: Shown) -> None:
    group = typer.main.get_command(app)
    name, *arguments = call.words
    if name == "--version":
        assert not arguments
        return
    with group.make_context("mrpipe", [name]) as top:
        command = group.get_command(top, name)  # type: ignore[attr-defined]
        assert command is not None, f"no command {name}"
        # the name alone within a sentence, or with a word for what belongs there, is not a call
        numbers = ["7" if "$" in word and before in {"--seed", "--jobs"} else word
                   for before, word in zip(["", *arguments], arguments, strict=False)]  # fmt: skip
        missing = [item.name for item in command.params if item.required and item.param_type_name == "argument"]
        if not arguments and missing:
            return
        values = command.make_context(name, numbers, parent=top).params
    for setting in values.get("overrides") or []:
        load_config(Path("thesis"), [re.sub(r"=\[docs/", f"=[{ROOT}/docs/", setting)])
    named = [value for value in (values.get("config"), values.get("config_file")) if value is not None]
    for value in named:
        if not _place(str(value)) and str(value) not in OWN_PROJECTS and value.name != "campaign.yaml":
            load_config(Path(value))
    law = values.get("law")
    assert law is None or _place(str(law)) or set([law] if isinstance(law, str) else law) <= set(law_names())


OWN_PROJECTS = {"configs/my-rig.yaml", "configs/my-damper.yaml", "configs/my-tower.yaml"}
"""Configurations of the projects that the tutorials and the README make."""
