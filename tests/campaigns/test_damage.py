"""Whatever is done to the files of a campaign, the reader either reads them or says in one line what is wrong."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrpipe.campaigns import load_campaign
from mrpipe.errors import UserError
from tests.campaigns.builders import CHANNELS, content, motion, write_csv

PIECES = [
    "",
    "\n",
    "  ",
    ":",
    "- ",
    "{",
    "}",
    "[",
    "null",
    "nan",
    "-1e400",
    "'",
    "!!python/name:os",
    "\x00",
    "é",
    "[[]]",
    ";",
]
COLUMNS = motion(0.2)


def write(directory: Path, ending: str) -> Path:
    file = directory / f"one.{ending}"
    if ending == "csv":
        write_csv(file, COLUMNS)
    elif ending == "mat":
        scipy.io.savemat(file, COLUMNS)
    elif ending == "h5":
        with h5py.File(file, "w") as handle:
            for key, values in COLUMNS.items():
                handle[key] = values
    else:
        file.write_text(json.dumps({key: values.tolist() for key, values in COLUMNS.items()}))
    return file


def read_or_told(directory: Path) -> bool:
    """Return whether the campaign could be read; anything but one line of the program's own is a failure."""
    try:
        campaign = load_campaign(directory)
    except UserError as error:
        assert "\n" not in str(error)
        return False
    assert all(np.isfinite(values).all() for test in campaign.recordings for values in test.channels.values())
    return True


def yaml_text(ending: str = "csv") -> str:
    import yaml

    tests = [{"name": role, "file": f"one.{ending}", "role": role} for role in ("training", "validation")]
    return str(yaml.safe_dump(content(channels=CHANNELS, tests=tests), sort_keys=False))


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
@pytest.mark.property
def test_a_damaged_campaign_file(tmp_path: Path, data: st.DataObject) -> None:
    write(tmp_path, "csv")
    text = yaml_text()
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.integers(0, 12))
        text = text[:place] + data.draw(st.sampled_from(PIECES)) + text[place + cut :]
    (tmp_path / "campaign.yaml").write_text(text, encoding="utf-8")
    read_or_told(tmp_path)


@settings(max_examples=80, deadline=None)
@given(st.data(), st.sampled_from(["csv", "mat", "h5", "json"]))
@pytest.mark.property
def test_a_damaged_data_file(data: st.DataObject, ending: str) -> None:
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        file = write(directory, ending)
        (directory / "campaign.yaml").write_text(yaml_text(ending))
        raw = bytearray(file.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            place = data.draw(st.integers(0, len(raw) - 1))
            raw[place : place + data.draw(st.integers(0, 40))] = data.draw(st.binary(max_size=8))
        file.write_bytes(bytes(raw))
        read_or_told(directory)


@pytest.mark.golden
@pytest.mark.parametrize("ending", ["csv", "mat", "h5", "json"])
def test_undamaged_they_are_read(tmp_path: Path, ending: str) -> None:
    write(tmp_path, ending)
    (tmp_path / "campaign.yaml").write_text(yaml_text(ending))
    assert read_or_told(tmp_path)
