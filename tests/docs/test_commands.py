"""Every command line that the documentation shows is understood by the program, and runs on a small project."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
import typer
import yaml

from mrpipe.cli import run
from mrpipe.cli.app import app
from mrpipe.config.loader import load_config
from mrpipe.control.laws import law_names
from tests.campaigns.proposal.rigs import bench_folder, frame_folder
from tests.coarse_curves import take_coarse_curves
from tests.docs.shown import ROOT, Shown, pages, shown
from tests.small_project import MAIN_JOB

CALLS = [call for page in pages() for call in shown(page)]
PLACES = {"DIR", "FOLDER", "CONFIG", "RUN", "LAW", "NAME", "FILE", "WHAT"}
"""Words of the documentation in whose place the user puts something."""


def _place(word: str) -> bool:
    return word in PLACES or "$" in word or any(part in PLACES for part in re.split(r"[/.]", word))


def _rows() -> list[Shown]:
    return list({call.words: call for call in CALLS}.values())


@pytest.mark.property
def test_the_pages_show_commands() -> None:
    assert len(CALLS) > 80
    assert {"README.md", "docs/cluster.md", "docs/export.md", "docs/compare.md"} <= {call.page for call in CALLS}


@pytest.mark.property
@pytest.mark.parametrize("call", _rows(), ids=str)
def test_arguments_and_options_exist(call: Shown) -> None:
    group = typer.main.get_command(app)
    name, *arguments = call.words
    if name == "--version":
        assert not arguments
        return
    with group.make_context("mrpipe", [name]) as top:
        command = group.get_command(top, name)  # type: ignore[attr-defined]
        assert command is not None, f"no command {name}"
        # the name alone within a sentence, or with a word for what belongs there, is not a call
        numbers = ["7" if "$" in word and before in {"--seed", "--jobs"} else word
                   for before, word in zip(["", *arguments], arguments, strict=False)]  # fmt: skip
        missing = [item.name for item in command.params if item.required and item.param_type_name == "argument"]
        if not arguments and missing:
            return
        values = command.make_context(name, numbers, parent=top).params
    for setting in values.get("overrides") or []:
        load_config(Path("thesis"), [re.sub(r"=\[docs/", f"=[{ROOT}/docs/", setting)])
    named = [value for value in (values.get("config"), values.get("config_file")) if value is not None]
    for value in named:
        if not _place(str(value)) and str(value) not in OWN_PROJECTS and value.name != "campaign.yaml":
            load_config(Path(value))
    law = values.get("law")
    assert law is None or _place(str(law)) or set([law] if isinstance(law, str) else law) <= set(law_names())


OWN_PROJECTS = {"configs/my-rig.yaml", "configs/my-damper.yaml", "configs/my-tower.yaml"}
"""Configurations of the projects that the tutorials and the README make."""


# --- every command runs ----------------------------------------------------------------------------------------------
SMALL = {
    **MAIN_JOB,
    "name": "thesis",
    "stages": ["record-bench", "prepare", "assemble", "sweep", "train-forward", "train-inverse", "identify-damper",
               "identify-frame", "calibrate", "simulate-vd", "close-loop", "report"],
    "structure": {"storeys": [{"mass_kg": 100.0, "stiffness_n_m": 8.0e3, "repeat": 2}], "damping_ratio": [0.01]},
    "calibrate": {"neural": {"starts": 1, "iterations": 5, "amplitudes": 2, "frequencies": 2}},
    # without noise a response is periodic after one run, so that the curves of `design` take fewer runs
    "simulate": {"plant_rate_hz": 400, "controller": {"inverse": "model"},
                 "sensors": {"displacement_noise_m": 0.0, "acceleration_noise_m_s2": 0.0},
                 "excitation": {"kind": "harmonic", "cycles": 8, "settling_cycles": 4, "decay_s": 3.0}},
    "resonance": {"points": 5, "most_cycles": 20, "tolerance": 0.05, "window_cycles": 2, "most_averaged_cycles": 0},
    "design": {"laws": ["fdns"], "amplitude_factors": [1.0], "grid": 3, "evaluations": 3, "draws": 1},
    "close_loop": {"candidates": ["accumulator"], "base_forms": ["bouc-wen"], "bootstrap_draws": 50, "laws": ["vd"]},
}  # fmt: skip
"""A configuration of everything that takes seconds."""

RUN = "runs/thesis"
RUNS = {
    # as the page shows it, with names in place of capitals: what runs here, on the small configuration
    "run": "run --jobs 1",
    "status DIR": f"status {RUN}",
    "check": "check",
    "show DIR": "show data/rig",
    "show runs/my-damper": f"show {RUN}",
    "run configs/thesis.yaml --run /scratch/$USER/thesis-$SLURM_ARRAY_TASK_ID --seed 7 --jobs $SLURM_CPUS_PER_TASK "
    "--quiet": "run configs/thesis.yaml --run scratch/thesis-1 --seed 7 --jobs 1 --quiet --until record-bench",
    "run configs/thesis-gap.yaml": f"run configs/thesis-gap.yaml --run {RUN}",
    "demo": "demo --jobs 1",
    "init DIR --from ../versuche": "init first --from versuche",
    "init DIR --from FOLDER --rig both": "init second --from both --rig both",
    "status runs/demo": "status runs/demo",
    "identify-damper --config demo --json": "identify-damper --config demo --json",
    "report --summary": f"report --summary --run {RUN}",
    "compare RUN RUN": f"compare {RUN} runs/demo",
    "compare runs/before runs/after": "compare runs/before runs/after",
    "compare runs/before runs/after --plot compare.html": "compare runs/before runs/after --plot compare.html",
    "compare runs/before runs/after --plot compare": "compare runs/before runs/after --plot compare",
    "compare runs/before runs/after --json": "compare runs/before runs/after --json",
    "prepare --config CONFIG --settings RUN/corrections.yaml": f"prepare --settings {RUN}/corrections.yaml",
    "record --rig bench --settings RUN/next-tests.yaml": f"record --rig bench --settings {RUN}/next-tests.yaml",
    "close-loop --json": "close-loop --json",
    "close-loop --config configs/NAME.yaml --json": "close-loop --config configs/thesis.yaml --json",
    "close-loop --settings RUN/next-tests.yaml": f"close-loop --settings {RUN}/next-tests.yaml",
    "close-loop --campaign DIR": "close-loop --campaign data/rig",
    "close-loop --campaign DIR --set close_loop.effect_files=[docs/examples/seal_squeeze.py]": (
        "close-loop --campaign data/rig --set close_loop.effect_files=[docs/examples/seal_squeeze.py]"
    ),
    "close-loop --campaign data/$name --run /scratch/$USER/campaigns/$name --jobs 1 --quiet --json": (
        "close-loop --campaign data/rig --run runs/rig --jobs 1 --quiet --json"
    ),
    "simulate --law LAW": "simulate --law vd",
    "simulate --law LAW --resonance": "simulate --law vd --resonance",
    "simulate --law fdns --resonance --json": "simulate --law fdns --resonance --json",
    "design": "design --jobs 1",
    "simulate --law fdns --gains design": "simulate --law fdns --gains design",
    "export controller --law fdns --gains design": "export controller --law fdns --gains design",
    "export controller --law fdns": "export controller --law fdns",
    "export controller --law fdns --config thesis": "export controller --law fdns --config thesis",
    "export controller --law LAW": "export controller --law vd",
    "export damper --damper traced --format c --format matlab": (
        "export damper --damper traced --format c --format matlab"
    ),
    "design --set design.weights={rms_drift_m: 1, max_base_shear_n: 0.5} --set design.stroke_limit_m=0.01": (
        "design --jobs 1 --set 'design.weights={rms_drift_m: 1, max_base_shear_n: 0.5}' "
        "--set design.stroke_limit_m=0.01"
    ),
    "export WHAT": "export damper",
    "export damper": "export damper",
    "export frame": "export frame",
    "export inverse": "export inverse",
    "export opensees": "export opensees",
    "export all": "export all",
    "identify-frame --config structure-example": "identify-frame --config structure-example",
    "run --config two-dampers": "run --config two-dampers --jobs 1 --until calibrate",
}
"""Command line as shown -> as it runs here."""

WITH_DATA = {
    "run utfsm": "run utfsm --until prepare",
    "close-loop --config configs/utfsm.yaml --campaign configs/campaigns/utfsm-motion.yaml --json": (
        "prepare --config configs/utfsm.yaml --campaign configs/campaigns/utfsm-motion.yaml --json"
    ),
}
"""The same for those that need the public measurements."""

ELSEWHERE = {
    "tests/docs/test_tutorials.py": (
        "init my-damper --from versuche", "show data/versuche", "check configs/my-damper.yaml",
        "run configs/my-damper.yaml", "init my-tower --from frame-files", "show data/frame-files",
        "check configs/my-tower.yaml", "run configs/my-tower.yaml", "init DIR --from FOLDER",
        "init my-rig --rig both --from essais", "show data/essais-bench", "show data/essais-frame",
    ),
    "tests/stages/test_design.py": ("design --config thesis-design", "design --damper traced"),
    "tests/docs/test_readme.py": (
        "init DIR", "init my-rig", "show data/my-rig", "check configs/my-rig.yaml", "run configs/my-rig.yaml",
        "status runs/my-rig",
    ),
    "tests/cli/test_projects.py": ("run data/versuche/campaign.yaml",),
    "tests/cli/test_show.py": ("show ../versuche",),
    "tests/effects/test_checks.py": ("check-effect docs/examples/seal_squeeze.py",),
    "tests/thesis/test_stage.py": ("reproduce",),
    "tests/cli/test_benchmark_command.py": (
        "benchmark ten-storey", "benchmark ten-storey --motion elcentro",
        "benchmark base-isolated --law vdns --law fdns", "benchmark base-isolated --all",
        "benchmark wind --model published",
    ),
}  # fmt: skip
"""File of tests -> commands that it runs in the same form, or that differ only in the options of a long benchmark."""

ALONE = {"run", "check", "demo", "design", "reproduce"}
"""Commands that do something without an argument; the bare name of any other one in a text is not a call."""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project with the small configuration; configurations of the program of these names are small, too."""
    folder = tmp_path_factory.mktemp("project")
    for name, changes in {"thesis": {}, "demo": {"name": "demo"}, "thesis-gap": {}}.items():
        for place in ("configs", "bundled"):
            (folder / place).mkdir(exist_ok=True)
            if place == "bundled" or name == "thesis":
                text = yaml.safe_dump({**SMALL, **changes}, sort_keys=False)
                (folder / place / f"{name}.yaml").write_text(text, encoding="utf-8")
    for name in ("structure-example.yaml", "two-dampers.yaml", "utfsm.yaml"):
        shutil.copy(ROOT / "configs" / name, folder / "bundled" / name)
    for name in ("structures", "campaigns"):
        shutil.copytree(ROOT / "configs" / name, folder / "bundled" / name)
    shutil.copytree(ROOT / "docs" / "examples", folder / "docs" / "examples")
    shutil.copytree(bench_folder(folder / "versuche", 3, samples=800), folder / "both")
    shutil.copytree(frame_folder(folder / "turm", sweep_s=20.0), folder / "both", dirs_exist_ok=True)
    (folder / "configs" / "campaigns").symlink_to(folder / "bundled" / "campaigns")
    return folder


