"""No setting without a description, a reader and a use."""

from __future__ import annotations

import importlib
import pkgutil
import re
from pathlib import Path

import pytest

import mrpipe.stages
from mrpipe.config.model import config_model, options
from mrpipe.pipeline.stage import Stage
from mrpipe.stages.registry import all_stages

pytestmark = pytest.mark.property

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "mrpipe"
LEAVES = [name for name, _, default in options() if not hasattr(default, "model_dump")]
# read by the pipeline and the command line, not by a stage
OF_THE_PROGRAM = {"name", "description", "seed", "stages"}
SECTIONS_OF_THE_PROGRAM = {"campaigns", "execution", "report"}


def _source() -> str:
    """Return the source of the package without the declarations of the settings themselves."""
    declaration = re.compile(r"^    \w+: .*= Field\(", re.MULTILINE)
    return "\n".join(
        declaration.sub("", path.read_text(encoding="utf-8"))
        for path in PACKAGE.rglob("*.py")
        if path.parent != PACKAGE / "config" / "sections" and path != PACKAGE / "config" / "model.py"
    )


WORDS = set(re.findall(r"\b\w+\b", _source()))


def _variants() -> list[Stage]:
    """Return the stages that may take the place of another one."""
    names = [item.name for item in pkgutil.iter_modules(mrpipe.stages.__path__)]
    modules = [importlib.import_module(f"mrpipe.stages.{name}") for name in names]
    return [stage for module in modules for stage in getattr(module, "VARIANTS", ())]


def _read_by(name: str) -> list[str]:
    return [
        stage.name
        for stage in (*all_stages().values(), *_variants())
        if any(name == item or name.startswith((f"{item}.", f"{item}[")) for item in stage.settings)
    ]


def test_every_option_is_described() -> None:
    assert [name for name, text, _ in options() if len(text) < 10] == []


@pytest.mark.parametrize("name", LEAVES)
def test_every_option_is_read_and_used(name: str) -> None:
    section, _, key = name.partition(".")
    if name not in OF_THE_PROGRAM and section not in SECTIONS_OF_THE_PROGRAM:
        assert _read_by(name), f"no stage declares that it reads {name}"
    word = (key or name).rpartition(".")[2]
    assert word in WORDS or section == "campaigns", f"nothing uses {name}"


def test_stages_declare_settings_that_exist() -> None:
    known = {name for name, _, _ in options()}
    unknown = {(stage.name, item) for stage in all_stages().values() for item in stage.settings if item not in known}
    assert unknown == set()


def test_documentation_lists_every_option() -> None:
    """docs/configuration.md is written by `python -m mrpipe.config.document` and kept in the repository."""
    from mrpipe.config.document import as_markdown

    assert (ROOT / "docs" / "configuration.md").read_text(encoding="utf-8") == as_markdown()


def test_documentation_says_which_settings_are_required() -> None:
    text = (ROOT / "docs" / "configuration.md").read_text(encoding="utf-8")
    assert "| `design.motions[].file` | required |" in text
    assert "Undefined" not in text


def test_default_stages_exist() -> None:
    assert set(config_model()().stages) - {"report"} <= set(all_stages())
