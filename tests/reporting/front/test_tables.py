"""Tables of the report: units that people use, and no interval where there is none."""

from __future__ import annotations

import pytest

from mrpipe.reporting.front.tables import effects, parameters, rivals, wanted_tests
from mrpipe.reporting.traced_words import determined, not_alone_in_words, shown_candidates

pytestmark = pytest.mark.property


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (9.0, 9.2, True),
        (-1.0, 2.0, True),
        (0.01, 0.9, True),
        (1e-12, 9e11, False),
        (-9e11, -1e-12, False),
        (float("nan"), 1.0, False),
        (0.5, float("inf"), False),
    ],
)
def test_an_interval_over_decades_determines_nothing(low: float, high: float, expected: bool) -> None:
    assert determined(low, high) is expected
    effect = {
        "name": "remanence",
        "confidence": 0.9,
        "parameters": {"slip_length": {"value": 1.0, "unit": "m", "interval": [low, high]}},
    }
    assert (effects([effect])["from"][0] == "not determined") is not expected


@pytest.mark.parametrize("unit", ["A", "V"])
def test_the_drive_of_tests_to_be_made_is_in_the_unit_of_the_campaign(unit: str) -> None:
    frame = wanted_tests([{"name": "a", {"A": "current_a", "V": "drive_v"}[unit]: 1.5}])
    assert frame[f"largest drive [{unit}]"].tolist() == ["1.50"]


def test_tests_to_be_made_are_in_practical_units() -> None:
    frame = wanted_tests(
        [{"name": "a", "amplitude_m": 0.0083, "later": True, "current": "steps", "rounds": 3}, {"name": "b"}]
    )
    assert list(frame.columns) == ["test", "amplitude [mm]", "drive", "rounds"]
    assert frame["amplitude [mm]"].tolist() == ["8.30", "-"]


@pytest.mark.parametrize("taken", ["bouc-wen", "dahl-stiffness"])
def test_the_share_of_a_candidate_does_not_count_an_exchanged_base_form(taken: str) -> None:
    loop = {
        "base_form": {"declared": "bouc-wen", "taken": taken},
        "candidates": [
            {"name": "stribeck", "share": 0.998, "nrmse": 0.049, "forms": {"gaussian": 0.02, "rational": 0.1}},
            {"name": "accumulator", "share": 0.997, "nrmse": 0.008, "forms": {"linear": 0.95}},
        ],
    }
    shares = [item["share"] for item in shown_candidates(loop)]
    assert shares == ([0.998, 0.997] if taken == "bouc-wen" else [0.95, 0.1])
    table = rivals(loop)
    if taken == "bouc-wen":
        assert table["share of the recoverable residual [%]"].tolist() == ["99.8", "99.7"]
    else:
        heading = "share of what the base form dahl-stiffness leaves above the noise [%]"
        assert table["effect"].tolist() == ["accumulator", "stribeck"]
        assert table[heading].tolist() == ["95.0", "10.0"]


def test_a_named_effect_that_only_a_later_round_found_is_among_the_effects() -> None:
    tried = [{"name": f"effect {place}", "form": "f", "share": 0.9 - 0.1 * place, "nrmse": 0.01} for place in range(9)]
    loop = {
        "candidates": tried,
        "effects": [
            {"name": "effect 0", "form": "f"},
            {"name": "effect 8", "form": "f"},
            {"name": "channel-skew", "form": "shift"},
            {"name": "unattributed"},
        ],
    }
    table = rivals(loop)
    assert table["effect"].tolist() == [f"effect {place}" for place in range(9)] + ["channel-skew"]
    assert table["note"].tolist() == [""] * 9 + ["found in addition to effect 0 and effect 8"]
    assert table.iloc[-1, 1:4].tolist() == ["shift", "-", "-"]
    said = " channel-skew was found in addition to others and was not fitted alone."
    assert not_alone_in_words(loop) == said
    # without such an effect the table is as short as before
    loop["effects"] = loop["effects"][:1]
    assert "note" not in rivals(loop) and len(rivals(loop)) == 8 and not_alone_in_words(loop) == ""


@pytest.mark.golden
def test_an_interval_without_width_is_not_shown() -> None:
    slip = {"value": 7.7e-4, "unit": "m", "interval": [7.7e-4, 7.7e-4]}
    table = effects([{"name": "joint-friction", "parameters": {"slip": slip}, "confidence": 0.9}])
    assert table[["value", "from", "to"]].iloc[0].tolist() == ["0.000770", "-", ""]


@pytest.mark.golden
def test_a_column_of_notes_is_there_only_where_there_is_a_note() -> None:
    free = {"eta": {"value": 96.7, "standard_error": 0.5, "unit": "1/s"}}
    assert "note" not in parameters(free)
    bound = {"eta": {**free["eta"], "at_bound": True}}
    assert list(parameters(bound)["note"]) == ["at its bound"]
    assert parameters({}).empty
