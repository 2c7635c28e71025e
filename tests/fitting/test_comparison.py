"""Forms compared, and the stage that does it."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance, no_progress
from mrpipe.config.sections.identify_damper import IdentifyDamperSettings
from mrpipe.dampers.hysteresis import YIELD_DISPLACEMENT
from mrpipe.dampers.library import base_form
from mrpipe.dampers.model import read_damper
from mrpipe.dampers.parameters import Parameter
from mrpipe.errors import StageSkipped
from mrpipe.fitting.comparison import FitOptions, JudgedFit, best_by_folds, compare_forms
from mrpipe.fitting.form_fit import FitMethod
from mrpipe.fitting.samples import smooth_motion
from mrpipe.fitting.scoring import PooledScore
from mrpipe.fitting.summary import findings
from mrpipe.pipeline.stage import StageContext
from mrpipe.signals.prepared import write_prepared
from mrpipe.stages.identify_damper import STAGE
from tests.dampers.planted import set_c_campaign


@pytest.fixture(scope="module")
def campaign():
    return set_c_campaign()


class Report:
    """Keeps what a stage reports."""

    def __init__(self):
        self.parts = []

    def text(self, paragraph):
        self.parts.append(("text", paragraph))

    def table(self, name, frame, caption):
        self.parts.append(("table", name))

    def figure(self, name, figure, caption):
        self.parts.append(("figure", name))


def run_stage(directory: Path, tests, **settings):
    directory.mkdir(exist_ok=True)
    with ArtifactWriter.create(directory / "prepared.h5", Provenance("prepare")) as artifact:
        write_prepared(artifact, tests)
    report = Report()
    context = StageContext(
        stage="identify-damper",
        settings=SimpleNamespace(identify_damper=IdentifyDamperSettings(**settings)),
        inputs={"prepare": directory / "prepared.h5"},
        run_directory=directory,
        rng=np.random.default_rng(0),
        seed=0,
        jobs=1,
        progress=no_progress,
        report=report,
        log=logging.getLogger("test"),
        provenance=Provenance("identify-damper"),
    )
    return STAGE.run(context), context, report


@pytest.mark.planted
def test_the_planted_form_is_best_on_left_out_and_on_unseen_tests(campaign):
    tests = smooth_motion(campaign)
    names = ("rounded-yield", "bouc-wen", "dahl", "bingham")
    options = FitOptions(FitMethod(starts=1), maximum_samples=4000)
    judged = compare_forms([base_form(name) for name in names], tests, options, folds=3, keep=names).judged
    by_fold = best_by_folds(judged)
    # rounded-yield holds Bouc-Wen and fits as well: the rule is what tells them apart
    assert by_fold.fit.form.name == "bouc-wen"
    assert by_fold.validation.nrmse < 0.5 * min(item.validation.nrmse for item in judged[2:])
    # left-out stretches are noisier than nothing and close to the training error of a form that is right
    assert by_fold.training.nrmse < 1.1 * by_fold.cross_validated_nrmse < 1.5 * by_fold.training.nrmse


@pytest.mark.property
def test_the_stage_returns_and_stores_what_it_found(tmp_path, campaign):
    summary, context, report = run_stage(
        tmp_path, campaign, compare=("bouc-wen", "bingham"), starts=1, maximum_samples=4000
    )
    json.dumps(summary, allow_nan=False)
    assert summary["form"] == "bouc-wen"
    assert summary["validation_nrmse"] < 0.02
    assert summary["validation_fit_percent"] > 98.0
    assert [row["form"] for row in summary["comparison"]] == ["bouc-wen", "bingham"]
    assert summary["parameters"]["eta"]["unit"] == "1/s"
    assert summary["parameters"]["eta"]["standard_error"] > 0.0
    assert summary["thesis_parameters"]["gamma"]["unit"] == "1/m^2"
    assert len(summary["tests"]) == len(campaign)
    model = read_damper(Artifact(tmp_path / "damper.h5"))
    assert {name: row["value"] for name, row in summary["parameters"].items()} == dict(model.parameters)
    assert read_damper(Artifact(tmp_path / "damper.h5"), "forms/bingham").form == "bingham"
    assert {name for kind, name in report.parts if kind == "figure"} == {"loops", "comparison", "yield-force"}
    assert {name for kind, name in report.parts if kind == "table"} >= {"parameters", "comparison", "tests"}
    assert context.warnings == []


def judged(names: tuple[str, ...], left_out: tuple[float, ...]) -> JudgedFit:
    """A cross-validated form of which nothing counts but its parameters and its errors on tests left out."""
    fit = SimpleNamespace(names=names, values=dict.fromkeys(names[:2]))
    score = PooledScore(0.0, 0.0, 0.0)
    return JudgedFit(fit, (), score, score, 0.0, left_out)  # type: ignore[arg-type]


@pytest.mark.property
def test_every_test_left_out_counts_alike():
    plain = judged(("a", "b", "c"), (0.14, 0.13, 0.09, 0.10))
    # better where the force is strong, worse by as much where it is weak: no reason for another form
    strong = judged(("a", "b", "c", "d"), (0.18, 0.17, 0.07, 0.075))
    assert best_by_folds([strong, plain]) is plain
    clear = judged(("a", "b", "c", "d"), (0.10, 0.11, 0.07, 0.08))
    assert best_by_folds([plain, strong, clear]) is clear
    with pytest.raises(ValueError, match="cross-validated"):
        best_by_folds([plain, judged(("a",), ())])


@pytest.mark.planted
def test_gamma_is_beta_where_the_loops_do_not_tell(campaign):
    """Bounds that leave out the truth by a hair: the share ends there and gains nothing."""
    tests = smooth_motion(campaign)
    narrow = replace(
        base_form("bouc-wen"),
        parameters=(YIELD_DISPLACEMENT, Parameter("gamma_share", "1", "share", "one", 0.505, 0.56, (0.53,))),
    )
    item = compare_forms([narrow], tests, FitOptions(FitMethod(starts=1), maximum_samples=2000)).judged[0]
    assert item.fit.model.parameters["gamma_share"] == 0.5
    assert "gamma_share" not in item.fit.names
    assert "gamma = beta is taken" in findings(item.fit)[-1]


@pytest.mark.property
def test_the_best_form_and_other_settings(tmp_path, campaign):
    summary, _, _ = run_stage(
        tmp_path,
        campaign,
        form="best",
        compare=("dahl", "bingham"),
        starts=1,
        maximum_samples=2000,
        force="raw",
        equal_tests=True,
        offset_per_test=False,
        smooth_motion=False,
        reference_A=500.0,
        folds=2,
    )
    assert summary["form"] == "dahl"
    assert all(row["cross_validated_nrmse"] is not None for row in summary["comparison"])
    assert summary["thesis_parameters"]["A"]["value"] == 500.0


@pytest.mark.property
def test_constant_drive_is_said(tmp_path, campaign):
    constant = [test for test in campaign if np.ptp(test.drive) == 0.0]
    _, context, _ = run_stage(tmp_path, constant, compare=("bouc-wen",), starts=1, maximum_samples=2000)
    assert any("does not determine its lag" in line for line in context.warnings)
    assert any("3 levels of drive" in line for line in context.warnings)


@pytest.mark.property
def test_nothing_to_fit_is_skipped(tmp_path, campaign):
    with pytest.raises(StageSkipped, match="no training test"):
        run_stage(tmp_path, [test for test in campaign if test.role == "validation"])
