"""What pydantic finds, as one line with file, line, key and the nearest known key."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mrpipe.config.errors import explain, model_in, section_of

pytestmark = pytest.mark.property


class _Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    cutoff_hz: float = Field(1.0, gt=0.0)
    order: int = 2


class _Outer(BaseModel):
    model_config = ConfigDict(extra="forbid")
    prepare: _Inner = _Inner()
    rows: tuple[_Inner, ...] = ()
    band: tuple[int, ...] | tuple[float, float] | None = None


LINES: dict[tuple[str | int, ...], int] = {("prepare",): 2, ("prepare", "cutoff_hz"): 3, ("rows",): 5}


def _explained(content: dict[str, Any]) -> str:
    with pytest.raises(ValidationError) as found:
        _Outer.model_validate(content)
    return str(explain(found.value, _Outer, "a.yaml", LINES))


def test_an_unknown_key_is_named_with_its_line_and_the_nearest_key() -> None:
    text = _explained({"prepare": {"cutof_hz": 3.0}})
    assert "a.yaml" in text and "line 2, prepare.cutof_hz" in text
    assert "unknown key" in text and "did you mean cutoff_hz" in text


def test_a_wrong_value_is_shown_with_what_would_be_right() -> None:
    text = _explained({"prepare": {"cutoff_hz": -3.0}})
    assert "line 3, prepare.cutoff_hz" in text and "is -3.0" in text and "greater than 0" in text


def test_a_key_within_a_list_takes_the_line_of_the_list() -> None:
    assert "line 5, rows[0].order" in _explained({"rows": [{"order": "x"}]})


def test_names_of_types_are_no_keys() -> None:
    # pydantic tries every kind of `band` and puts its name among the keys
    text = _explained({"band": ["x", 2.0]})
    assert "band[0]" in text and "tuple" not in text.partition("is 'x'")[0]


def test_a_section_in_place_of_a_value_is_not_printed_in_full() -> None:
    text = _explained({"prepare": {"cutoff_hz": {"a": list(range(100))}}})
    assert "is a section with settings" in text and "99" not in text


def test_models_are_found_in_tuples_and_unions() -> None:
    assert section_of(_Outer, ("rows",)) is _Inner
    assert section_of(_Outer, ("prepare",)) is _Inner
    assert section_of(_Outer, ("prepare", "order")) is None
    assert section_of(_Outer, ("nothing",)) is None
    assert model_in(dict[str, _Inner] | None) is _Inner
