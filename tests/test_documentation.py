"""The pages of the documentation name everything that they promise to explain."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from mrpipe.campaigns.schema import (
    BENCH_QUANTITIES,
    FRAME_QUANTITIES,
    CampaignEntry,
    ChannelEntry,
    FrameEntry,
    TestEntry,
    TextEntry,
    quantity_of,
)
from mrpipe.config.sections.simulate import SimulateSettings
from mrpipe.control.laws import law_names
from mrpipe.stages.registry import all_stages
from mrpipe.structures.options import StructureSettings

pytestmark = pytest.mark.property

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
CLASSES = ("noise", "explained", "partly explained", "unknown", "base form", "validation differs")


def test_glossary_explains_every_law_and_class_of_verdict() -> None:
    text = (DOCS / "glossary.md").read_text(encoding="utf-8")
    assert [law for law in law_names() if f"| {law} |" not in text] == []
    assert [name for name in CLASSES if f"| `{name}` |" not in text] == []


def test_page_on_the_json_names_every_key_of_the_example() -> None:
    text = (DOCS / "close-loop-json.md").read_text(encoding="utf-8")
    example, table = text.split("## Keys")
    keys = set(re.findall(r'^ ?\{?"(\w+)":', example, re.MULTILINE))
    assert len(keys) > 10
    assert [key for key in keys if f"`{key}" not in table] == []


@pytest.mark.parametrize(
    "page",
    [*sorted(DOCS.glob("*.md")), *sorted(DOCS.rglob("*.ipynb")), *sorted(ROOT.glob("*.md"))],
    ids=lambda page: page.name,
)
def test_no_relative_link_is_dead(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:|#|data:)([^)#\s]+)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_navigation_of_the_site_lists_every_page_once() -> None:
    site = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    pages = [*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")]
    assert sorted(_pages(site["nav"])) == sorted(page.relative_to(DOCS).as_posix() for page in pages)


def _pages(entry: Any) -> list[str]:
    """Return the pages of an entry of the navigation: a page, a list of entries, or a mapping of titles to entries."""
    if isinstance(entry, str):
        return [entry]
    return [page for item in (entry.values() if isinstance(entry, dict) else entry) for page in _pages(item)]


def test_site_builds_without_warnings(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="needs the extra docs")
    for package in ("material", "mkdocstrings", "mkdocs_jupyter"):
        pytest.importorskip(package, reason="needs the extra docs")
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(ROOT / "mkdocs.yml")]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        [*build, "--site-dir", str(tmp_path / "site")], capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "site" / "tutorial-own-damper" / "index.html").is_file()
    assert "fit_damper" in (tmp_path / "site" / "api" / "index.html").read_text(encoding="utf-8")
    notebook = (tmp_path / "site" / "notebooks" / "tracing-and-loop" / "index.html").read_text(encoding="utf-8")
    assert "accumulator" in notebook and "data:image/png" in notebook


def test_page_on_the_command_line_is_current() -> None:
    from mrpipe.cli.document import as_markdown

    assert (DOCS / "command-line.md").read_text(encoding="utf-8") == as_markdown()


def test_reference_of_the_interface_names_the_modules_of_every_name() -> None:
    import mrpipe.api

    text = (DOCS / "api.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"^::: (\S+)$", text, re.MULTILINE))
    assert {getattr(mrpipe.api, name).__module__ for name in mrpipe.api.__all__} <= shown


@pytest.mark.parametrize("page", ["campaigns.md", "frame-identification.md"])
def test_example_campaigns_use_keys_that_exist(page: str) -> None:
    blocks = re.findall(r"^```yaml\n(.*?)^```", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert blocks
    for content in map(yaml.safe_load, blocks):
        entry = CampaignEntry(**{"campaign": "example", "rig": "shear-frame", **content})
        tests = [TestEntry(**test) for test in entry.tests]
        named = [*entry.channels.items(), *(item for test in tests for item in test.channels.items())]
        assert [name for name, _ in named if quantity_of(name, entry.rig) is None] == []
        assert all(ChannelEntry(**channel) for _, channel in named)


def test_example_structures_use_settings_that_exist() -> None:
    text = (DOCS / "structures.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert blocks
    for content in map(yaml.safe_load, blocks):
        assert content.keys() <= {"structure", "simulate"}
        settings = StructureSettings(**content["structure"])
        # an example with a motion of the ground shows the directions alone, the matrices are those of another example
        assert settings.given or "simulate" in content
        if "simulate" in content:
            SimulateSettings(**content["simulate"])


def test_page_on_campaigns_names_every_key() -> None:
    text = (DOCS / "campaigns.md").read_text(encoding="utf-8")
    models = (ChannelEntry, FrameEntry, TextEntry, TestEntry, CampaignEntry)
    keys = {key for model in models for key in model.model_fields}
    channels = {*BENCH_QUANTITIES, *FRAME_QUANTITIES}
    assert sorted(key for key in keys | channels if not re.search(rf"\b{key}\b", text)) == []


def test_readme_links_every_page_of_the_documentation() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    pages = {page.name for page in DOCS.glob("*.md")} - {"index.md"}  # the start page repeats the README
    assert sorted(page for page in pages if f"](docs/{page})" not in text) == []


def test_packages_and_files_that_the_architecture_names_exist() -> None:
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    root = DOCS.parent
    names = re.findall(r"`((?:mrpipe/)?(?:\w+/)+\w*(?:\.py)?)`", text)
    missing = [name for name in names if not (root / name).exists() and not (root / "mrpipe" / name).exists()]
    assert [name for name in missing if "<" not in name] == []


def test_names_of_code_that_the_architecture_names_exist() -> None:
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    packages = {path.name for path in (ROOT / "mrpipe").iterdir() if (path / "__init__.py").is_file()}
    dotted = {name for name in re.findall(r"`(\w+(?:\.\w+)+)(?:\(.*?\))?`", text) if name.split(".")[0] in packages}
    assert len(dotted) >= 5
    assert sorted(name for name in dotted if not _exists(f"mrpipe.{name}")) == []
    plain = set(re.findall(r"`([A-Z]\w+)`", text)) - {"EFFECT", "FORM", "STAGE", "LOADS_FROM", "NUMBA_CACHE_DIR"}
    code = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "mrpipe").rglob("*.py"))
    assert sorted(name for name in plain if not re.search(rf"\b{name}\b", code)) == []


def _exists(dotted: str) -> bool:
    """Return whether a name leads to a module or to an attribute of one."""
    parts = dotted.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for part in parts[count:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


def test_walks_of_the_architecture_are_there() -> None:
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    walks = re.findall(r"^\*\*(.+?)\.\*\*(.*?)(?=^\*\*|^## )", text, re.MULTILINE | re.DOTALL)
    named = {title: len(re.findall(r"`[^`]+`", body)) for title, body in walks}
    assert {"A campaign", "A damper", "An effect", "A stiffness matrix"} <= set(named)
    assert min(named.values()) >= 3


def _anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as MkDocs and GitHub write them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = (re.sub(r"\[(.*?)\]\(.*?\)|[`*]", r"\1", line) for line in re.findall(r"^#+ (.*)$", text, re.MULTILINE))
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", heading.lower()).strip()) for heading in headings}


@pytest.mark.parametrize("page", [*sorted(DOCS.glob("*.md")), *sorted(ROOT.glob("*.md"))], ids=lambda page: page.name)
def test_no_anchor_is_dead(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:|data:)([^)#\s]*)#([^)\s]+)\)", page.read_text(encoding="utf-8"))
    dead = [
        f"{file}#{anchor}" for file, anchor in links if anchor not in _anchors(page.parent / file if file else page)
    ]
    assert dead == []


def test_every_stage_has_a_settings_section_that_it_names() -> None:
    assert all(stage.settings for stage in all_stages().values())
