"""`check` prints the findings of the data and sees what `run` would stumble over."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from mrpipe.campaigns import TestFile, write_campaign
from mrpipe.cli import run
from mrpipe.config.loader import load_config
from mrpipe.effects.library import OF_STRUCTURE, effect_of_file
from mrpipe.effects.structural import library
from mrpipe.errors import StageSkipped, UserError
from mrpipe.stages import close_loop_frame
from mrpipe.tracing.structure.verdict import StructureTracing
from tests.campaigns.plausibility.rig import sound_tests

CONFIG = """\
name: own
stages: [prepare, assemble, identify-damper]
campaigns: {{bench: {bench}, frame: {frame}, closed_loop: null}}
"""


def project(
    directory: Path, tests: list[Any] | None = None, *, bench: str = "data", frame: str = "null", **extra: Any
) -> Path:
    """Write a bench campaign and a configuration, and return the latter."""
    write_campaign(
        directory / "data",
        campaign="own",
        rig="damper-bench",
        sampling_rate_hz=1000.0,
        channels={
            "time": ("t", "s"),
            "displacement": ("x", "m"),
            "drive": ("i", "A"),
            "force": ("F", "N"),
        },
        tests=[
            TestFile(
                test.name,
                test.role,
                {"t": test.time_s, "x": test.displacement_m, "i": test.drive, "F": test.force_n},
            )
            for test in tests or sound_tests(4)
        ],
        extra=extra,
    )
    config = directory / "own.yaml"
    config.write_text(CONFIG.format(bench=bench, frame=frame), encoding="utf-8")
    return config


def checked(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Return exit status, standard output and standard error of `mrpipe check`."""
    status = run(["check", *arguments])
    said = capsys.readouterr()
    return status, said.out, said.err


