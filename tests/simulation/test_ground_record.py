"""Reading a recorded base acceleration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.simulation.ground_record import read_histories


@pytest.mark.golden
def test_headers_separators_and_units(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("time, a\n0.0, 0.0\n0.02; 0.5\n0.04\t-0.25\n")
    time, histories = read_histories(path, "g")
    acceleration = histories[:, 0]
    np.testing.assert_allclose(time, [0.0, 0.02, 0.04])
    np.testing.assert_allclose(acceleration, np.array([0.0, 0.5, -0.25]) * 9.80665)


@pytest.mark.golden
@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("0 1\n0 2\n", "m/s^2", "line 2: time does not rise"),
        ("time a\n\n0 1\n# pause\n0 2\n", "m/s^2", "line 5: time does not rise"),
        ("0 1\n1\n", "m/s^2", "line 2: has no two numbers"),
        ("a b\n", "m/s^2", "holds 0 rows"),
        ("time a\n0 1\nn/a 1\n2 2\n", "m/s^2", r"line 3: is not a row of numbers \('n/a 1'\); correct the row"),
        ("0 1\n1 2\n", "mm", "is not a unit of acceleration"),
        ("0 1\n1 nan\n", "m/s^2", "line 2: holds a number that is not finite"),
        ("t,a\n0,0\n1,0\n2,0\n", "m/s^2", "nothing but zeros"),
        ("time [s],acc [g]\n0,1\n1,2\n", "m/s^2", r"m/s\^2: is not the unit that the header .* set it to g"),
    ],
)
def test_faults(tmp_path, text, unit, words):
    path = tmp_path / "record.txt"
    path.write_text(text)
    with pytest.raises(UserError, match=words) as caught:
        read_histories(path, unit)
    assert "\n" not in str(caught.value)


@pytest.mark.golden
@pytest.mark.parametrize("rows", ["0,00;0,5\n0,01;-1,25\n", "0,00\t0,5\n0,01\t-1,25\n", "0.00,0.5\n0.01,-1.25\n"])
def test_decimal_commas(tmp_path, rows):
    path = tmp_path / "record.csv"
    path.write_text(f"Zeit [s];Beschleunigung [m/s^2]\n{rows}")
    time, histories = read_histories(path, "m/s^2")
    np.testing.assert_allclose(time, [0.0, 0.01])
    np.testing.assert_allclose(histories[:, 0], [0.5, -1.25])


@pytest.mark.property
def test_a_header_that_agrees_with_the_unit_or_says_another_quantity_is_no_fault(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("time [s],north [Gal] (first floor)\n0,1\n1,2\n")
    np.testing.assert_allclose(read_histories(path, "cm/s^2")[1][:, 0], [0.01, 0.02])


@pytest.mark.property
def test_a_gap_in_a_record_is_told_and_a_history_of_straight_lines_is_not(tmp_path):
    path = tmp_path / "record.txt"
    time = np.concatenate([np.arange(50) * 0.01, 3.0 + np.arange(50) * 0.01])
    np.savetxt(path, np.column_stack([time, np.cos(time)]))
    with pytest.raises(UserError, match=r"line 51: time jumps from 0\.49 to 3 s, and other rows are 0\.01 s"):
        read_histories(path, "m/s^2")
    path.write_text("time [s] acceleration\n\n" + path.read_text())
    with pytest.raises(UserError, match="line 53: time jumps"):
        read_histories(path, "m/s^2")
    path.write_text("0 0\n1 5\n2 5\n60 5\n61 0\n")
    assert read_histories(path, "m/s^2")[0][-1] == 61.0


@pytest.mark.golden
def test_missing_file(tmp_path):
    with pytest.raises(UserError, match="no such file"):
        read_histories(tmp_path / "none.txt", "g")


@pytest.mark.golden
def test_the_setting_at_fault_is_named(tmp_path):
    with pytest.raises(UserError, match=r"^simulate.excitation.file: is empty; name a text file"):
        read_histories(Path(), "g")
    with pytest.raises(UserError, match=r"^design.motions\[0\].file: .*none.txt: there is no such file"):
        read_histories(tmp_path / "none.txt", "g", file_setting="design.motions[0].file")
    path = tmp_path / "record.txt"
    path.write_text("0 1\n1 2\n")
    with pytest.raises(UserError, match=r"design.motions\[0\].unit"):
        read_histories(path, "mm", unit_setting="design.motions[0].unit")


@pytest.mark.real
def test_el_centro(public_data):
    path = public_data / "ground_motions" / "elcentro_NS.dat"
    _, histories = read_histories(path, "g")
    acceleration = histories[:, 0]
    assert np.max(np.abs(acceleration)) == pytest.approx(0.349 * 9.80665, rel=1e-2)


@pytest.mark.golden
@pytest.mark.parametrize("header", ["time [s], roof, deck x [kN]", "% t roof deck", "wind 2026\nt;roof;deck x (kN)"])
def test_histories_have_the_names_of_the_header(tmp_path, header):
    path = tmp_path / "wind.csv"
    path.write_text(f"{header}\n0.0, 0.0, 1.0\n0.02, 0.5, 2.0\n0.04, -0.25, 3.0\nend of the record\n")
    for roof, deck in (("roof", "deck" if header.startswith("%") else "deck x"), (1, 2)):
        _, histories = read_histories(path, "kN", channels=[deck, roof], quantity="force")
        np.testing.assert_allclose(histories, 1e3 * np.array([[1.0, 0.0], [2.0, 0.5], [3.0, -0.25]]))
    with pytest.raises(UserError, match="channel floor: is not in the record; it has roof, deck"):
        read_histories(path, "kN", channels=["floor"], quantity="force")
