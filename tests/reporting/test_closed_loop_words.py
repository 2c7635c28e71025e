"""What the report says of the order of the laws does not contradict itself."""

from __future__ import annotations

from typing import Any

import pytest

from mrpipe.reporting.closed_loop_words import ranking_in_words


def _found(*, changes: bool, before: bool, after: bool) -> dict[str, Any]:
    return {
        "plant": {"effects": ["backlash"]},
        "ranking": {"after": ["vd", "vdns"]},
        "over_band": {"band_rad_s": [5.0, 12.0], "base_amplitude_m_s2": 0.8},
        "ranking_changes": changes,
        "reversed_pairs": [["vdns", "vd"]] if changes else [],
        "recorded_ranking": {"measured": ["vdns", "vd"]},
        "ranking_agrees_with_measured": {"before": before, "after": after},
    }


@pytest.mark.property
def test_an_order_that_changes_under_the_recorded_motions_alone_is_said() -> None:
    text = ranking_in_words(_found(changes=False, before=False, after=True))
    assert "does not change the ranking of the laws by the largest RMS top displacement from 5 to 12 rad/s" in text
    assert "the model agrees with it only after." in text
    assert text.endswith("under these motions, unlike over the whole band, the effect changes the predicted order.")
    for found in (_found(changes=True, before=False, after=True), _found(changes=False, before=True, after=True)):
        assert "unlike over the whole band" not in ranking_in_words(found)
