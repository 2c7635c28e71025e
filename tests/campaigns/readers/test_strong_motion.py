"""Archives that cannot be opened, and records of other quantities: one line, wherever they are named."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from mrpipe.campaigns.files import open_data_file
from mrpipe.campaigns.proposal.propose import propose_campaigns
from mrpipe.campaigns.readers.strong_motion import read_strong_motion
from mrpipe.errors import UserError

pytestmark = pytest.mark.planted


def archive(folder: Path) -> bytearray:
    with zipfile.ZipFile(folder / "t.zip", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a.V2c", "".join(f"{value * 7919 % 1013:10.3f}" for value in range(4000)))
    return bytearray((folder / "t.zip").read_bytes())


@pytest.mark.parametrize(
    ("where", "value", "words"),
    [
        (((6, 0), (8, 1)), 1, "is encrypted"),
        (((8, 0), (10, 1)), 99, "compressed in a way that is not read"),
        (((300, 0),), 0xFF, "is not a zip file that can be read"),
    ],
)
def test_an_archive_that_cannot_be_opened(
    tmp_path: Path, where: tuple[tuple[int, int], ...], value: int, words: str
) -> None:
    content = archive(tmp_path)
    directory = content.rfind(b"PK\x01\x02")
    for place, in_directory in where:
        content[place + in_directory * directory] ^= value
    (tmp_path / "t.zip").write_bytes(content)
    for read in (read_strong_motion, open_data_file):
        with pytest.raises(UserError, match=words) as caught:
            read(tmp_path / "t.zip")
        assert "\n" not in str(caught.value)


def test_a_record_of_another_quantity_says_which_file_to_give(tmp_path: Path) -> None:
    for name, words in (("a.V3", "response spectra.*V2 file"), ("a.VT2", "velocity.*AT2"), ("a.V1A", "GeoNet.*V2A")):
        (tmp_path / name).write_text("")
        with pytest.raises(UserError, match=words):
            open_data_file(tmp_path / name)


def test_a_proposal_names_the_file_in_the_archive_and_its_line(tmp_path: Path) -> None:
    head = (
        "Chan  1: N     Location: Roof\n  99 points of accel data equally spaced at  .010 sec, in cm/sec2. (8f10.6)\n"
    )
    with zipfile.ZipFile(tmp_path / "event.zip", "w") as file:
        file.writestr("station/chan001.v2", head + "  1.000000" * 8 + "\n")
    said = r"\(event\.zip: station/chan001\.v2: line 2: promises 99 values, 8 follow\); download the record again$"
    with pytest.raises(UserError, match=said):
        propose_campaigns(tmp_path, "building", None, tmp_path)
    (tmp_path / "event.zip").unlink()
    for number in (1, 2):
        (tmp_path / f"chan00{number}.v2").write_text(head.replace("99", "32") + ("  1.000000" * 8 + "\n") * 4)
    with pytest.raises(
        UserError, match=r"\(chan001\.v2: one channel\); put the channels of a record into one zip file$"
    ):
        propose_campaigns(tmp_path, "building", None, tmp_path)


def test_a_file_in_another_form_is_described(tmp_path: Path) -> None:
    for text, words in (
        ("* VOL1DS FILE:  1/01\nUNITS ARE SECONDS AND G/10\n  .457339E-03\n", r"line 1: begins with '\* VOL1DS FILE"),
        ("<html>Please log in</html>", "begins with '<html>"),
        ("\n", "is empty"),
    ):
        (tmp_path / "a.V1").write_text(text)
        with pytest.raises(UserError, match=words):
            read_strong_motion(tmp_path / "a.V1")
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as file:
        file.writestr("spectra.V3", "spectra")
    with pytest.raises(UserError, match=r"holds no file that ends in \.v2, .*\.at2"):
        read_strong_motion(tmp_path / "a.zip")
