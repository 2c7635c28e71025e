"""docs/base-forms.md is what the base forms say of themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.dampers.document import as_markdown
from mrpipe.dampers.library import base_forms

pytestmark = pytest.mark.property

PAGE = Path(__file__).resolve().parents[2] / "docs" / "base-forms.md"


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == as_markdown(), "python -m mrpipe.dampers.document > docs/base-forms.md"


def test_every_form_and_parameter_is_on_the_page() -> None:
    page = as_markdown()
    for form in base_forms().values():
        assert f"## {form.name}\n" in page
        assert form.source in page
        section = page.split(f"## {form.name}\n")[1].split("\n## ")[0]
        assert [item.name for item in form.parameters if f"`{item.name}`" not in section] == []
