"""What a stage prints for a person: keys in words with their units, and rows as tables."""

from __future__ import annotations

from typing import Any

import pytest

from mrpipe.cli.output import print_summary


def printed(summary: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> list[str]:
    print_summary("prepare", summary)
    return capsys.readouterr().out.splitlines()[1:]


@pytest.mark.golden
def test_keys_are_words_with_units(capsys: pytest.CaptureFixture[str]) -> None:
    summary = {"sampling_rate_hz": 1000.0, "validation_nrmse": 0.0123, "drive_is_set_point": False, "findings": []}
    assert printed(summary, capsys) == [
        "  sampling rate [Hz]: 1000",
        "  validation NRMSE: 0.0123",
        "  drive is set point: no",
        "  findings: -",
    ]


@pytest.mark.golden
def test_rows_are_a_table_without_empty_columns(capsys: pytest.CaptureFixture[str]) -> None:
    tests = [
        {"name": "a", "force_peak_n": 12.0, "note": "", "cutoffs_hz": {"force": 80.0}, "limit_m_s": None},
        {"name": "bc", "force_peak_n": 3.5, "note": "", "cutoffs_hz": {"force": None}, "limit_m_s": None},
    ]
    assert printed({"tests": tests}, capsys) == [
        "  tests:",
        "    name  force peak [N]  force cutoffs [Hz]",
        "    a     12              80",
        "    bc    3.5             -",
    ]


@pytest.mark.golden
def test_names_of_parameters_stay_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    numbers = {"c0_a": {"value": 2.5, "unit": "N*s/m"}, "gamma_share": {"value": 0.5, "unit": "1"}}
    assert printed({"parameters": numbers}, capsys) == [
        "  parameters:",
        "                 value  unit",
        "    c0_a         2.5    N*s/m",
        "    gamma_share  0.5    1",
    ]


@pytest.mark.property
def test_a_wide_table_has_parts_that_begin_with_the_first_column(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [{"name": f"test-{k}", **{f"a_long_name_of_column_{j}": j + k for j in range(12)}} for k in range(2)]
    lines = printed({"tests": rows}, capsys)
    assert max(map(len, lines)) <= 118
    assert sum(line.startswith("    name ") for line in lines) >= 3
    assert " ".join(lines).count("a long name of column") == 12


@pytest.mark.golden
def test_what_is_nested_more_deeply_is_no_table(capsys: pytest.CaptureFixture[str]) -> None:
    seen = {"velocity": {"smallest_m_s": 0.0, "largest_m_s": 0.2}}
    content = {"training_range": {"network": {"inputs": seen}, "damper": {"inputs": seen}}}
    inputs = ["      inputs:", "        velocity: smallest [m/s] 0, largest [m/s] 0.2"]
    assert printed(content, capsys) == ["  training range:", "    network:", *inputs, "    damper:", *inputs]


@pytest.mark.golden
def test_a_long_table_says_how_many_rows_it_omits(capsys: pytest.CaptureFixture[str]) -> None:
    assert printed({"tests": [{"name": f"t{k}"} for k in range(16)]}, capsys)[-1] == "    t15"
    lines = printed({"tests": [{"name": f"t{k}"} for k in range(19)]}, capsys)
    assert lines[-1] == "    … 3 more rows (--json prints all of them)"
