"""Delimited text as columns: delimiter, decimal sign, header, labels and time stamps are found."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.campaigns.schema import TextEntry
from mrpipe.campaigns.tables import table_of_text
from mrpipe.errors import UserError

pytestmark = pytest.mark.property


@pytest.mark.parametrize(
    ("text", "names", "values"),
    [
        ("t,x\n0,1.5\n1,2.5\n", ("t", "x"), [1.5, 2.5]),
        ("Messung 7\n\nZeit [s];Weg [mm]\n0,0;1,5\n0,1;2,5\n", ("Zeit [s]", "Weg [mm]"), [1.5, 2.5]),
        ("0\t1.5\n1\t2.5\n", ("0", "1"), [1.5, 2.5]),
        ('"time (s)","Disp, LVDT (mm)"\n0,1.5\n1,2.5\n', ("time (s)", "Disp, LVDT (mm)"), [1.5, 2.5]),
        ("% a comment of four words\n 0  1.5\n 1  2.5\n", ("0", "1"), [1.5, 2.5]),
        ("t;x;\n0;1.5;\n1;2.5;\n", ("t", "x"), [1.5, 2.5]),
    ],
)
def test_layouts(text: str, names: tuple[str, ...], values: list[float]) -> None:
    table = table_of_text(Path("a.csv"), text)
    assert table.names == names
    assert table.column(1, "").tolist() == values


def test_time_stamps_become_seconds() -> None:
    text = "when,x\n2026-03-01 12:00:00.000,1\n2026-03-01 12:00:00.250,2\n2026-03-01 12:00:01.500,3\n"
    assert table_of_text(Path("a.csv"), text).column("when", "").tolist() == [0.0, 0.25, 1.5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing\nbut words\n", "holds no row of numbers"),
        ("t,x\n0,1\n1,2,3\n", "line 3: has 3 fields, the rows above have 2"),
        ("t,x\n0,1\n1,OVL\n2,3\n", "line 3, column x: 'OVL' is not a number"),
    ],
)
def test_a_faulty_row_is_named(text: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        table_of_text(Path("a.csv"), text).column(1, "")


@pytest.mark.parametrize("between", ["\n", "\n% a note\n"])
def test_lines_count_also_those_without_numbers(between: str) -> None:
    text = "t,x\n0,1\n1,2\n" + between + "2,3\n3,OVL\n4,5\n"
    line = text.splitlines().index("3,OVL") + 1
    table = table_of_text(Path("a.csv"), text)
    with pytest.raises(UserError, match=f"line {line}, column x: 'OVL' is not a number; write a number"):
        table.column(1, "")
    assert [table.line_of(index) for index in (1, 3)] == [3, line]


def test_words_after_the_last_sample_are_to_be_deleted() -> None:
    text = "t,x\n0,1\n1,2\n\nEnd of test\n"
    with pytest.raises(UserError, match="line 5, column t: 'End of test' is not a number; delete the lines after"):
        table_of_text(Path("a.csv"), text).column("t", "")


@pytest.mark.parametrize(("text", "message"), [("", "is empty"), ("\n \n", "is empty"), ("t,x\n0,1\n", "single row")])
def test_a_file_without_samples_is_refused_as_such(text: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        table_of_text(Path("a.csv"), text).column("t", "")


def test_times_of_day_may_pass_midnight() -> None:
    text = "when,x\n23:59:59.500,1\n23:59:59.999,2\n00:00:00.500,3\n00:00:01.500,4\n"
    assert table_of_text(Path("a.csv"), text).column("when", "").tolist() == [0.0, 0.499, 1.0, 2.0]


@pytest.mark.parametrize(
    ("header", "asked"), [("La\u0308nge", "Länge"), ("x [\u03bcm]", "x [\u00b5m]"), ("a  b", "a b")]
)
def test_names_that_look_the_same_are_the_same(header: str, asked: str) -> None:
    assert table_of_text(Path("a.csv"), f"t,{header}\n0,1\n1,2\n").column(asked, "").tolist() == [1.0, 2.0]


@pytest.mark.parametrize("delimiter", [";", "\t", "  "])
def test_a_first_row_of_whole_numbers_does_not_hide_decimal_commas(delimiter: str) -> None:
    text = (
        delimiter.join("tx") + "\n" + "\n".join(delimiter.join(row) for row in (["0", "0"], ["1", "0"], ["2", "0,5"]))
    )
    assert table_of_text(Path("a.csv"), text).column("x", "").tolist() == [0.0, 0.0, 0.5]


def test_one_word_among_decimal_commas_is_named_and_not_the_numbers() -> None:
    text = "t;x\n0,0;1,5\n0,1;OVL\n0,2;2,5\n"
    with pytest.raises(UserError, match="line 3, column x: 'OVL' is not a number; write a number"):
        table_of_text(Path("a.csv"), text).column("x", "")


@pytest.mark.parametrize(
    ("text", "line", "found"),
    [
        ("t;x\n0,0;997,41\n0,1;1.005,39\n", 3, r"1\.005,39"),
        ("t;x\n0,0;997,41\n0,1;1.005\n", 3, r"1\.005"),
        ('t,x\n0.0,997.41\n0.1,"1,005.39"\n', 3, "1,005.39"),
        ("t;x\n0,0;997,41\n0,1;1\u00a0005,39\n", 3, "1.*005,39"),
    ],
)
def test_separators_of_thousands_are_named_and_never_read_as_decimal_signs(text: str, line: int, found: str) -> None:
    with pytest.raises(UserError, match=f"line {line}, column x: '{found}' is not a number; write numbers without sep"):
        table_of_text(Path("a.csv"), text).column("x", "")


def test_the_remedy_shows_what_would_be_right() -> None:
    def told(text: str, **layout: str) -> str:
        with pytest.raises(UserError) as caught:
            table_of_text(Path("a.csv"), text, TextEntry(**layout)).column("x", "")
        return str(caught.value)

    assert told("t;x\n0,0;997,41\n0,1;-1.005,39\n").endswith("without separators of thousands, as -1005,39")
    assert told('t,x\n0.0,997.41\n0.1,"1,005.39"\n').endswith("as 1005.39")
    commas = told("t;x\n0,0;0,1\n1,0;0,2\n", decimal=".")
    assert commas.endswith("for decimal commas give text: {decimal: ','} in campaign.yaml")


def test_the_minus_sign_of_a_typesetter_is_a_minus() -> None:
    assert table_of_text(Path("a.csv"), "t,x\n0,\u22121.5\n1,2.5\n").column("x", "").tolist() == [-1.5, 2.5]


@pytest.mark.golden
def test_separators_of_thousands_in_the_first_row_are_named(tmp_path: Path) -> None:
    """The file had been said to hold no row of numbers."""
    rows = "\n".join(f"0,00{index};1.999,4;12,5" for index in range(9))
    with pytest.raises(UserError) as caught:
        table_of_text(tmp_path / "a.csv", f"t [s];i [mA];F [N]\n{rows}\n")
    assert "line 2: '1.999,4' is not a number; write numbers without separators of thousands, as 1999,4" in str(
        caught.value
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,x,F\n0.0,OVL,2.5\n0.1,1.0,2.6\n0.2,1.1,2.7\n", "line 2, column x: 'OVL' is not a number; delete the row"),
        ("t,x,F\ns,mm,N\n0.0,1.0,#N/A\n0.1,1.0,2.6\n", "line 3, column F: '#N/A' is not a number; delete the row"),
    ],
)
def test_a_damaged_first_sample_is_no_header(text: str, message: str) -> None:
    with pytest.raises(UserError) as caught:
        table_of_text(Path("a.csv"), text)
    assert message in str(caught.value)


def test_a_line_of_ranges_above_the_samples_is_still_a_header() -> None:
    table = table_of_text(Path("a.csv"), "t,x,F\nrange,10,500\n0.0,1.0,2.5\n0.1,1.1,2.6\n")
    assert table.column("x", "").tolist() == [1.0, 1.1]


def test_a_header_within_the_samples_names_the_restart() -> None:
    table = table_of_text(Path("a.csv"), "t,x\n0,1\n1,2\nt,x\n0,1\n1,2\n")
    with pytest.raises(UserError, match=r"line 4, column t: 't' is not a number; the header stands here again"):
        table.column("t", "")


def test_separators_of_thousands_in_quotes_are_named_and_a_long_word_is_shortened() -> None:
    with pytest.raises(UserError, match=r"line 2: '1,746.8' is not a number; write numbers without separators"):
        table_of_text(Path("a.csv"), 't,x\n"0.0","1,746.8"\n"0.1","1,747.8"\n')
    zeros = table_of_text(Path("a.csv"), "t,x\n0,1\n1,2\n" + "\0" * 4096)
    with pytest.raises(UserError, match="delete the lines after the last sample") as caught:
        zeros.column("t", "")
    assert len(str(caught.value)) < 250


def test_a_name_of_several_columns_is_refused_where_their_numbers_differ() -> None:
    same = table_of_text(Path("a.csv"), "t,x,t,F\n0,1,0,5\n1,2,1,6\n")
    same.require_one("t", same.column("t", ""), "")
    other = table_of_text(Path("a.csv"), "t,F,F\n0,1,5\n1,2,6\n")
    with pytest.raises(UserError, match=r"columns 1 and 2 have the name 'F'; name the right one by its position"):
        other.require_one("F", other.column("F", ""), "")
    other.require_one(2, other.column(2, ""), "")
    assert other.column(2, "").tolist() == [5.0, 6.0]
