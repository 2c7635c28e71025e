"""The notebooks run, their results are those that the text states, and the short way is short."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

NOTEBOOKS = Path(__file__).parents[2] / "docs" / "notebooks"
NAMES = sorted(path.name for path in NOTEBOOKS.glob("*.ipynb"))


def executed(name: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    nbformat = pytest.importorskip("nbformat", reason="needs nbclient")
    client = pytest.importorskip("nbclient", reason="needs nbclient")
    pytest.importorskip("ipykernel", reason="needs ipykernel")
    root = str(NOTEBOOKS.parents[1])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([root, os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("PYDEVD_DISABLE_FILE_VALIDATION", "1")
    notebook = nbformat.read(NOTEBOOKS / name, as_version=4)
    place = {"metadata": {"path": str(NOTEBOOKS)}}
    return client.NotebookClient(notebook, timeout=900, kernel_name="python3", resources=place).execute()


def text_of(notebook: Any) -> str:
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(str(output.get("text", "")) for output in outputs)


@pytest.mark.golden
def test_own_damper(monkeypatch: pytest.MonkeyPatch) -> None:
    text = text_of(executed("own-damper.ipynb", monkeypatch))
    assert "bouc-wen: validation NRMSE 0.11" in text
    score = float(text.split("R2 on the validation tests: ")[1].split()[0])
    assert score > 0.9
    assert "damper.c" in text and "forward.c" in text


@pytest.mark.golden
def test_own_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    text = text_of(executed("own-frame.ipynb", monkeypatch))
    assert "3 floors; modes and damping: 1.49" in text
    assert "vd: rms x_top" in text


@pytest.mark.planted
def test_tracing_and_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    text = text_of(executed("tracing-and-loop.ipynb", monkeypatch))
    assert "accumulator: explains what is missing" in text
    assert "vd: rms x_top" in text


@pytest.mark.property
def test_from_csv_to_traced_damper_and_loop_takes_at_most_15_lines() -> None:
    nbformat = pytest.importorskip("nbformat", reason="needs nbclient")
    notebook = nbformat.read(NOTEBOOKS / "tracing-and-loop.ipynb", as_version=4)
    cells = [cell.source for cell in notebook.cells if "mrpipe.trace(" in cell.source]
    assert len(cells) == 1 and "load_campaign" in cells[0] and "mrpipe.simulate(" in cells[0]
    assert len([line for line in cells[0].splitlines() if line.strip()]) <= 15


@pytest.mark.property
@pytest.mark.parametrize("name", NAMES)
def test_notebooks_show_their_results_and_no_paths_of_a_machine(name: str) -> None:
    nbformat = pytest.importorskip("nbformat", reason="needs nbclient")
    notebook = nbformat.read(NOTEBOOKS / name, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert any("image/png" in output.get("data", {}) for cell in code for output in cell.outputs)
    assert not any(output.output_type == "error" for cell in code for output in cell.outputs)
    text = (NOTEBOOKS / name).read_text(encoding="utf-8")
    assert not any(part in text for part in ("/home/", "/root/", "/tmp/", "/work/"))
