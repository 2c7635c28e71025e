"""Every row of the list of errata is recomputed, and the verdicts are those that it gives."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.thesis import Claim, ReproduceSettings, cannot, collect_claims, compare, page


@pytest.fixture(scope="module")
def claims() -> list[Claim]:
    return collect_claims(ReproduceSettings(duration_s=40.0))


def by_id(claims: list[Claim]) -> dict[str, Claim]:
    return {claim.id: claim for claim in claims}


@pytest.mark.literature
def test_every_row_of_the_errata_is_there_once(claims: list[Claim]) -> None:
    names = [claim.id for claim in claims]
    assert len(names) == len(set(names))
    rows = {int(match.group(1)) for name in names if (match := re.match(r"A(\d+)", name))}
    assert rows == set(range(1, 23))
    assert {claim.chapter for claim in claims} == {2, 3, 4, 5, 6}


@pytest.mark.literature
def test_what_can_be_asserted_holds(claims: list[Claim]) -> None:
    known = by_id(claims)
    asserted = ["B1", "B2", "B3", "B4", "B5", "B6", "B7", "B8", "B9", "B10", "A9d", "A10b", "A11a", "A11b", "A11c"]
    asserted += ["A11d", "A11e", "B11", "B12", "B13", "B14", "B15", "C0", "C1", "C2", "C3", "C4", "A3c", "A4c", "A8b"]
    asserted += [f"B-ideal-{law}" for law in ("vd", "vdps", "vdns", "fdns")]
    asserted += [f"B-ideal-{law}-a1" for law in ("vd", "vdps", "vdns")]
    asserted += [f"B-set-c-{law}" for law in ("vd", "vdps", "vdns", "fdns")]
    assert {name: known[name].why for name in asserted if known[name].verdict != "holds"} == {}


@pytest.mark.literature
def test_what_the_errata_refute_differs_and_says_why(claims: list[Claim]) -> None:
    known = by_id(claims)
    refuted = ["A1a", "A1b", "A2", "A3a", "A4a", "A4b", "A5a", "A5b", "A6", "A7a", "A8a", "A9a", "A9b", "A9c", "A10a"]
    refuted += ["A12a", "A12b", "A12e", "A13a", "A14a", "A16a", "A16d", "A17", "A18a"]
    assert [name for name in refuted if known[name].verdict != "differs"] == []
    assert [claim.id for claim in claims if claim.verdict != "holds" and not claim.why] == []


@pytest.mark.real
@pytest.mark.literature
def test_rows_that_need_public_matrices(claims: list[Claim], public_data: Path) -> None:
    known = by_id(claims)
    assert known["A19"].recomputed == pytest.approx([0.01] * 5, rel=1e-3)
    assert max(known["A20a"].recomputed) < 0.1
    assert known["A20b"].recomputed < 0.005


@pytest.mark.property
def test_a_verdict_follows_the_tolerance() -> None:
    assert compare("x", 2, "", 1.0, 1.01, 0.02).verdict == "holds"
    assert compare("x", 2, "", 1.0, 1.03, 0.02).verdict == "differs"
    assert compare("x", 2, "", [1.0, 2.0], [1.0], 0.5).verdict == "differs"
    assert compare("x", 2, "", 1.0, np.nan, 0.5).verdict == "differs"
    assert compare("x", 2, "", "A", "V", None).verdict == "differs"
    assert "3 %" in compare("x", 2, "", 1.0, 1.03, 0.02).why


@pytest.mark.property
def test_page_json_and_figure_hold_every_claim(claims: list[Claim]) -> None:
    text = page.markdown(claims)
    for claim in claims:
        assert f"| {claim.id} |" in text
    again = json.loads(json.dumps([claim.as_dict() for claim in claims], allow_nan=False))
    assert set(again[0]) == {"id", "chapter", "what", "printed", "recomputed", "tolerance", "verdict", "why"}
    assert sum(page.counts(claims).values()) == len(claims)
    assert len(page.deviation_figure(claims).axes) == 1


@pytest.mark.property
def test_chapters_and_frame_are_followed() -> None:
    third = collect_claims(ReproduceSettings(chapters=(3,), frame="geometry"))
    assert {claim.chapter for claim in third} == {3}
    # the frame by its dimensions has another stiffness than the printed one
    assert by_id(third)["B3"].verdict == "differs"
    with pytest.raises(UserError, match="no such parameter set"):
        collect_claims(ReproduceSettings(chapters=(3,), frame="thesys"))


@pytest.mark.property
def test_what_cannot_be_recomputed_has_no_value() -> None:
    claim = cannot("x", 6, "", [1.0], "not published")
    assert claim.recomputed is None
    assert page.shown(claim.recomputed) == "-"
