"""A stage is its file and its settings section: both are found by name, and nothing else has to be edited."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

import mrpipe.config.sections
import mrpipe.stages
from mrpipe.config import model
from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.stages import registry

pytestmark = pytest.mark.property

STAGE_FILE = '''
"""`count-tests`: how many tests of each role were prepared."""

from mrpipe.pipeline.stage import Stage


def _run(context):
    from mrpipe.signals.prepared import read_prepared

    tests = read_prepared(context.artifact("prepare"))
    chosen = [test.name for test in tests if test.role == context.settings.count_tests.role]
    with context.write("count.h5") as artifact:
        artifact.put("count", float(len(chosen)), unit="1")
    context.report.text(f"{len(chosen)} tests.")
    return {"count": len(chosen)}


STAGE = Stage(
    "count-tests", "Count the prepared tests of one role.", _run, ("prepare",), settings=("count_tests",),
    outputs=("count.h5",),
)
'''
SECTION_FILE = '''
"""Settings of `count-tests`."""

from pydantic import Field

from mrpipe.options import Section


class CountTestsSettings(Section):
    """Which tests are counted."""

    role: str = Field("training", description="Role of the tests that are counted.")
'''
PROGRAM = """
import sys
import mrpipe.config.sections, mrpipe.stages
mrpipe.stages.__path__.append(sys.argv[1])
mrpipe.config.sections.__path__.append(sys.argv[2])
from mrpipe.cli import run
sys.exit(run(sys.argv[3:]))
"""


@pytest.fixture
def further_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, Path]]:
    """Yield folders that the program searches for stages and sections in addition to its own."""
    stages, sections = tmp_path / "stages", tmp_path / "sections"
    stages.mkdir()
    sections.mkdir()
    (stages / "count_tests.py").write_text(STAGE_FILE, encoding="utf-8")
    (sections / "count_tests.py").write_text(SECTION_FILE, encoding="utf-8")
    monkeypatch.setattr(mrpipe.stages, "__path__", [*mrpipe.stages.__path__, str(stages)])
    monkeypatch.setattr(mrpipe.config.sections, "__path__", [*mrpipe.config.sections.__path__, str(sections)])
    registry.forget()
    model.forget()
    yield stages, sections
    monkeypatch.undo()
    registry.forget()
    model.forget()


def test_a_new_stage_is_found_with_its_section(further_folders: tuple[Path, Path]) -> None:
    names = list(registry.all_stages())
    assert names.index("count-tests") > names.index("prepare")
    assert model.config_model()().model_dump()["count_tests"] == {"role": "training"}
    assert ("count_tests.role", "Role of the tests that are counted.", "training") in list(model.options())


def test_a_new_stage_runs_from_the_command_line(further_folders: tuple[Path, Path], tmp_path: Path) -> None:
    campaign = tmp_path / "rig"
    campaign.mkdir()
    rows = "\n".join(f"{0.002 * i},{0.01 * _triangle(i)},{100.0 * _triangle(i + 125)},1.0" for i in range(4000))
    (campaign / "a.csv").write_text(f"t,x,F,i\n{rows}\n", encoding="utf-8")
    (campaign / "b.csv").write_text(f"t,x,F,i\n{rows}\n", encoding="utf-8")
    (campaign / "campaign.yaml").write_text(
        "campaign: two\nrig: damper-bench\nsampling_rate_hz: 500\nchannels:\n  time: {column: t, unit: s}\n"
        "  displacement: {column: x, unit: m}\n  drive: {column: i, unit: A}\n  force: {column: F, unit: N}\ntests:\n"
        "  - {name: a, file: a.csv, role: training}\n  - {name: b, file: b.csv, role: validation}\n",
        encoding="utf-8",
    )
    folders = [str(folder) for folder in further_folders]
    arguments = ["count-tests", "--campaign", str(campaign), "--run", str(tmp_path / "run"), "--json", "--quiet"]
    arguments += ["--set", "count_tests.role=validation"]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *folders, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["count"] == 1


def _triangle(index: int) -> float:
    phase = (index % 500) / 500.0
    return 4.0 * abs(phase - 0.5) - 1.0


def _nothing(context: StageContext) -> Mapping[str, Any]:
    return {}


def test_order_follows_inputs_and_after() -> None:
    stages = [
        Stage("third", "", _nothing, inputs=("second",)),
        Stage("after-family", "", _nothing, after=("pair",)),
        Stage("second", "", _nothing, inputs=("first",)),
        Stage("first", "", _nothing),
        Stage("pair-a", "", _nothing, inputs=("third",), family="pair"),
    ]
    assert list(registry.in_order(stages)) == ["first", "second", "third", "pair-a", "after-family"]


@pytest.mark.parametrize(
    ("stages", "message"),
    [
        ([Stage("a", "", _nothing, inputs=("b",)), Stage("b", "", _nothing, inputs=("a",))], "wait for each other"),
        ([Stage("a", "", _nothing), Stage("a", "", _nothing)], "two stages have the name a"),
        ([Stage("a", "", _nothing, inputs=("b",))], "reads b, which is not a stage"),
    ],
)
def test_an_order_that_cannot_be_is_refused(stages: list[Stage], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        registry.in_order(stages)


def test_a_section_module_without_its_class_is_refused(further_folders: tuple[Path, Path]) -> None:
    (further_folders[1] / "empty_one.py").write_text("", encoding="utf-8")
    model.forget()
    with pytest.raises(ValueError, match="EmptyOneSettings"):
        model.sections()
