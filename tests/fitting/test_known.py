"""A search that begins at an earlier fit of the form ends where the search from the library's starts ends."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.dampers.library import base_form
from mrpipe.dampers.model import write_damper
from mrpipe.fitting import engine, solution
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.known import known_start, read_known
from mrpipe.fitting.start import fit_with_form, with_form
from tests.tracing.bench.fits import plain_fit


@pytest.mark.property
@pytest.mark.parametrize("form", ["dahl", "bouc-wen-stiffness"])
def test_a_known_start_changes_nothing_but_the_speed(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    solved = []
    plain = solution.run_recordings
    monkeypatch.setattr(solution, "run_recordings", lambda *given: solved.append(1) or plain(*given))
    found = plain_fit("accumulator")
    # an earlier fit with other weights, as identify-damper makes it
    flat = replace(found.problem, root_weight=(found.problem.root_weight > 0.0) / found.problem.scales.force)
    earlier = fit_with_form(engine.fit(flat, found.theta), base_form(form))
    solved.clear()
    ends = fit_with_form(found, base_form(form), starts=1, iterations=20)
    effort = len(solved)
    solved.clear()
    again = fit_with_form(found, base_form(form), iterations=20, known={form: damper_model(earlier, "A")})
    assert len(solved) < effort
    assert again.chi_square == pytest.approx(ends.chi_square, rel=0.01)
    assert again.base_values == pytest.approx(ends.base_values, rel=0.05, abs=1e-9)


@pytest.mark.property
def test_a_coupled_form_reads_the_known_laws_and_a_form_of_another_file_is_not_known() -> None:
    found = plain_fit("accumulator")
    form = base_form("bouc-wen-stiffness")
    problem = with_form(found, form)
    model = damper_model(fit_with_form(found, form), "A")
    begun = known_start(problem, {form.name: model})
    assert begun is not None
    drive = np.linspace(0.0, 4.0, 9)
    for block, law in zip(form.blocks, begun[0].reference, strict=True):
        assert law(drive) == pytest.approx(model.law(block)(drive))
    assert known_start(problem, {}) is None
    assert known_start(problem, {form.name: replace(model, form_file="mine.py")}) is None


@pytest.mark.property
def test_the_fit_to_all_samples_counts_where_an_artifact_has_both(tmp_path: Path) -> None:
    model = damper_model(plain_fit("accumulator"), "A")
    other = replace(model, parameters={**model.parameters, "yield_displacement": 0.5})
    with ArtifactWriter.create(tmp_path / "damper.h5", Provenance("identify-damper", "", {}, 0)) as artifact:
        write_damper(artifact, model, "forms/bouc-wen")
        write_damper(artifact, other, "ranked/bouc-wen")
        write_damper(artifact, replace(other, form="dahl"), "ranked/dahl")
    known = read_known(Artifact(tmp_path / "damper.h5"))
    assert known["bouc-wen"].parameters == pytest.approx(dict(model.parameters))
    assert known["dahl"].form == "dahl"
    assert known["dahl"].parameters["yield_displacement"] == 0.5
