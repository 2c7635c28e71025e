"""Only the report of a run that recomputes the thesis cites its figures."""

from __future__ import annotations

import ast
import logging
from pathlib import Path

import pytest

import mrpipe.reporting
from mrpipe.config.loader import LoadedConfig
from mrpipe.config.model import config_model
from mrpipe.pipeline.manifest import Manifest, StageKey
from mrpipe.pipeline.parts import PartWriter
from mrpipe.pipeline.report import run_facts
from mrpipe.pipeline.runner import Pipeline
from mrpipe.reporting.style import figure_with_axes
from mrpipe.stages.registry import all_stages
from mrpipe.thesis.figures import CORRESPONDING, with_citations

pytestmark = pytest.mark.property


def _texts(tree: ast.AST) -> list[str]:
    """Return the texts of a module that are shown, which docstrings are not."""
    documented = (ast.Module, ast.FunctionDef, ast.ClassDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return [str(node.value) for node in found if id(node) not in docstrings]


def test_no_section_of_the_report_cites_the_thesis() -> None:
    folder = Path(mrpipe.reporting.__file__).parent
    texts = {path.name: _texts(ast.parse(path.read_text(encoding="utf-8"))) for path in folder.rglob("*.py")}
    assert len(texts) > 20
    cited = {name: text for name, lines in texts.items() for text in lines if "thesis " in text.lower()}
    assert cited == {}


def test_citations_belong_to_stages_that_exist() -> None:
    assert [name for name in CORRESPONDING if not any(name.startswith(f"{stage}-") for stage in all_stages())] == []


def test_a_citation_ends_the_caption() -> None:
    items = [
        {"kind": "figure", "file": "figures/assemble-history.svg", "caption": "History."},
        {"kind": "table", "file": "tables/assemble-joins.csv", "caption": "Joins."},
        {"kind": "text", "text": "x"},
    ]
    found = with_citations(items)
    assert [item.get("caption") for item in found] == ["History (thesis Figure 2.11 b).", "Joins.", None]


@pytest.mark.parametrize(("stages", "cited"), [(["assemble"], False), (["assemble", "reproduce"], True)])
def test_the_configuration_decides_on_citations(tmp_path: Path, stages: list[str], cited: bool) -> None:
    part = PartWriter("assemble", tmp_path)
    part.figure("history", figure_with_axes()[0], "History.")
    part.save()
    Manifest("assemble", StageKey({}, {}, {}, 0), {}, {"training_samples": 1}).save(tmp_path / "manifests")
    settings = {"stages": stages, "campaigns": {"bench": None, "frame": None, "closed_loop": None}}
    loaded = LoadedConfig(config_model().model_validate(settings), tmp_path / "config.yaml")
    pipeline = Pipeline(loaded, all_stages(), tmp_path, logging.getLogger("test"), quiet=True)
    (stage,) = run_facts(pipeline).stages
    assert ("thesis" in stage.items[0]["caption"]) == cited
