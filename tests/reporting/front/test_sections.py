"""Sections before the appendix, and the page at phone, laptop and print width."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.dampers.model import write_damper
from mrpipe.reporting.facts import RunFacts
from mrpipe.reporting.front import tables
from mrpipe.reporting.front.sections import _residual, sections
from mrpipe.reporting.page import first_screen, write_report
from tests.exports.test_models import with_effect
from tests.reporting.front.run import EFFECT, run_in, tracing

pytestmark = pytest.mark.property

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def test_sections_answer_in_order(tmp_path: Path) -> None:
    found = {section.anchor: section for section in sections(run_in(tmp_path))}
    assert list(found) == ["result", "trust", "damper", "structure", "control", "next"]
    figures = {
        anchor: [item["name"] for item in section.items if item["kind"] == "figure"]
        for anchor, section in found.items()
    }
    assert figures["result"] == ["errors", "loop", "laws"]
    assert "residual" in figures["damper"]
    assert figures["structure"] == ["shapes"]
    assert figures["control"] == ["cycles"]


def test_unit_newton_per_ampere_is_not_read_as_missing(tmp_path: Path) -> None:
    (path,) = write_report(run_in(tmp_path), ["html"])
    assert "<td>N per A</td>" in path.read_text(encoding="utf-8")


def test_report_of_a_bench_alone_has_no_empty_sections(tmp_path: Path) -> None:
    facts = run_in(tmp_path)
    bench = [stage for stage in facts.stages if stage.name in ("prepare", "identify-damper", "close-loop")]
    for path in tmp_path.glob("response-*.h5"):
        path.unlink()
    alone = type(facts)(tmp_path, "bench", "", bench)
    assert [section.anchor for section in sections(alone)] == ["result", "trust", "damper", "next"]


def test_the_command_that_applies_corrections_names_the_file_with_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    facts = run_in(tmp_path / "runs", tracing(corrections={"found": True, "file": "corrections.yaml"}))
    texts = [item["text"] for item in sections(facts)[-1].items if item["kind"] == "text"]
    assert any("`mrpipe run --settings runs/corrections.yaml`, with the same" in text for text in texts)


def test_first_screen_in_the_terminal_has_no_marks(tmp_path: Path) -> None:
    lines = first_screen(run_in(tmp_path))
    assert lines[0] == "my-rig"
    assert "mrpipe" in lines[1]
    assert any(line.startswith("Missing") and "accumulator" in line for line in lines)
    assert not any("**" in line for line in lines)
    narrow = first_screen(run_in(tmp_path), columns=60)
    assert max(map(len, narrow)) <= 60
    assert " ".join(" ".join(narrow).split()) == " ".join(" ".join(lines).split())


def test_html_is_small_and_offline(tmp_path: Path) -> None:
    (path,) = write_report(run_in(tmp_path), ["html"])
    text = path.read_text(encoding="utf-8")
    assert len(text) < 2e6
    assert re.findall(r"(?:src|href)=['\"]https?:", text) == []
    assert text.count("<svg") == text.count("</svg>") >= 8
    assert "@media print" in text


@pytest.mark.skipif(BROWSER is None, reason="needs Chromium")
@pytest.mark.parametrize("width", [390, 1440])
def test_page_does_not_scroll_sideways(tmp_path: Path, width: int) -> None:
    (path,) = write_report(run_in(tmp_path), ["html"])
    probe = "<script>document.title = 'W' + document.documentElement.scrollWidth + 'V' + innerWidth</script></body>"
    path.write_text(path.read_text(encoding="utf-8").replace("</body>", probe), encoding="utf-8")
    done = _browse(path, f"--window-size={width},900", "--dump-dom")
    found = re.search(r"<title>W(\d+)V(\d+)</title>", done.stdout)
    assert found is not None
    assert int(found[1]) <= int(found[2])


@pytest.mark.skipif(BROWSER is None, reason="needs Chromium")
def test_print_has_at_most_twelve_pages_before_the_appendix(tmp_path: Path) -> None:
    (path,) = write_report(run_in(tmp_path), ["html"])
    _browse(path, "--no-pdf-header-footer", f"--print-to-pdf={tmp_path / 'report.pdf'}")
    pages = len(re.findall(rb"/Type\s*/Page[^s]", (tmp_path / "report.pdf").read_bytes()))
    assert 1 <= pages <= 12


def _browse(path: Path, *options: str) -> subprocess.CompletedProcess[str]:
    assert BROWSER is not None
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", *options, path.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_report_of_a_structure_alone_lists_its_effects_with_the_structure(tmp_path: Path) -> None:
    facts = run_in(tmp_path, tracing(parts={"frame": {}}, model="linear-frame"))
    (tmp_path / "close-loop.h5").unlink()
    for path in tmp_path.glob("response-*.h5"):
        path.unlink()
    # the histories of a structure lie in a group for each validation test
    with ArtifactWriter.create(tmp_path / "close-loop.h5", Provenance("close-loop")) as artifact:
        artifact.put("validation/sweep2/drift", np.zeros((50, 3)), unit="m", dims=("sample", "storey"))
    frame = [stage for stage in facts.stages if stage.name in ("identify-frame", "close-loop")]
    found = {section.anchor: section for section in sections(type(facts)(tmp_path, "tower", "", frame))}
    assert "damper" not in found
    assert {item["name"] for item in found["structure"].items if item["kind"] == "table"} >= {"modes", "effects"}


def test_a_range_over_the_storeys_is_no_interval_of_a_parameter() -> None:
    force = {"value": 14.1, "unit": "N", "interval": [0.0, 14.1], "interval_kind": "range", "by_storey": [0.0, 14.1]}
    (row,) = tables.effects([{**EFFECT, "place": "storey 2", "parameters": {"force": force}}]).to_dict("records")
    assert (row["value"], row["from"], row["to"]) == ("14.1", "-", "")
    force |= {"interval": [12.0, 16.0], "interval_kind": "confidence"}
    (row,) = tables.effects([{**EFFECT, "parameters": {"force": force}}]).to_dict("records")
    assert (row["from"], row["to"]) == ("12.0", "16.0")


def test_a_form_that_no_table_of_candidates_has_is_explained(tmp_path: Path) -> None:
    facts = run_in(tmp_path, tracing(effects=[{**EFFECT, "form": "gas"}]))
    (found,) = [section for section in sections(facts) if section.anchor == "damper"]
    text = " ".join(str(item.get("text", "")) for item in found.items)
    assert "**accumulator** (form gas)" in text
    assert "best single form, linear. Once it was named, all its forms were fitted again, and gas did better." in text


def test_modes_without_matrices_are_not_compared_with_a_model(tmp_path: Path) -> None:
    def columns() -> list[str]:
        structure = next(section for section in sections(facts) if section.anchor == "structure")
        return next(list(item["frame"]) for item in structure.items if item.get("name") == "modes")

    facts = run_in(tmp_path)
    assert "MAC of the model" in columns()
    summary = next(stage.summary for stage in facts.stages if stage.name == "identify-frame")
    summary["stiffness"] = None
    assert "MAC of the model" not in columns()


def test_the_parameters_of_the_traced_model_are_a_table(tmp_path: Path) -> None:
    form = {"declared": "dahl", "taken": "bouc-wen", "tied_with": [], "nrmse": {"dahl": 0.08, "bouc-wen": 0.02}}
    facts = run_in(tmp_path, tracing(base_form=form))
    damper = with_effect("heating", "cooling")
    with ArtifactWriter.create(tmp_path / "close-loop.h5", Provenance("close-loop")) as artifact:
        write_damper(artifact, damper)
    found = {section.anchor: section for section in sections(facts)}
    tables = {item["name"]: item for item in found["damper"].items if item["kind"] == "table"}
    shown = tables["traced"]["frame"]
    assert set(shown["part"]) == {"bouc-wen", "heating"}
    assert len(shown) == len(damper.parameters) + len(damper.effects[0].values)
    assert "base form bouc-wen" in tables["traced"]["caption"]
    forms = next(item["frame"] for item in found["trust"].items if item.get("name") == "forms")
    assert forms["note"].tolist() == ["in the final model", "declared"]


def test_terms_that_are_not_proven_are_said_where_their_parameters_stand(tmp_path: Path) -> None:
    """The table of the final model had listed them, and gave the effects other values than the table above."""
    term = {"name": "inertia", "form": "mass", "confidence": 0.12, "tied_with": []}
    for terms, said in (([term], True), ([], False)):
        facts = run_in(tmp_path, tracing(further_terms=terms))
        with ArtifactWriter.create(tmp_path / "close-loop.h5", Provenance("close-loop")) as artifact:
            write_damper(artifact, with_effect("heating", "cooling"))
        texts = _damper_texts(facts)
        assert ("In addition, inertia (mass, probability 0.12)" in texts) is said
        assert ("a little from above" in texts) is said


def test_a_damper_without_drive_has_no_largest_drive(tmp_path: Path) -> None:
    """The report had said `drive up to 1.00 A` of a friction damper: the limit is a placeholder there."""
    facts = run_in(tmp_path)
    assert "drive up to 2.00 A." in _damper_texts(facts)
    facts.summary("identify-damper")["without_drive"] = True  # type: ignore[index]
    assert "all tests without drive." in _damper_texts(facts)


def _damper_texts(facts: RunFacts) -> str:
    (section,) = [item for item in sections(facts) if item.anchor == "damper"]
    return " ".join(str(item.get("text", "")) for item in section.items)


def test_the_drive_of_the_residual_has_the_unit_of_its_data(tmp_path: Path) -> None:
    with ArtifactWriter.create(tmp_path / "close-loop.h5", Provenance("close-loop")) as artifact:
        for name in ("measured", "before", "after", "displacement", "velocity", "time"):
            artifact.put(f"validation/{name}", np.arange(3.0), unit="1", dims=("sample",))
        artifact.put("validation/drive", np.arange(3.0), unit="V", dims=("sample",))
    variables, _, _ = _residual(Artifact(tmp_path / "close-loop.h5"))
    assert "drive [V]" in [name for name, _ in variables]


@pytest.mark.golden
def test_declared_effects_are_said_where_their_parameters_stand(tmp_path: Path) -> None:
    """The table of the final model had listed a declared effect without a word on where it comes from."""
    for names, said in ((["backlash"], "The campaign declares backlash; this effect is part of the model"), ([], "")):
        facts = run_in(tmp_path, tracing(declared_effects=names))
        with ArtifactWriter.create(tmp_path / "close-loop.h5", Provenance("close-loop")) as artifact:
            write_damper(artifact, with_effect("heating", "cooling"))
        texts = _damper_texts(facts)
        assert said in texts and ("declares" in texts) is bool(names)
