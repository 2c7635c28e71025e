"""YAML of a stranger: dates, aliases, nesting, tags and large numbers each end in one line."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel, ConfigDict

from mrpipe.artifacts import yaml_source
from mrpipe.artifacts.yaml_source import nearest, parse, read_yaml
from mrpipe.errors import UserError

BILLION_LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{index}: &a{index} [{', '.join([f'*a{index - 1}'] * 10)}]\n" for index in range(1, 12)
)

HOSTILE = {
    "billion laughs": (BILLION_LAUGHS, "holds too many values"),
    "alias within itself": ("about: &a {me: *a}\n", "an alias refers to a mapping that contains it"),
    "3000 brackets": ("a: " + "[" * 3000 + "]" * 3000, "is nested too deeply"),
    "100 brackets": ("a: " + "[" * 100 + "]" * 100, "is nested too deeply"),
    "no integer": ("a: !!int abc\n", "a value cannot be read"),
    "no truth value": ("a: !!bool maybe\n", "a value cannot be read"),
    "no float": ("a: !!float x\n", "a value cannot be read"),
    "5000 digits": (f"a: {'9' * 5000}\n", "a value cannot be read"),
    "no date": ("a: !!timestamp 2026-30-01\n", "a value cannot be read"),
    "foreign tag": ("a: !!python/object/apply:os.system [ls]\n", "not valid YAML"),
    "unhashable key": ("? [1, 2]\n: 3\n", ""),
    "key twice": ("a: 1\na: 2\n", "line 2, a: appears already in line 1"),
}


@pytest.mark.property
@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_yaml_is_one_line_and_fast(tmp_path: Path, case: str) -> None:
    text, expected = HOSTILE[case]
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    begun = time.process_time()
    with pytest.raises(UserError) as caught:
        read_yaml(tmp_path / "a.yaml")
    assert expected in str(caught.value) and "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500 and time.process_time() - begun < 5.0


@pytest.mark.golden
def test_dates_stay_text(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("campaign: 2026-30-01\nother: 2026-03-01\n", encoding="utf-8")
    assert read_yaml(tmp_path / "a.yaml").content == {"campaign": "2026-30-01", "other": "2026-03-01"}
    assert parse("2026-30-01", "--set")[1] == "2026-30-01"


@pytest.mark.golden
def test_merged_mappings_are_no_repeated_keys(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("base: &b {x: 1, y: 2}\nown: {<<: *b, x: 3}\n", encoding="utf-8")
    assert read_yaml(tmp_path / "a.yaml").content["own"] == {"x": 3, "y": 2}


@pytest.mark.golden
@pytest.mark.parametrize("text", ["a:\n\tb: 1\n", "a: 1\nb:\t\tc: 2\n", "a:\n  b: 1\n\tc: 2\n"])
def test_a_tab_names_its_remedy(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(text)
    with pytest.raises(UserError, match=r"line \d: not valid YAML \(a tab\); write spaces in place of the tab"):
        read_yaml(path)


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    mass_kg: float = 1.0
    pair: tuple[float, float] = (0.0, 0.0)


class Outer(BaseModel):
    model_config = ConfigDict(extra="forbid")
    other: int = 1
    one: Inner | None = None
    many: dict[str, Inner] = {}
    listed: tuple[Inner, ...] = ()
    counted: dict[int, float] = {}


@pytest.mark.property
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("one:\n  weight: 2\n", "line 2, one.weight: unknown key; known: mass_kg, pair"),
        ("many:\n  a: {mass_gk: 2}\n", "line 2, many.a.mass_gk: unknown key; did you mean mass_kg?"),
        ("listed:\n  - {weight: 2}\n", "line 2, listed[0].weight: unknown key; known: mass_kg, pair"),
        ("xyz: 1\n", "line 1, xyz: unknown key; known: counted, listed, many, one, other"),
        ("one: {pair: [1, 2, 3]}\n", "line 1, one.pair: is [1, 2, 3]; a list of at most 2 values expected"),
        ("counted: {top: 1}\n", "line 1, counted.top: is 'top'; a whole number expected"),
    ],
)
def test_an_unknown_key_is_compared_with_those_of_its_own_mapping(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(text)
    source = read_yaml(path)
    with pytest.raises(UserError) as caught:
        source.build(Outer, source.content, ())
    assert str(caught.value) == f"{path}: {message}"


@pytest.mark.golden
def test_names_that_look_like_octal_numbers_or_times_stay_names(tmp_path: Path) -> None:
    """A campaign named 0123 had become 83, and 1:30 had become 90."""
    (tmp_path / "a.yaml").write_text(
        "a: 0123\nb: 1:30\nc: 0\nd: -12\ne: 0x1F\nf: 1.5e-3\ng: -.5\nh: 1_000\n", encoding="utf-8"
    )
    found = read_yaml(tmp_path / "a.yaml").content
    assert found == {"a": "0123", "b": "1:30", "c": 0, "d": -12, "e": 31, "f": 1.5e-3, "g": -0.5, "h": 1000}


@pytest.mark.golden
def test_a_value_of_several_types_is_named_by_its_key(tmp_path: Path) -> None:
    """The key had the name of a type behind it: `column.str`."""

    class Channel(BaseModel):
        model_config = ConfigDict(strict=True)
        column: str | int

    (tmp_path / "a.yaml").write_text("column: [F]\n", encoding="utf-8")
    source = read_yaml(tmp_path / "a.yaml")
    with pytest.raises(UserError) as caught:
        source.build(Channel, source.content, ())
    assert str(caught.value).endswith("a.yaml: line 1, column: is ['F']; a text expected")


@pytest.mark.golden
def test_of_equally_close_words_the_one_with_the_same_first_letter_is_named() -> None:
    assert nearest("Fx", ["t", "x", "i", "F"]) == "did you mean F?"
    assert nearest("xF", ["t", "x", "i", "F"]) == "did you mean x?"
    assert nearest("qq", ["t", "x"]) == "known: t, x"
    assert nearest("t", ["b/t", "a/t"]) == "did you mean a/t?"


@pytest.mark.property
@pytest.mark.skipif(not yaml.__with_libyaml__, reason="PyYAML was built without libyaml, so there is one parser")
@pytest.mark.parametrize(
    "text",
    [
        "a: &shared {x: 1, y: 0123}\nb:\n  <<: *shared\n  y: 10:30\n",
        "text: >-\n  two\n  lines\n\nvalues: [1, 2.5, -3.0e+2, .inf, 'quoted', ~, yes]\n",
        "tests:\n- {name: é, role: training}   # a remark\n- name: b\n  role: validation\n",
        "date: 2026-30-01\n? long key\n: value\n",
    ],
)
def test_both_parsers_give_the_same_content_and_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(text, encoding="utf-8")
    used: list[type] = []
    given = yaml_source._parse_with

    def counted(loader: type, text: str, source: str | Path) -> tuple[object, object]:
        used.append(loader)
        return given(loader, text, source)

    monkeypatch.setattr(yaml_source, "_parse_with", counted)
    fast = read_yaml(file)
    assert used == [yaml_source._FastLoader]
    assert issubclass(used[0], yaml.CSafeLoader)
    monkeypatch.setattr(yaml_source, "_FastLoader", yaml_source._Loader)
    assert read_yaml(file) == fast
