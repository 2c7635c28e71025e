"""Effects of a user: a name that is free, and something known that they act on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mrpipe.cli import run
from mrpipe.effects.file_checks import check_file
from mrpipe.effects.library import damper_effects, effects_named, load_effect_file
from mrpipe.effects.own import PLACES, QUANTITIES, place_failure
from mrpipe.effects.structural.library import all_structural_effects, effects_of_files, structural_effects
from mrpipe.errors import UserError

pytestmark = pytest.mark.property


def _file(folder: Path, module: str, file: str = "own.py", **changes: Any) -> Path:
    """Write a file with an effect of the program that has some other fields."""
    path = folder / file
    path.write_text(
        f"from dataclasses import replace\nfrom mrpipe.effects.{module} import EFFECT as E\n"
        f"EFFECT = replace(E, **{changes!r})\n"
    )
    return path


def test_every_effect_of_the_program_acts_on_something_known() -> None:
    assert [place_failure(item) for item in damper_effects().values() if place_failure(item)] == []
    of_a_file = [item for item in all_structural_effects().values() if not place_failure(item)]
    # the two others are found by functions of the program that know them by name
    rest = set(all_structural_effects()) - {item.name for item in of_a_file}
    assert rest == {"brace-flexibility", "controller-delay"}


@pytest.mark.parametrize(
    ("module", "word", "known", "hint"),
    [
        ("inertia", "forse", QUANTITIES, "did you mean force? "),
        ("inertia", "kaboom", QUANTITIES, ""),
        ("structural.impact", "flor", PLACES, "did you mean floor? "),
        ("structural.impact", "command", PLACES, ""),
    ],
)
def test_check_effect_and_the_tracing_refuse_an_unknown_text_of_acts_on(
    tmp_path: Path, module: str, word: str, known: tuple[str, ...], hint: str
) -> None:
    path = _file(tmp_path, module, name="own", acts_on=word)
    failures = [item.failure for item in check_file(path)[1] if not item.passed]
    assert failures == [f"acts_on is {word!r} ({hint}known: {', '.join(known)})"]
    with pytest.raises(UserError) as caught:
        effects_of_files([path])
    assert str(caught.value).startswith(f"{path}: EFFECT: {failures[0]}")


@pytest.mark.parametrize("module", ["heating", "structural.impact"])
def test_an_effect_with_the_name_of_one_of_the_program_does_not_take_its_place(tmp_path: Path, module: str) -> None:
    path = _file(tmp_path, module)
    name = module.rpartition(".")[2]
    said = f"EFFECT, name: '{name}' is already the name of an effect of the program; give this effect another name"
    with pytest.raises(UserError, match=said):
        effects_of_files([path])
    if module == "heating":
        with pytest.raises(UserError, match=said):
            load_effect_file(path)
        with pytest.raises(UserError, match=said):
            effects_named((), [path])


def test_two_files_with_one_name_are_refused(tmp_path: Path) -> None:
    paths = [_file(tmp_path, "heating", file, name="own") for file in ("one.py", "two.py")]
    for load in (lambda: effects_named((), paths), lambda: effects_of_files(paths)):
        with pytest.raises(UserError) as caught:
            load()
        said = f"{paths[1]}: EFFECT, name: 'own' is also the name of the effect in {paths[0]}"
        assert str(caught.value) == f"{said}; give this effect another name"


def test_check_finds_a_taken_name_without_running_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config, own = tmp_path / "own.yaml", tmp_path / "own.py"
    config.write_text("stages: [close-loop]\ncampaigns: {bench: laboratory, frame: null, closed_loop: null}\n")
    own.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nEFFECT = Effect(name='heating')\n")
    assert run(["check", str(config), "--set", f"close_loop.effect_files=[{own}]"]) == 2
    said = f"{own}: EFFECT, name: 'heating' is already the name of an effect of the program"
    assert said in capsys.readouterr().err
    assert not (tmp_path / "ran").exists()


def test_candidates_may_name_the_effects_of_the_user(tmp_path: Path) -> None:
    damper = _file(tmp_path, "heating", "damper.py", name="own-heating")
    assert list(effects_named(["inertia", "own-heating"], [damper])) == ["inertia", "own-heating"]
    own, _ = effects_of_files([_file(tmp_path, "structural.impact", "impact.py", name="own-impact")])
    assert list(structural_effects(["own-impact"], own)) == ["own-impact"]
    assert list(structural_effects(["joint-friction"], own)) == ["joint-friction", "own-impact"]
    assert len(structural_effects(["inertia"], own)) == len(all_structural_effects()) + 1


@pytest.mark.parametrize("rig", ["bench", "frame"])
@pytest.mark.parametrize("command", ["check", "close-loop"])
def test_an_unknown_candidate_is_named_with_its_line(
    command: str, rig: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    config, campaign = tmp_path / "own.yaml", tmp_path / "campaign.yaml"
    campaign.write_text(
        f"campaign: rig\nrig: {'damper-bench' if rig == 'bench' else 'shear-frame'}\nsampling_rate_hz: 100\n"
        "channels: {force: {column: F, unit: N}}\ntests: [{name: a, file: a.csv}]\n"
    )
    sources = {"bench": "null", "frame": "null", "closed_loop": "null", rig: "campaign.yaml"}
    config.write_text(
        f"stages: [close-loop]\ncampaigns: {{{', '.join(f'{key}: {value}' for key, value in sources.items())}}}\n"
        "close_loop:\n  candidates:\n    - inertia\n    - heatin\n"
    )
    for more in ([], ["--set", "close_loop.candidates=[heatin]"]):
        where = f"{config.name}: line 6, close_loop.candidates[1]" if not more else "--set: close_loop.candidates[0]"
        assert run([command, "--config", str(config), *more]) == 2
        assert f"{where}: no effect 'heatin'; did you mean heating?" in capsys.readouterr().err
    assert sorted(item.name for item in tmp_path.iterdir()) == ["campaign.yaml", "own.yaml"]
