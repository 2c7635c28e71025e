"""What the report says of the order of the laws does not contradict itself."""

from __future__ import annotations

from typing import Any

import pytest

from mrpipe.reporting.closed_loop_words import controller_in_words, ranking_in_words


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


@pytest.mark.property
def test_laws_that_hardly_differ_may_change_places() -> None:
    found = _found(changes=False, before=True, after=True)
    assert "count as equal" not in ranking_in_words(found)
    found["ranking"]["before"] = ["vdns", "vd"]
    assert "vd, vdns (the best first; laws whose responses hardly differ count as equal)" in ranking_in_words(found)


def _controller(renewed: dict[str, str], inverse: str) -> dict[str, Any]:
    forces = {f"{name}_force_{when}_n": 18.0 for name in ("switch", "residual") for when in ("before", "after")}
    rows = [
        {"law": law, "after": {"peak_rms_x_top_m": 1.0}, "recalibrated": {"peak_rms_x_top_m": 0.9 if parts else 1.0}}
        for law, parts in ((law, renewed[law] != "nothing") for law in renewed)
    ]
    controller = {"gain_factors": {"vd": 0.9, "fdns": 1.0}, "renewed": renewed, "inverse": inverse, **forces}
    return {"controller": controller, "over_band": {"laws": rows}}


@pytest.mark.property
def test_changes_that_no_law_takes_are_called_tried() -> None:
    """Gains that were computed and not used must not read as if they were used."""
    nothing = {"vd": "nothing", "fdns": "nothing"}
    text = controller_in_words(_controller(nothing, "retrained on the damper with its effects"))
    assert "three changes were tried" in text and "an inverse retrained on the damper with its effects" in text
    assert "None of them lowers the simulated response of a law, so every law keeps its controller" in text
    assert "uses" not in text and "no law by more than" not in text


@pytest.mark.property
def test_changes_that_some_laws_take_are_said_with_the_laws() -> None:
    text = controller_in_words(_controller({"vd": "inverse, switch", "fdns": "nothing"}, "kept: the better of both"))
    assert "a retrained inverse, which is no better than the present one and is not used;" in text
    assert "gains vd x 0.90" in text
    assert "only if its simulated response falls: inverse, switch for vd. fdns keeps its controller." in text
    assert "largest RMS top displacement: vd -10 %" in text
