"""The code version of a stage holds everything of the program that its result depends on, and nothing else."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mrpipe
from mrpipe.pipeline.code_version import code_version, forget
from mrpipe.stages.registry import all_stages

PACKAGE = Path(mrpipe.__file__).resolve().parent
CLOSE_LOOP = "mrpipe.stages.close_loop"
STRUCTURE = "mrpipe.stages.close_loop_frame"


def _modules(folder: str) -> set[str]:
    names = (path.stem for path in (PACKAGE / folder).glob("*.py") if path.stem != "__init__")
    return {".".join(["mrpipe", *folder.split("/"), name]) for name in names}


@pytest.mark.property
@pytest.mark.parametrize(
    ("stage", "folder"),
    [
        ("mrpipe.stages.identify_damper", "dampers/forms"),
        (CLOSE_LOOP, "effects"),
        (STRUCTURE, "effects"),
        (STRUCTURE, "effects/structural"),
    ],
)
def test_tracing_depends_on_every_effect(stage: str, folder: str) -> None:
    assert _modules(folder) <= set(code_version(stage))


@pytest.mark.property
@pytest.mark.parametrize(
    ("module", "file"),
    [
        ("mrpipe.stages.export_controller", "mrpipe/exports/controller_template.c"),
        ("mrpipe.stages.simulate", "configs/dampers/set-c.yaml"),
        ("mrpipe.stages.simulate", "configs/frames/thesis.yaml"),
        ("mrpipe.stages.record", "configs/dampers/set-c.yaml"),
        ("mrpipe.stages.benchmark_ten_storey", "configs/structures/ten-storey.yaml"),
        ("mrpipe.stages.identify_frame", "configs/frames/geometry.yaml"),
    ],
)
def test_files_of_the_program_count(module: str, file: str) -> None:
    assert file in code_version(module)


@pytest.mark.property
def test_a_training_depends_on_no_figure_no_effect_and_no_structure() -> None:
    version = code_version("mrpipe.stages.train_forward")
    assert "mrpipe.networks.training" in version
    assert not [name for name in version if name.startswith(("mrpipe.reporting", "mrpipe.effects", "configs/"))]


@pytest.mark.property
def test_the_function_of_every_stage_is_in_its_own_code_version() -> None:
    for stage in all_stages().values():
        assert stage.run.__module__.startswith("mrpipe.stages."), stage.name
        assert stage.run.__module__ in code_version(stage.run.__module__)


@pytest.mark.property
def test_modules_that_walk_packages_or_read_files_of_the_program_say_so() -> None:
    walks = re.compile(r"iter_modules|walk_packages|import_module\(|\b__file__\b")
    # the registry of stages, configurations and the compiler are not part of a result; two compute the versions
    spared = {
        "stages/registry.py",
        "config/model.py",
        "artifacts/resources.py",
        "pipeline/code_version.py",
        "pipeline/compile_ahead.py",
        "numba_cache.py",
    }
    silent = [
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if walks.search(text := path.read_text()) and "LOADS_FROM" not in text
    ]
    # these import at first use what they also name under TYPE_CHECKING, where the scan sees it
    lazy = {"control/__init__.py", "simulation/__init__.py", "structures/__init__.py"}
    assert set(silent) - spared - lazy == set(), (
        "declare LOADS_FROM = (...) there: packages or files loaded at run time"
    )


@pytest.mark.property
def test_a_module_in_a_folder_that_was_appended_to_a_package_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    import mrpipe.effects

    own = tmp_path / "own_effect.py"
    own.write_text("EFFECT = None\n")
    request.addfinalizer(forget)
    monkeypatch.setattr(mrpipe.effects, "__path__", [*mrpipe.effects.__path__, str(tmp_path)])
    forget()
    before = code_version(CLOSE_LOOP)["mrpipe.effects.own_effect"]
    own.write_text("EFFECT = 1\n")
    forget()
    assert code_version(CLOSE_LOOP)["mrpipe.effects.own_effect"] != before


@pytest.mark.property
def test_an_effect_that_is_edited_or_added_makes_the_tracing_stale(tmp_path: Path) -> None:
    copy = tmp_path / "mrpipe"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    if not (copy / "_configs").is_dir():
        shutil.copytree(PACKAGE.parent / "configs", tmp_path / "configs")

    def version() -> dict[str, str]:
        code = (
            "import json\nfrom mrpipe.pipeline.code_version import code_version\n"
            f"print(json.dumps({{name: code_version(name) for name in ({STRUCTURE!r}, 'mrpipe.stages.prepare')}}))"
        )
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
        return dict(json.loads(done.stdout))

    versions = [version()]
    (copy / "effects/heating.py").write_text((copy / "effects/heating.py").read_text() + "\n")
    versions.append(version())
    (copy / "effects/structural/own.py").write_text("EFFECT = None\n")
    versions.append(version())
    assert versions[0][STRUCTURE] != versions[1][STRUCTURE] != versions[2][STRUCTURE]
    assert "mrpipe.effects.structural.own" in versions[2][STRUCTURE]
    assert versions[0]["mrpipe.stages.prepare"] == versions[2]["mrpipe.stages.prepare"]
