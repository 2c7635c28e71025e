"""The commands of the tutorials run as printed, on smaller data of the same kind."""

from __future__ import annotations

import re
import shlex
from importlib import import_module
from pathlib import Path

import pytest

from mrpipe.cli import run
from tests.campaigns.proposal.rigs import bench_folder, frame_folder

DOCS = Path(__file__).parents[2] / "docs"


def commands(page: str) -> list[list[str]]:
    """Return the commands of a page, split into words."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return [shlex.split(line) for line in re.findall(r"^\$ (.*)$", text, re.MULTILINE)]


def _follow(page: str, monkeypatch: pytest.MonkeyPatch, until: str) -> list[str]:
    """Run the commands of a page in the working directory; `run` goes on to the stage `until` only."""
    names = []
    for words in commands(page):
        if words[0] == "cd":
            monkeypatch.chdir(words[1])
            continue
        assert words[0] == "mrpipe"
        arguments = [*words[1:], *(["--until", until, "--quiet"] if words[1] == "run" else [])]
        assert run(arguments) == 0, words
        names.append(words[1])
    return names


@pytest.mark.golden
def test_own_damper(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    bench_folder(tmp_path / "versuche", 5, samples=1500)
    assert _follow("tutorial-own-damper.md", monkeypatch, "prepare") == ["init", "show", "check", "run"]
    assert len(commands("tutorial-own-damper.md")) <= 6
    assert (tmp_path / "my-damper" / "runs" / "my-damper" / "prepared.h5").is_file()
    assert "error:" not in capsys.readouterr().out


@pytest.mark.golden
def test_own_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    frame_folder(tmp_path / "frame-files", sweep_s=20.0)
    steps = commands("tutorial-own-frame.md")
    assert len(steps) <= 6
    assert run(steps[0][1:]) == 0
    # the step of the page that is done in an editor
    file = tmp_path / "my-tower" / "data" / "frame-files" / "campaign.yaml"
    said = re.search(r"^frame: \{.*$", (DOCS / "tutorial-own-frame.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert said is not None
    file.write_text(re.sub(r"^# frame: .*$", said[0], file.read_text(encoding="utf-8"), flags=re.MULTILINE))
    monkeypatch.chdir(tmp_path / "my-tower")
    capsys.readouterr()
    for words in steps[2:4]:
        assert run(words[1:]) == 0, words
    out = capsys.readouterr().out
    page = (DOCS / "tutorial-own-frame.md").read_text(encoding="utf-8")
    stages = re.search(r"valid, \d+ stages", page)
    assert "floor masses: 200, 200, 180 kg" in out and stages is not None and stages[0] in out
    assert steps[4] == ["mrpipe", "run"]


def _shown(page: str, command: str) -> str:
    """Return what a page shows below a command."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return text.partition(f"$ {command}\n")[2].partition("```")[0].partition("\n$ ")[0].strip()


@pytest.mark.golden
def test_own_rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The session up to the run is that of the page, word for word."""
    page = "tutorial-own-rig.md"
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(DOCS / "examples"))
    import_module("foreign_rig").main(tmp_path / "essais")
    steps = commands(page)
    assert len(steps) <= 6 and steps[-1] == ["mrpipe", "run"]
    assert run(steps[0][1:]) == 0
    assert capsys.readouterr().out.strip() == _shown(page, "mrpipe init my-rig --rig both --from essais")
    # the two lines of the page that are written in an editor
    file = tmp_path / "my-rig" / "data" / "essais-frame" / "campaign.yaml"
    text = file.read_text(encoding="utf-8")
    masses = re.search(r"^frame: \{.*$", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE)
    assert masses is not None
    text = re.sub(r"^# frame: .*$", masses[0], text, flags=re.MULTILINE).replace(
        "law: vd,", "law: vd, gains: {c_n_s_m: 1800},"
    )
    file.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path / "my-rig")
    for words in steps[2:-1]:
        assert run(words[1:]) == 0, words
        assert capsys.readouterr().out.strip() == _shown(page, " ".join(words)), words
