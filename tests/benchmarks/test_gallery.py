"""The page of the gallery shows the results that are kept, and every picture exists."""

from __future__ import annotations

import json
import re

import pytest

from benchmarks.gallery import DAMPERS, DOCS, page

README = (DOCS.parent / "README.md").read_text(encoding="utf-8")


@pytest.mark.golden
def test_page_is_written_from_the_results() -> None:
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    assert text == page()
    pictures = re.findall(r"\(images/([^)]+)\)", text)
    assert len(pictures) == len(DAMPERS) and all((DOCS / "images" / name).is_file() for name in pictures)


@pytest.mark.golden
@pytest.mark.parametrize("name", DAMPERS)
def test_readme_shows_the_same_results(name: str) -> None:
    kept = json.loads((DOCS / "gallery" / f"{name}.json").read_text(encoding="utf-8"))
    (row,) = re.findall(rf"^\| {name}: .*$", README, re.MULTILINE)
    assert row.split("|")[-2].strip() == f"{kept['after_nrmse']:.3f}"
    (text,) = re.findall(rf"^- \*{name}\*: (.*?)(?=^- |^$)", README, re.MULTILINE | re.DOTALL)
    known = {item["name"]: item["confidence"] for item in kept["effects"]}
    for effect, confidence in re.findall(r"`([a-z-]+)`, confidence (\d\.\d+)", text):
        assert known[effect] == float(confidence)
    assert known or "no effect is named" in text
