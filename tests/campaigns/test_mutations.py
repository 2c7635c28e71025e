"""260 mutated campaign files and configurations: `check` judges each, or refuses it in one line, and soon."""

from __future__ import annotations

import copy
import random
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

from mrpipe.cli import run
from mrpipe.config.loader import load_config
from tests.campaigns.builders import campaign, content

NASTY: list[Any] = [
    None,
    True,
    0,
    -1,
    10**400,
    1e308,
    float("inf"),
    float("nan"),
    "",
    ".",
    "..",
    "/",
    "\0",
    "x" * 3000,
    "9**9**9**9 N",
    "2026-30-01",
    "*.csv",
    [],
    {},
    [[1, 0], [0, 5]],
    [[0, 2], [1, 3]],
    ["backlsh"],
    {"value": float("nan"), "unit": "N"},
    {"column": True, "unit": "N"},
    {"column": [1], "unit": ["N"]},
    {1: 2},
]

CONFIG: dict[str, Any] = {
    "name": "x",
    "seed": 1,
    "stages": ["prepare", "report"],
    "campaigns": {"bench": "data", "frame": None, "closed_loop": None},
    "prepare": {"working_rate_hz": 0, "cutoff_hz": 100, "phase": "zero", "corrections": {"force_offset_n": {"a": 1}}},
    "report": {"formats": ["html"], "title": "x"},
    "close_loop": {"candidates": ["backlash"], "effect_files": []},
}


def _places(value: Any, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [place] if place else []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        found += _places(inner, (*place, key))
    return found


def _mutated(base: dict[str, Any], seed: int) -> dict[str, Any]:
    rng = random.Random(seed)
    changed = copy.deepcopy(base)
    for _ in range(rng.randint(1, 2)):
        *way, last = rng.choice(_places(changed))
        target = changed
        for key in way:
            target = target[key]
        if rng.random() < 0.2:
            del target[last]
        elif rng.random() < 0.2 and isinstance(target, dict):
            target[f"{last}x"] = target.pop(last)
        else:
            target[last] = copy.deepcopy(rng.choice(NASTY))
        if not changed:
            break
    return changed


@pytest.fixture(scope="module", autouse=True)
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Compile the effects before any time is measured."""
    folder = tmp_path_factory.mktemp("sound")
    campaign(folder / "data")
    (folder / "x.yaml").write_text(yaml.safe_dump(CONFIG | {"stages": ["prepare", "close-loop"]}), encoding="utf-8")
    assert run(["check", str(folder / "x.yaml")]) in (0, 1)


def _checked(config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Run `mrpipe check`, which must end in a verdict or in one line, and soon; any other exception escapes."""
    begun = time.process_time()
    status = run(["check", str(config)])
    said = capsys.readouterr()
    assert status in (0, 1, 2)
    if status:
        (line,) = said.err.splitlines()
        assert line.startswith("mrpipe: ") and len(line) < 6000
    else:
        assert said.err == ""
    assert time.process_time() - begun < 10.0


@pytest.mark.property
@pytest.mark.parametrize("block", range(6))
def test_mutated_campaign_files(tmp_path: Path, capsys: pytest.CaptureFixture[str], block: int) -> None:
    folder = campaign(tmp_path / "data")
    config = tmp_path / "x.yaml"
    config.write_text(yaml.safe_dump(CONFIG), encoding="utf-8")
    for seed in range(20 * block, 20 * block + 20):
        text = yaml.safe_dump(_mutated(content(), seed), sort_keys=False)
        (folder / "campaign.yaml").write_text(text, encoding="utf-8")
        _checked(config, capsys)


@pytest.mark.property
@pytest.mark.parametrize("block", range(4))
def test_mutated_configurations(tmp_path: Path, capsys: pytest.CaptureFixture[str], block: int) -> None:
    campaign(tmp_path / "data")
    path = tmp_path / "x.yaml"
    for seed in range(20 * block, 20 * block + 20):
        path.write_text(yaml.safe_dump(_mutated(CONFIG, seed), sort_keys=False), encoding="utf-8")
        _checked(path, capsys)


def _every_setting() -> dict[str, Any]:
    """Return a configuration that writes every setting of every section, on the small campaign."""
    whole: dict[str, Any] = yaml.safe_load(load_config(Path("thesis")).as_yaml())
    stages = ["prepare", "assemble", "sweep", "train-forward", "identify-damper", "close-loop", "report"]
    return whole | {"campaigns": {"bench": "data", "frame": None, "closed_loop": None}, "stages": stages}


@pytest.mark.property
@pytest.mark.parametrize("block", range(3))
def test_mutated_settings_of_every_section(tmp_path: Path, capsys: pytest.CaptureFixture[str], block: int) -> None:
    campaign(tmp_path / "data")
    path, whole = tmp_path / "x.yaml", _every_setting()
    for seed in range(20 * block, 20 * block + 20):
        path.write_text(yaml.safe_dump(_mutated(whole, seed), sort_keys=False), encoding="utf-8")
        _checked(path, capsys)
