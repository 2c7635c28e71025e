"""The sentences on what an export does not contain."""

from __future__ import annotations

import pytest

from mrpipe.exports.left_out import effects_left_out

pytestmark = pytest.mark.property

EFFECTS = {
    "effects": [
        {"name": "impact", "place": "floor 3", "corrected_in": "structure"},
        {"name": "joint-friction", "place": "every storey", "corrected_in": "structure"},
        {"name": "controller-delay", "place": "controller", "corrected_in": "controller"},
    ]
}


def test_effects_of_the_place_are_named_together() -> None:
    (sentence,) = effects_left_out(EFFECTS, "structure", "add them")
    assert sentence == (
        "close-loop found impact (floor 3) and joint-friction (every storey), which this export does not contain: "
        "add them"
    )


@pytest.mark.parametrize("summary", [{}, {"effects": []}, EFFECTS])
def test_nothing_to_say_without_effects_of_the_place(summary: dict) -> None:
    assert effects_left_out(summary, "plant", "add them") == []