@pytest.fixture
def here(project: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in the project; `--config NAME` takes the small configurations."""
    monkeypatch.chdir(project)
    take_coarse_curves(monkeypatch)
    monkeypatch.setattr("mrpipe.config.loader.config_directory", lambda: project / "bundled")
    monkeypatch.setattr("mrpipe.artifacts.config_directory", lambda: project / "bundled")
    if not (project / RUN).is_dir():
        assert run(RUNS["run"].split()) == 0
        shutil.copytree(project / RUN / "campaigns" / "bench", project / "data" / "rig")
        for copy in ("demo", "before", "after", "rig"):
            shutil.copytree(project / RUN, project / "runs" / copy)
    return project


@pytest.mark.golden
@pytest.mark.parametrize("line", RUNS)
def test_command_runs(line: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert run(shlex.split(RUNS[line])) == 0, capsys.readouterr().err
    captured = capsys.readouterr()
    assert captured.out.strip() or "--quiet" in line
    if "--json" in RUNS[line]:
        assert isinstance(json.loads(captured.out), dict)


@pytest.mark.real
@pytest.mark.parametrize("line", WITH_DATA)
def test_command_runs_on_public_data(
    line: str, here: Path, public_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(WITH_DATA[line].split()) == 0, capsys.readouterr().err


@pytest.mark.property
def test_every_command_that_is_shown_is_run_by_a_test() -> None:
    listed = {*RUNS, *WITH_DATA, *(line for lines in ELSEWHERE.values() for line in lines)}
    shown_lines = {" ".join(call.words) for call in CALLS}
    calls = {line for line in shown_lines if len(line.split()) > 1 or line in ALONE} - {"--version"}
    assert sorted(calls - listed) == []
    assert sorted(listed - shown_lines) == []


@pytest.mark.property
@pytest.mark.parametrize("file", ELSEWHERE)
def test_other_files_run_what_is_listed(file: str) -> None:
    text = (ROOT / file).read_text(encoding="utf-8")
    for line in ELSEWHERE[file]:
        assert re.search(rf"\b{line.split()[0]}\b|commands\(", text), line


# --- scripts rely on what --json prints and on what artifacts hold ---------------------------------------------------
PEAKS = ("peak_rms_x_top_m", "peak_rms_a1_m_s2", "peak_rms_a_top_m_s2")
NETWORK = (
    "architecture", "training_nrmse", "validation_nrmse", "validation_fit_percent", "parameters", "iterations",
    "seconds",
)  # fmt: skip
PROMISED = {
    "identify-frame": (
        "frequencies_hz", "damping_ratios", "mode_shapes", "mass", "damping", "stiffness", "mac",
    ),
    "calibrate": (
        "omega_0", "omega_inf", "nu", "u_0", "laws.vd.c_n_s_m", "laws.vd.damping_ratio_estimate",
        "laws.vd.damping_ratio_exact",
    ),
    "simulate --law vd": (
        "law", "rms_x1_m", "rms_x_top_m", "rms_a1_m_s2", "rms_a_top_m_s2", "peak_x1_m", "peak_x_top_m", "peak_a1_m_s2",
        "peak_a_top_m_s2", "damping_ratio", "force_tracking_nrmse", "residual_force_n", "real_time_factor",
    ),
    "simulate --law vd --resonance": (
        "law", "rms_x_top_m", "resonance_rad_s", *PEAKS, "response_curve.frequency_rad_s",
        "response_curve.rms_x_top_m", "response_curve.rms_a1_m_s2", "response_curve.rms_a_top_m_s2",
    ),
    "simulate --law vd --damper traced": ("law", "rms_x_top_m"),
    "design": (
        "objective", "best", "laws.fdns.gains.alpha_n_m", "laws.fdns.peak_rms_x_top_m", "laws.fdns.resonance_rad_s",
        "laws.fdns.probability_best", "pareto", "seconds",
    ),
    "train-forward": NETWORK,
    "train-inverse": NETWORK,
    "close-loop": (
        "campaign", "model", "declared_effects", "noise_floor_nrmse", "before.nrmse", "before.fit_percent",
        "residual.structured", "residual.p_value", "residual.where.pre_yield", "residual.where.post_yield",
        "residual.where.reversal", "base_form.name", "base_form.best", "base_form.nrmse", "base_form.declared",
        "base_form.taken", "base_form.tied_with", "nuisances.gain", "nuisances.channel_skew_s",
        "nuisances.observation_filter_s", "effects", "candidates", "after.nrmse", "after.fit_percent",
        "ceiling.nrmse", "ceiling.recovered", "unexplained.structured", "unexplained.share_of_residual",
        "unexplained.depends_on", "verdict", "verdict_class",
    ),
    "status": ("stages.prepare.stale", "stages.prepare.reasons"),
}  # fmt: skip
"""Command -> keys of its JSON document."""


def _found(document: object, key: str) -> bool:
    for part in key.split("."):
        if not isinstance(document, dict) or part not in document:
            return False
        document = document[part]
    return True


@pytest.mark.golden
@pytest.mark.parametrize("line", PROMISED)
def test_json_has_the_keys_that_scripts_read(line: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert run([*line.split(), "--json", "--quiet"]) == 0
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert [key for key in PROMISED[line] if not _found(document, key)] == []


@pytest.mark.golden
def test_artifacts_describe_themselves(here: Path) -> None:
    import h5py

    needed = {"schema", "stage", "mrpipe_version", "config", "inputs", "seed", "created_utc"}
    files = sorted((here / RUN).glob("*.h5"))
    assert {"prepared.h5", "training.h5", "sweep.h5", "forward.h5", "inverse.h5", "damper.h5", "frame.h5", "control.h5",
            "response-vd.h5", "close-loop.h5", "damper-traced.h5"} <= {path.name for path in files}  # fmt: skip
    for path in files:
        with h5py.File(path) as handle:
            assert needed <= set(handle.attrs), path.name
            assert {"numpy", "scipy"} <= {name.split("_")[0] for name in handle.attrs}, path.name
            bare: list[str] = []

            def look(name: str, item: object, bare: list[str] = bare) -> None:
                if isinstance(item, h5py.Dataset) and not {"unit", "dims"} <= set(item.attrs):
                    bare.append(name)

            handle.visititems(look)
            assert bare == [], path.name


@pytest.mark.golden
def test_an_edited_effect_file_is_noticed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = "close-loop --campaign DIR --set close_loop.effect_files=[docs/examples/seal_squeeze.py]"
    line = f"{RUNS[name]} --run runs/effect --jobs 1 --quiet"
    assert run(line.split()) == 0
    file = here / "docs" / "examples" / "seal_squeeze.py"
    file.write_text(file.read_text(encoding="utf-8").replace("squeeze", "squeezing"), encoding="utf-8")
    capsys.readouterr()
    assert run(["status", "runs/effect", "--json"]) == 0
    assert "seal_squeeze.py" in str(json.loads(capsys.readouterr().out)["stages"]["close-loop"]["reasons"])
