"""The code on the pages about real-time targets and clusters compiles against what mrpipe exports, or parses."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from mrpipe.control import ControllerOptions, Gains, build_controller, inverse_table
from mrpipe.exports.controller import controller_files
from mrpipe.exports.damper import damper_subject
from mrpipe.exports.library import write_export
from tests.dampers.test_forms import model
from tests.exports.building import compiler

DOCS = Path(__file__).parents[2] / "docs"


def blocks(page: str, language: str) -> list[str]:
    return re.findall(
        rf"^```{language}\n(.*?)^```", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )


@pytest.mark.golden
def test_c_code_of_the_page_on_targets_compiles(tmp_path: Path) -> None:
    damper = model("bouc-wen")
    controller = build_controller("fdns", Gains(alpha_n_m=3000.0), ControllerOptions(), inverse=inverse_table(damper))
    for name, text in controller_files(controller, "mrpipe", {}).items():
        (tmp_path / name).write_text(text)
    write_export(damper_subject(damper), tmp_path, ["c"])
    step, change, force = blocks("real-time-target.md", "c")
    declared = "double read_displacement_m(void), read_acceleration_m_s2(void);\nvoid write_drive(double drive);\n"
    for name, code in {
        "step": f"{declared}{step}",
        "change": f'#include "controller.h"\nvoid tune(void);\nvoid tune(void)\n{{\n{change}}}\n',
        "force": force,
    }.items():
        (tmp_path / f"{name}.c").write_text(code)
        flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
        subprocess.run([compiler(), *flags, f"{name}.c"], cwd=tmp_path, check=True)


@pytest.mark.golden
def test_scripts_of_the_page_on_clusters_parse() -> None:
    shell = shutil.which("bash")
    if shell is None:
        pytest.skip("no bash here")
    scripts = blocks("cluster.md", "bash")
    assert len(scripts) >= 4
    for script in scripts:
        subprocess.run([shell, "-n", "-c", script], check=True)


@pytest.mark.golden
@pytest.mark.parametrize("page", ["export.md", "cluster.md", "real-time-target.md"])
def test_commands_of_the_pages_have_options_that_exist(page: str) -> None:
    from mrpipe.cli.document import as_markdown

    known = set(re.findall(r"`(--[a-z-]+)", as_markdown()))
    lines = re.sub(r"\\\n\s*", " ", (DOCS / page).read_text(encoding="utf-8")).splitlines()
    calls = [line for line in lines if re.match(r"\s*(\$ )?mrpipe [a-z]", line)]
    used = {option for line in calls for option in re.findall(r"(?<=\s)(--[a-z-]+)", line)}
    assert used - known == set()
