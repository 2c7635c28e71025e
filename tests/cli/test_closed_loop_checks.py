"""`check` says what closed-loop tests alone cannot give."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.cli import run
from tests.cli.test_check import checked, tower

pytestmark = pytest.mark.golden

SAID = "closed-loop tests do not show the modes, so identify-frame cannot use them: it"
LOOPS = [
    {"name": name, "file": f"{name}.csv", "kind": "closed-loop", "role": role, "law": "passive-off"}
    for name, role in (("one", "training"), ("two", "validation"))
]


@pytest.mark.parametrize(
    ("frame", "given", "said"),
    [
        ("null", "", f"warning: {SAID} has no data; name a campaign with tests of kind sweep"),
        ("laboratory", "", f"warning: {SAID} takes the frame of the virtual laboratory; name a campaign with"),
        ("laboratory", "structure: {storeys: [{mass_kg: 200, stiffness_n_m: 1.0e5, repeat: 2}]}\n", ""),
    ],
)
def test_a_campaign_of_closed_loop_tests_alone(
    frame: str, given: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tower(tmp_path, tests=LOOPS)
    text = config.read_text(encoding="utf-8").replace("stages: [", "stages: [prepare, ")
    text = text.replace(
        "bench: null, frame: data, closed_loop: null", f"bench: laboratory, frame: {frame}, closed_loop: data"
    )
    config.write_text(text + given, encoding="utf-8")
    status, out, _ = checked(capsys, str(config))
    assert status == 0
    assert said in out if said else "do not show the modes" not in out


@pytest.mark.parametrize("command", [["check"], ["run"], ["identify-frame"]])
def test_a_campaign_that_is_not_there_is_named_with_the_line_of_the_configuration(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tower(tmp_path)
    config.write_text(config.read_text(encoding="utf-8").replace("frame: data", "frame: dat"), encoding="utf-8")
    assert run([*command, "--config", str(config), "--run", str(tmp_path / "run")]) == 2
    error = capsys.readouterr().err
    assert f"{config.name}: line 3, campaigns.frame: there is no {tmp_path / 'dat'}; name a directory that" in error
    assert not (tmp_path / "run").exists()
