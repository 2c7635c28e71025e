"""The page of the gallery shows the results that are kept, and every picture exists."""

from __future__ import annotations

import re

import pytest

from benchmarks.gallery import DAMPERS, DOCS, page


@pytest.mark.golden
def test_page_is_written_from_the_results() -> None:
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    assert text == page()
    pictures = re.findall(r"\(images/([^)]+)\)", text)
    assert len(pictures) == len(DAMPERS) and all((DOCS / "images" / name).is_file() for name in pictures)
