"""docs/effects.md is what the effects say of themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.effects.document import as_markdown
from mrpipe.effects.library import damper_effects
from mrpipe.effects.structural.library import all_structural_effects

pytestmark = pytest.mark.property

PAGE = Path(__file__).resolve().parents[2] / "docs" / "effects.md"


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == as_markdown(), "python -m mrpipe.effects.document > docs/effects.md"


def test_every_effect_says_what_its_residual_looks_like() -> None:
    effects = {**damper_effects(), **all_structural_effects()}
    assert [name for name, effect in effects.items() if len(effect.residual) < 20] == []
