"""Every fault of a configuration is one line with file, line and key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mrpipe.artifacts import config_directory
from mrpipe.config.loader import load_config
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

FAULTS = {
    "unknown section": ("prepair:\n  order: 2\n", "line 1, prepair: unknown key; did you mean prepare?"),
    "unknown key": (
        "name: x\nprepare:\n  cutof_hz: 100\n",
        "line 3, prepare.cutof_hz: unknown key; did you mean cutoff_hz?",
    ),
    "key with no near one": ("zzzqqq: 1\n", "line 1, zzzqqq: unknown key; known: "),
    "wrong type": ("seed: many\n", "line 1, seed: is 'many'; a whole number expected"),
    "out of range": (
        "execution:\n  jobs: -2\n",
        "line 2, execution.jobs: is -2; a value greater than or equal to 0 expected",
    ),
    "key twice": ("seed: 1\nname: x\nseed: 2\n", "line 3, seed: appears already in line 1; keep one of the two"),
    "no YAML": ("seed: [1\n", "not valid YAML"),
    "decimal comma": (
        "prepare:\n  cutoff_hz: 12,5\n",
        "line 2, prepare.cutoff_hz: is '12,5'; a number expected; write a decimal point, as in 12.5",
    ),
    "decimal comma in braces": ("prepare: {cutoff_hz: 12,5}\n", "a decimal number has a point and no comma"),
    "true for a number": ("prepare: {cycles: true}\n", "prepare.cycles: is true; a number expected"),
    "infinite number": ("prepare: {cutoff_hz: .inf}\n", "line 1, prepare.cutoff_hz: is inf; a finite number expected"),
    "number beyond every range": ("prepare: {cutoff_hz: 1e400}\n", "prepare.cutoff_hz: is '1e400'; a finite number"),
    "seed too large": ("seed: 9223372036854775808\n", "line 1, seed: is 9223372036854775808; a value less than or"),
    "empty section": ("prepare:\n", "line 1, prepare: is empty; a mapping of keys to values expected"),
    "wrong end of a damper": (
        "structure: {dampers: [{between: [1.5, ground]}]}\n",
        "line 1, structure.dampers[0].between[0]: is 1.5; a text expected; put it in quotes",
    ),
    "no stage": ("stages: []\n", "line 1, stages: is []; a list of at least 1 value expected"),
    "stage twice": ("stages: [prepare, assemble, prepare]\n", "prepare is listed more than once"),
    "no mapping": ("- a\n- b\n", "line 1: is not a mapping; write `key: value` lines"),
    "section is a number": ("prepare: 3\n", "line 1, prepare: is 3; a mapping of keys to values expected"),
    "code in YAML": (
        "name: !!python/object/apply:os.system ['true']\n",
        "not valid YAML (could not determine a constructor",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_one_line_with_place(fault: str, tmp_path: Path) -> None:
    text, expected = FAULTS[fault]
    path = tmp_path / "config.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as caught:
        load_config(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert expected in message
    assert "\n" not in message


OVERRIDES = {
    "prepare.cutof_hz=80": "--set: prepare.cutof_hz: unknown key; did you mean cutoff_hz?",
    "cutoff_hz=4": "--set: cutoff_hz: unknown key; did you mean prepare.cutoff_hz?",
    "architecture=[4]": "unknown key; name the section: train_forward.architecture, train_inverse.architecture",
    "prepare": "--set: prepare: is not an assignment; write section.key=value",
    "seed=many": "--set: seed: is 'many'; a whole number expected",
    "train_inverse.architecture=[12, six]": "train_inverse.architecture[1]: is 'six'; a whole number expected",
    "train_inverse.architecture=[0]": "--set: train_inverse.architecture[0]: is 0; a value greater than 0 expected",
    "train_inverse.architecture=best": "train_inverse.architecture: is 'best'; 'thesis' or 'sweep' expected",
    "identify_damper.form=bouc-wenn": "no base form 'bouc-wenn'; did you mean bouc-wen",
    "sweep.strats=3": "--set: sweep.strats: unknown key; did you mean starts?",
    "sweep.neurons=[0]": "--set: sweep.neurons[0]: is 0; a value greater than 0 expected",
    "sweep.layers=[]": "--set: sweep.layers: is []; a list of at least 1 value expected",
    "design.amplitude_factors=[0]": "--set: design.amplitude_factors[0]: is 0; a value greater than 0 expected",
    "resonance.amplitude_factors=[0]": "--set: resonance.amplitude_factors[0]: is 0; a value greater than 0 expected",
    "design.laws=[vdd]": "--set: design.laws: is ['vdd']; no such control law; one of vd,",
    "seed=[1": "--set: seed=[1: value: not valid YAML",
}


@pytest.mark.parametrize("override", OVERRIDES)
def test_fault_of_an_override_names_the_option(override: str, tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_text("name: x\n", encoding="utf-8")
    with pytest.raises(UserError) as caught:
        load_config(path, [override])
    assert OVERRIDES[override] in str(caught.value)


def test_override_wins_over_the_file(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text("seed: 1\nprepare:\n  cutoff_hz: 90\n", encoding="utf-8")
    config = load_config(path, ["prepare.cutoff_hz=80", "seed=7"]).config
    assert (config.prepare.cutoff_hz, config.seed, config.name) == (80, 7, "rig")


def test_missing_file_names_those_that_come_along(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no such configuration; give a YAML file, or one of .*thesis"):
        load_config(tmp_path / "none.yaml")


def test_a_misspelt_name_names_the_nearest_configuration() -> None:
    with pytest.raises(UserError, match=r"thesi: no such configuration; did you mean thesis\?"):
        load_config(Path("thesi"))


def test_a_misspelt_file_names_the_nearest_of_the_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "configs").mkdir()
    (tmp_path / "configs" / "my-damper.yaml").write_text("seed: 1\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    meant = re.escape(str(Path("configs/my-damper.yaml")))
    for wrong in ("configs/my-dampr.yaml", "my-damper", "my-damper.yaml"):
        with pytest.raises(UserError, match=rf"no such configuration; did you mean {meant}\?"):
            load_config(Path(wrong))
    with pytest.raises(UserError, match=rf"give a YAML file, or one of {meant}, .*thesis"):
        load_config(Path("configs/zzzzzz.yaml"))


def test_file_that_is_not_text(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_bytes(b"\xff\xfe\x00seed")
    with pytest.raises(UserError, match="is not UTF-8 text; save it as UTF-8"):
        load_config(path)


def test_campaign_path_is_relative_to_the_configuration(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_text("campaigns:\n  bench: data/rig\n", encoding="utf-8")
    assert load_config(path).config.campaigns.bench == str(tmp_path / "data/rig")


@pytest.mark.parametrize("path", sorted(config_directory().glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_configuration_is_valid(path: Path) -> None:
    assert load_config(path).config.name == path.stem


def test_settings_are_laid_over_the_configuration(tmp_path: Path) -> None:
    path, over = tmp_path / "config.yaml", tmp_path / "over.yaml"
    path.write_text("name: x\nprepare: {order: 3, cycles: 4}\nstages: [prepare]\n", encoding="utf-8")
    over.write_text("prepare: {cycles: 5, corrections: {force_offset_n: {a: 1.5}}}\n", encoding="utf-8")
    config = load_config(path, ["prepare.cycles=6"], [over]).config
    assert (config.prepare.order, config.prepare.cycles) == (3, 6)
    assert config.prepare.corrections.force_offset_n == {"a": 1.5}
    assert config.stages == ("prepare",)


def test_fault_of_settings_laid_over_names_their_file(tmp_path: Path) -> None:
    path, over = tmp_path / "config.yaml", tmp_path / "over.yaml"
    path.write_text("name: x\n", encoding="utf-8")
    over.write_text("laboratory:\n  bench:\n    tests:\n    - {name: a, motion: sinus}\n", encoding="utf-8")
    with pytest.raises(UserError) as caught:
        load_config(path, [], [over])
    assert str(caught.value).startswith(f"{over}: line 4, laboratory.bench.tests[0].motion: is 'sinus'")
    with pytest.raises(UserError, match=r"--settings: nowhere\.yaml: no such file"):
        load_config(path, [], [Path("nowhere.yaml")])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("prepare: {cutoff_hz: 1,5}\n", "some.yaml: line 1, prepare[5]: 5 is a number in place of a name"),
        ("prepare: {cutof_hz: 1}\n", "some.yaml: line 1, prepare.cutof_hz: unknown key"),
        (
            "export: {prefix: 3x}\n",
            "some.yaml: line 1, export.prefix: is '3x'; a name of letters, digits and _ expected",
        ),
        ("name: a\n", "config.yaml: line 1, prepare.order: is 'x'; a whole number expected"),
    ],
)
def test_a_fault_is_named_in_the_file_that_has_it(content: str, said: str, tmp_path: Path) -> None:
    config, overlay = tmp_path / "config.yaml", tmp_path / "some.yaml"
    wrong = "x" if "config.yaml" in said else "4"
    config.write_text(f"prepare: {{order: {wrong}}}\n", encoding="utf-8")
    overlay.write_text(content, encoding="utf-8")
    with pytest.raises(UserError) as refused:
        load_config(config, [], [overlay])
    assert said in str(refused.value)
