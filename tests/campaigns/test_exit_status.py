"""What the user sees of a faulty campaign: one line on standard error, nothing on standard output, exit status 2."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.cli import run
from tests.campaigns.builders import CHANNELS, campaign, content, motion

NAN = motion() | {"F": np.where(np.arange(4000) == 7, np.nan, motion()["F"])}
BACKWARDS = motion() | {"t": motion()["t"][::-1]}


@pytest.mark.golden
def test_a_file_that_ends_within_a_row(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = campaign(tmp_path)
    text = (folder / "one.csv").read_text()
    (folder / "one.csv").write_text(text[: text.rstrip().rindex(",")])
    assert run(["show", str(folder)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "test one, force, row 4001: is missing in the last row, as if the recording was interrupted" in line
    assert "delete this row" in line


@pytest.mark.golden
@pytest.mark.parametrize(
    ("columns", "changes", "expected"),
    [
        (None, {"tests": [content()["tests"][0] | {"file": "no.csv"}, content()["tests"][1]]}, "data file not found"),
        (None, {"channels": {**CHANNELS, "force": {"column": "G", "unit": "N"}}}, "no column 'G'"),
        (None, {"channels": {**CHANNELS, "force": {"column": "F", "unit": "Newtons per"}}}, "is not a unit"),
        (BACKWARDS, {}, "a clock that increases with every sample expected"),
        (NAN, {}, "row 9: is NaN"),
        (None, {"sampling_rate_hz": 250}, "the clock runs at 1000 Hz"),
        (None, {"tests": content()["tests"][:1]}, "no validation test"),
        (None, {"chanels": {}}, "did you mean channels?"),
    ],
)
def test_each_fault_is_one_line_and_exit_2(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    columns: dict[str, np.ndarray] | None,
    changes: dict[str, object],
    expected: str,
) -> None:
    assert run(["show", str(campaign(tmp_path, columns, **changes))]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and expected in err and "Traceback" not in err
