"""The chapters that settings may name are those that can be recomputed."""

from __future__ import annotations

from typing import get_args

import pytest
from pydantic import ValidationError

from mrpipe.thesis.collect import CHAPTERS
from mrpipe.thesis.options import ReproduceSettings

pytestmark = pytest.mark.property


def test_settings_and_program_know_the_same_chapters() -> None:
    chapter = get_args(ReproduceSettings.model_fields["chapters"].annotation)[0]
    assert get_args(chapter) == CHAPTERS == ReproduceSettings().chapters


@pytest.mark.parametrize("chapters", [(), (1,), (2, 7)])
def test_other_chapters_are_refused(chapters: tuple[int, ...]) -> None:
    with pytest.raises(ValidationError):
        ReproduceSettings(chapters=chapters)