@pytest.mark.golden
def test_a_sound_project_is_valid(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = checked(capsys, str(project(tmp_path)))
    assert (status, err) == (0, "") and "valid, 3 stages" in out and "campaign bench: own: 4 tests" in out


@pytest.mark.planted
def test_errors_in_the_data_are_listed_and_exit_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tests = sound_tests(6)
    tests[3] = replace(tests[3], force_n=-tests[3].force_n)
    config = project(tmp_path, tests)
    status, out, err = checked(capsys, str(config))
    assert status == 1 and "error: test T3, force: force or displacement has the opposite sign" in out
    assert "1 error in the measured data" in err
    status, out, _ = checked(capsys, str(config), "--json")
    content = json.loads(out)
    assert status == 1 and content["valid"] is False
    (found,) = content["findings"]
    assert (found["campaign"], found["name"], found["test"]) == ("bench", "sign-reversed", "T3")


@pytest.mark.planted
def test_findings_of_the_reader_are_printed_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tests = sound_tests(4)
    tests[1] = replace(tests[1], force_n=np.clip(tests[1].force_n, -20.0, 20.0))
    _, out, _ = checked(capsys, str(project(tmp_path, tests)))
    assert "note: test T1: force looks clipped" in out


@pytest.mark.planted
def test_a_test_too_short_for_the_filters(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tests = sound_tests(4)
    short = {name: getattr(tests[1], name)[:50] for name in ("time_s", "displacement_m", "drive", "force_n")}
    tests[1] = replace(tests[1], **short)
    status, out, _ = checked(capsys, str(project(tmp_path, tests)))
    assert status == 1 and "error: test T1: has 50 samples" in out and "need 151" in out


@pytest.mark.golden
def test_an_unknown_declared_effect_names_the_nearest_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = project(tmp_path, declared_effects=["backlsh"])
    status, _, err = checked(capsys, str(config))
    assert status == 2 and "declared_effects[0]: unknown effect 'backlsh'; did you mean backlash?" in err
    assert run(["run", str(config), "--run", str(tmp_path / "run"), "--quiet"]) == 2
    assert "did you mean backlash?" in capsys.readouterr().err


@pytest.mark.golden
def test_a_bench_campaign_given_as_a_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = checked(capsys, str(project(tmp_path, bench="null", frame="data")))
    assert status == 2 and "campaigns.frame: names a damper-bench campaign" in err
    assert "name it under campaigns.bench" in err


@pytest.mark.golden
def test_no_campaign_at_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = checked(capsys, str(project(tmp_path, bench="null")))
    assert status == 2 and "no stage has data, because no bench campaign is named" in err


@pytest.mark.golden
def test_a_missing_data_file_is_one_line_in_check_and_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = project(tmp_path)
    (tmp_path / "data" / "T2.h5").unlink()
    where = ["--run", str(tmp_path / "run")]
    for command in (
        ["check", str(config)],
        ["run", str(config), *where, "--quiet"],
        ["prepare", str(config), *where, "--quiet"],
    ):
        assert run(command) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "T2.h5: data file not found" in line
    assert run(["status", "--config", str(config), str(tmp_path / "run")]) in (0, 2)
    assert len(capsys.readouterr().err.splitlines()) <= 1


@pytest.mark.golden
def test_the_configuration_is_an_argument_or_an_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = project(tmp_path)
    assert checked(capsys, "--config", str(config)) == checked(capsys, str(config))


@pytest.mark.planted
def test_a_campaign_is_checked_with_the_option_that_the_message_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    tests = sound_tests(6)
    tests[3] = replace(tests[3], force_n=-tests[3].force_n)
    project(tmp_path, tests)
    monkeypatch.chdir(tmp_path)
    for wrong in ("data", "data/campaign.yaml"):
        status, _, err = checked(capsys, wrong)
        assert status == 2 and "is a campaign and not a configuration; use --campaign data" in err
    status, out, _ = checked(capsys, "--campaign", "data")
    assert status == 1 and "error: test T3, force: force or displacement has the opposite sign" in out


@pytest.mark.golden
def test_after_a_sound_campaign_the_next_command_has_it_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = project(tmp_path)
    monkeypatch.chdir(tmp_path)
    status, out, _ = checked(capsys, config.name, "--campaign", "data")
    assert status == 0 and out.splitlines()[-1] == f"next: mrpipe run {config.name} --campaign data"


@pytest.mark.golden
def test_the_next_command_keeps_the_changed_settings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = project(tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "more.yaml").write_text("prepare: {cutoff_hz: 50}\n")
    given = ["--settings", "more.yaml", "--set", "prepare.working_rate_hz=200", "--set", "report.title=my rig"]
    kept = "--settings more.yaml --set prepare.working_rate_hz=200 --set 'report.title=my rig' --seed 7"
    status, out, _ = checked(capsys, config.name, *given, "--seed", "7")
    assert status == 0 and out.splitlines()[-1] == f"next: mrpipe run {config.name} {kept}"
    assert run(["status", "--config", config.name, *given, "--seed", "7"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"next: mrpipe run own.yaml {kept} --run runs/own"


@pytest.mark.golden
def test_the_next_command_of_status_keeps_the_campaign(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = project(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run(["status", "--config", config.name, "--campaign", "data"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "next: mrpipe run own.yaml --campaign data --run runs/own"


@pytest.mark.golden
def test_a_data_file_given_as_a_campaign(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    project(tmp_path)
    status, _, err = checked(capsys, "--campaign", str(tmp_path / "data" / "T1.h5"))
    assert status == 2 and "T1.h5: is not a campaign file, because it does not end in .yaml; name a directory" in err


@pytest.mark.golden
def test_explain_prints_no_python_objects(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = checked(capsys, str(project(tmp_path)), "--explain")
    assert status == 0 and "prepare.cutoff_hz = 100.0" in out and "name='" not in out


@pytest.mark.planted
def test_an_overload_value_is_no_measurement(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tests = sound_tests(4)
    force = tests[1].force_n.copy()
    force[777] = 9.9e37
    status, _, err = checked(capsys, str(project(tmp_path, [tests[0], replace(tests[1], force_n=force), *tests[2:]])))
    assert status == 2 and "test T1, force, row 777: is 9.9e+37, no measurement" in err


@pytest.mark.planted
def test_a_wrong_clock_is_named_once_and_not_with_every_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = project(tmp_path)
    file = tmp_path / "data" / "campaign.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    content["channels"]["time"]["unit"] = "ms"
    content.pop("sampling_rate_hz", None)
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    status, out, _ = checked(capsys, str(config))
    assert status == 1 and "a sampling rate of 1e+06 Hz is implausibly high" in out
    assert "but the filters of prepare need" not in out


TOWER = """\
name: tower
stages: [identify-frame, close-loop, report]
campaigns: {bench: null, frame: data, closed_loop: null}
"""


def tower(directory: Path, **changes: Any) -> Path:
    """Write a frame campaign of two random tests, and a configuration that traces it; return the latter."""
    rng = np.random.default_rng(7)
    (directory / "data").mkdir()
    names = ["t", "ag", "a1", "a2"]
    for name in ("one", "two"):
        rows = np.column_stack([np.arange(2000) / 200.0, rng.standard_normal((2000, 3))])
        np.savetxt(directory / "data" / f"{name}.csv", rows, delimiter=",", header=",".join(names), comments="")
    quantities = ["time", "ground_acceleration", "floor_acceleration_1", "floor_acceleration_2"]
    units = ["s", "m/s^2", "m/s^2", "m/s^2"]
    content: dict[str, Any] = {
        "campaign": "tower",
        "rig": "shear-frame",
        "frame": {"floor_masses_kg": [200, 200]},
        "channels": {q: {"column": c, "unit": u} for q, c, u in zip(quantities, names, units, strict=True)},
        "tests": [
            {"name": "one", "file": "one.csv", "kind": "random"},
            {"name": "two", "file": "two.csv", "kind": "random", "role": "validation"},
        ],
        **changes,
    }
    (directory / "data" / "campaign.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    config = directory / "tower.yaml"
    config.write_text(TOWER, encoding="utf-8")
    return config


def _tests(**second: Any) -> list[dict[str, Any]]:
    one = {"name": "one", "file": "one.csv", "kind": "random"}
    return [one, {"name": "two", "file": "two.csv", "kind": "random", **second}]


@pytest.mark.golden
def test_a_structure_that_is_traced_needs_a_validation_test(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = checked(capsys, str(tower(tmp_path, tests=_tests())))
    assert status == 1 and "no test has the role validation, so close-loop cannot judge" in out


@pytest.mark.golden
@pytest.mark.parametrize(
    ("test", "expected"),
    [
        ({"kind": "closed-loop", "law": "vdd"}, "tests[1].law: unknown control law 'vdd'; did you mean"),
        ({"kind": "closed-loop", "law": "vd", "gains": {"c": 2}}, "law vd has no gain 'c'; known: c_n_s_m"),
        ({"kind": "closed-loop", "law": "vd", "gains": {"c_n_s_m": 2.0}}, ""),
    ],
)
def test_laws_and_gains_of_recorded_tests_are_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], test: dict[str, Any], expected: str
) -> None:
    status, _, err = checked(capsys, str(tower(tmp_path, tests=_tests(role="validation", **test))))
    assert (status, err) == (0, "") if not expected else status == 2 and expected in err, err


@pytest.mark.golden
def test_recorded_tests_without_law_or_gains_are_named_and_one_campaign_is_judged_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loops = [
        {"name": name, "file": "one.csv", "kind": "closed-loop", "role": "training", **more}
        for name, more in (
            ("bare", {}),
            ("off", {"law": "passive-off"}),
            ("vd", {"law": "vd"}),
            ("known", {"law": "vd", "gains": {"c_n_s_m": 900.0}}),
        )
    ]
    config = tower(tmp_path, tests=[*_tests(role="validation"), *loops], frame={})
    text = config.read_text(encoding="utf-8")
    config.write_text(text.replace("closed_loop: null", "closed_loop: data"), encoding="utf-8")
    out = checked(capsys, str(config))[1]
    assert "campaign closed_loop: tower: 6 tests, the same as frame" in out
    assert out.count("masses of the floors are not given") == 1
    named = [line for line in out.splitlines() if "control law is not stated" in line or "gains of law" in line]
    assert len(named) == 2 and "test bare:" in named[0] and "test vd:" in named[1] and "{c_n_s_m: ...}" in named[1]


@pytest.mark.golden
def test_a_structure_without_masses_is_not_traced_and_the_rest_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tower(tmp_path, frame={})
    assert checked(capsys, str(config))[0] == 0
    context = SimpleNamespace(
        settings=SimpleNamespace(close_loop=None), inputs={"campaign:frame": tmp_path / "data"}, warn=lambda line: None
    )
    with pytest.raises(StageSkipped, match=r"masses of the floors are not given.*write frame: \{floor_masses_kg"):
        close_loop_frame.variant(load_config(config).config).run(context)  # type: ignore[union-attr, arg-type]
    # the same where a mass is unknown
    content = yaml.safe_load((tmp_path / "data" / "campaign.yaml").read_text(encoding="utf-8"))
    content["frame"] = {"floor_masses_kg": [200, None]}
    (tmp_path / "data" / "campaign.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(StageSkipped, match="or not all of them"):
        close_loop_frame.variant(load_config(config).config).run(context)  # type: ignore[union-attr, arg-type]


@pytest.mark.golden
def test_a_users_effect_on_a_damper_that_a_structure_declares_is_refused_as_by_the_stage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = Path(__file__).parents[2] / "docs" / "examples" / "seal_squeeze.py"
    config = tower(tmp_path, declared_effects=["joint-friction", "seal-squeeze"])
    setting = f"close_loop: {{effect_files: ['{own}']}}\n"
    config.write_text(config.read_text(encoding="utf-8") + setting, encoding="utf-8")
    status, _, err = checked(capsys, str(config))
    assert (
        status == 2 and "declared_effects[1]: 'seal-squeeze' of close_loop.effect_files is an effect on a damper" in err
    )
    settings = load_config(config).config
    context = SimpleNamespace(settings=settings, inputs={"campaign:frame": tmp_path / "data"}, warn=print)
    with pytest.raises(UserError) as caught:
        close_loop_frame.variant(settings).run(context)  # type: ignore[union-attr, arg-type]
    assert str(caught.value) in err
    # a file that is not declared may be there for a bench campaign, but the structure does not use it
    content = yaml.safe_load((tmp_path / "data" / "campaign.yaml").read_text(encoding="utf-8"))
    content["declared_effects"] = ["joint-friction"]
    (tmp_path / "data" / "campaign.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    status, out, _ = checked(capsys, str(config))
    assert status == 0
    assert "warning: 'seal-squeeze' of close_loop.effect_files is an effect of your own on a damper" in out
    assert "trace it on a bench campaign of the damper, or leave its file out of close_loop.effect_files" in out


@pytest.mark.golden
def test_close_loop_of_a_structure_says_that_a_users_effect_on_a_damper_is_not_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = Path(__file__).parents[2] / "docs" / "examples" / "seal_squeeze.py"
    settings = load_config(tower(tmp_path), [f"close_loop.effect_files=[{own}]"]).config
    loads: list[Path] = []

    def load(path: Path) -> object:
        loads.append(path)
        return effect_of_file(path)

    monkeypatch.setattr(library, "effect_of_file", load)
    monkeypatch.setattr("mrpipe.tracing.structure.verdict.trace_structure", lambda *_, **__: StructureTracing({}))
    monkeypatch.setattr("mrpipe.reporting.close_loop_frame.describe", lambda *_: None)
    monkeypatch.setattr(close_loop_frame, "_write", lambda *_: None)
    warnings: list[str] = []
    inputs = {"campaign:frame": tmp_path / "data"}
    rest = {"rng": None, "jobs": 1, "progress": None, "report": None}
    context = SimpleNamespace(settings=settings, inputs=inputs, warn=warnings.append, **rest)
    summary = close_loop_frame.variant(settings).run(context)  # type: ignore[union-attr, arg-type]
    assert summary == {"not_tried": {"seal-squeeze": f"it {library.NOT_TRIED}"}}
    assert f"{own}: 'seal-squeeze' is not tried: it {library.NOT_TRIED}; {library.TRACED_ON_BENCH}" in warnings
    assert loads == [own]


@pytest.mark.property
def test_effect_files_are_read_and_not_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = project(tmp_path, declared_effects=["squeeze"])
    config.write_text(config.read_text().replace("identify-damper", "identify-damper, close-loop"), encoding="utf-8")
    own = tmp_path / "squeeze.py"
    own.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nEFFECT = Effect(name='squeeze')\n", encoding="utf-8")
    arguments = (str(config), "--set", f"close_loop.effect_files=[{own}]", "--set", "close_loop.candidates=[squeeze]")
    status, out, err = checked(capsys, *arguments)
    assert (status, err) == (0, "") and "valid" in out
    assert not (tmp_path / "ran").exists()
    for content, expected in (
        ("def (", "line 1: is not Python"),
        ("x = 1", "EFFECT: is missing"),
        ("EFFECT = StructuralEffect(name='squeeze')", f"EFFECT: {OF_STRUCTURE[0]}; {OF_STRUCTURE[1]}"),
    ):
        own.write_text(content, encoding="utf-8")
        status, _, err = checked(capsys, *arguments)
        assert status == 2 and expected in err and err.count("\n") == 1


@pytest.mark.planted
def test_what_the_stages_refuse_is_an_error_of_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    constant = [replace(test, drive=np.full_like(test.drive, 0.5)) for test in sound_tests(4)]
    config = project(tmp_path, constant)
    assert checked(capsys, str(config))[0] == 0
    text = config.read_text(encoding="utf-8")
    # train-inverse alone needs prepare too
    config.write_text(text.replace("[prepare, assemble, identify-damper]", "[train-inverse]"), encoding="utf-8")
    status, out, _ = checked(capsys, str(config), "--set", "prepare.motion=displacement-and-acceleration")
    assert status == 1
    assert "error: test T0: has no acceleration, and prepare.motion is displacement-and-acceleration; give" in out
    assert "error: drive: never changes in the training tests (0.5); an inverse model needs training tests at" in out


@pytest.mark.property
@pytest.mark.parametrize("name", ["a/b", ".."])
def test_a_name_that_cannot_be_that_of_a_directory(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    config = project(tmp_path)
    config.write_text(config.read_text().replace("name: own", f"name: '{name}'"), encoding="utf-8")
    status, _, err = checked(capsys, str(config))
    assert status == 2 and f"name, {name!r}: is not the name of a directory" in err


@pytest.mark.golden
def test_a_campaign_on_the_command_line_is_what_was_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    project(tmp_path / "my rig")
    campaign = str(tmp_path / "my rig" / "data")
    status, out, _ = checked(capsys, "--campaign", campaign)
    assert status == 0 and out.startswith(f"campaign {campaign}: valid")
    assert f"next: mrpipe run --campaign '{campaign}'" in out


@pytest.mark.planted
@pytest.mark.parametrize(
    ("channel", "expected"),
    [
        ({"input_force": {"column": "g", "unit": "N"}}, "does not say on which floor the shaker acts"),
        ({"input_force": {"column": "g", "unit": "N", "floor": 5}}, "is 5; the frame has floors 1 to 2"),
        ({}, "no ground_acceleration"),
    ],
)
def test_what_the_identification_of_a_frame_refuses_is_an_error_of_check_and_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], channel: dict[str, Any], expected: str
) -> None:
    config = tower(tmp_path)
    file = tmp_path / "data" / "campaign.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    column = content["channels"].pop("ground_acceleration")["column"]
    content["channels"] |= {name: {**entry, "column": column} for name, entry in channel.items()}
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    status, out, _ = checked(capsys, str(config))
    assert status == 1 and expected in out
    assert run(["run", str(config), "--run", str(tmp_path / "run"), "--quiet"]) == 2
    assert expected in capsys.readouterr().err and not (tmp_path / "run").exists()


@pytest.mark.golden
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("file", "file: ''", "tests[0].file: is ''; the name of a data file expected"),
        ("file", "file: [a.csv]", "tests[0].file: is ['a.csv']; the name of a data file expected"),
        ("file", "", "tests[0]: is empty; write {name: ..., file: ..., role: ...}"),
        ("campaign: own", "campaign: ''", "line 1, campaign: is ''; a text that is not empty expected"),
        ("campaign: own", "campaign:", "line 1, campaign: is empty; a text expected"),
    ],
)
def test_a_name_that_is_empty_or_no_text(
    old: str, new: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = project(tmp_path)
    file = tmp_path / "data" / "campaign.yaml"
    content = file.read_text(encoding="utf-8")
    if old.startswith("file"):
        old = next(line.strip(" -") for line in content.splitlines() if "file:" in line)
    assert old in content
    file.write_text(content.replace(old, new, 1), encoding="utf-8")
    status, _, error = checked(capsys, str(config))
    assert status == 2 and said in error
