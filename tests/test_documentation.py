"""The pages of the documentation name everything that they promise to explain."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mrpipe.control.laws import law_names
from mrpipe.stages.registry import all_stages

pytestmark = pytest.mark.property

DOCS = Path(__file__).resolve().parents[1] / "docs"
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


def test_no_link_between_pages_is_dead() -> None:
    dead = []
    for page in DOCS.glob("*.md"):
        for target in re.findall(r"\]\((?!https?:)([^)#\s]+)", page.read_text(encoding="utf-8")):
            if not (page.parent / target).exists():
                dead.append(f"{page.name}: {target}")
    assert dead == []


def test_packages_and_files_that_the_architecture_names_exist() -> None:
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    root = DOCS.parent
    names = re.findall(r"`((?:mrpipe/)?(?:\w+/)+\w*(?:\.py)?)`", text)
    missing = [name for name in names if not (root / name).exists() and not (root / "mrpipe" / name).exists()]
    assert [name for name in missing if "<" not in name] == []


def test_every_stage_has_a_settings_section_that_it_names() -> None:
    assert all(stage.settings for stage in all_stages().values())
