"""A faulty sensor and a missing effect in one campaign."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules, TracingOptions
from mrpipe.tracing.structure.base import frame_problem
from mrpipe.tracing.structure.choice import without_effects
from mrpipe.tracing.structure.fault_and_effect import _recorded_error, _sufficient, _with_weights_of
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.judgement import why_unnamed
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.rounds import FrameSelection
from mrpipe.tracing.structure.scores import frame_score
from mrpipe.tracing.structure.sensor_faults import SensorFault
from mrpipe.tracing.structure.trace import FrameTracing, trace_frame
from tests.tracing.structure.test_sensor_faults import faulty_campaign

pytestmark = pytest.mark.planted


@functools.cache
def _traced(fault: str, effect: str) -> FrameTracing:
    known = [all_structural_effects()[name] for name in ("cubic-stiffness", "joint-friction")]
    data = frame_data(faulty_campaign(fault, effect))
    options = TracingOptions(most_effects=2, bootstrap_draws=50)
    return trace_frame(data, known, [], options, most=2, draws=50, rng=np.random.default_rng(3))


@pytest.mark.parametrize(
    ("fault", "gain", "test"),
    [
        ("gain", 0.85, None),
        ("sign in one test", -1.0, "sweep-1"),
        ("exchanged", 1.0, "sweep-1"),
        ("exchanged in all tests", 1.0, None),
    ],
)
def test_the_fault_and_the_effect_are_both_reported(fault: str, gain: float, test: str | None) -> None:
    summary = _traced(fault, "cubic-stiffness").summary
    assert [(item["name"], item["place"]) for item in summary["effects"]] == [("cubic-stiffness", "storey 2")]
    assert summary["effects"][0]["confidence"] <= 0.6
    found = summary["frame"]["sensor_fault"]
    assert found["test"] == test and found["gain"] == pytest.approx(gain, abs=0.01)
    assert summary["verdict_class"] == "partly explained" and "floor_acceleration_" in summary["verdict"]
    assert summary["after"]["nrmse"] < 0.5 * summary["before"]["nrmse"]
    assert all(item["nrmse_after"] < item["nrmse_before"] for item in summary["tests"])


def test_both_errors_have_the_weights_of_the_corrected_records() -> None:
    """A sensor that reads too much also seems to have more noise, which would make the error before look small."""
    found = _traced("gain", "cubic-stiffness")
    data = frame_data(faulty_campaign("gain", "cubic-stiffness"))
    recorded = frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)
    (own,) = _with_weights_of(found.problem.validation, found.problem, recorded.validation)
    (corrected,) = found.problem.validation
    np.testing.assert_array_equal(own.weight, corrected.weight)
    assert np.max(np.abs(own.target - corrected.target)) > 0.0
    assert found.summary["before"]["nrmse"] == _recorded_error(recorded, found.problem, found.selection).nrmse
    # records that need no correction have the same error with their own weights
    same = _recorded_error(found.problem, found.problem, found.selection)
    known = model_of(found.selection.design, (), found.selection.about)
    assert same.nrmse == pytest.approx(frame_score(known, found.problem.validation).nrmse, rel=1e-9)


def test_a_fault_alone_is_not_reported_with_an_effect() -> None:
    summary = _traced("gain", "clean").summary
    assert not summary["effects"] and summary["verdict_class"] == "unknown"
    assert summary["frame"]["sensor_fault"]["gain"] == pytest.approx(0.85, abs=0.01)


def test_the_force_of_an_effect_is_subtracted() -> None:
    found = _traced("none", "cubic-stiffness")
    rest = design_of(found.selection.base, without_effects(found.problem.training, found.selection))
    np.testing.assert_allclose(np.mean(rest.residual**2), np.mean(found.selection.residual**2), rtol=1e-3)


def test_what_an_effect_leaves_where_it_acts_is_its_form() -> None:
    """The fault leaves a residual in all storeys, and the effect explains only a part of that of storey 2."""
    found = _traced("gain", "cubic-stiffness")
    design = design_of("linear-frame", _traced("gain", "clean").problem.training)
    recorded = FrameSelection("linear-frame", design, groups_of(design), {})
    strict = NamingRules(named_share=1.0)
    part = replace(found.selection, residual=found.selection.residual.copy())
    part.residual[1] += 0.3 * (found.selection.design.residual[1] - part.residual[1])
    assert strict.least_share < part.share(part.residual) < strict.named_share
    assert _sufficient(part, recorded, strict)
    # without a fault, the other storeys have no residual that correcting a sensor would explain
    assert not _sufficient(part, found.selection, strict)
    flagged = replace(part.groups, flagged=np.ones_like(part.groups.flagged))
    elsewhere = replace(part, residual=part.residual.copy(), groups=flagged)
    elsewhere.residual[2] *= 5.0
    assert elsewhere.share(elsewhere.residual) > strict.least_share
    assert not _sufficient(elsewhere, recorded, strict)


def test_no_effect_is_named_if_a_fault_explains_more() -> None:
    selection = _traced("none", "cubic-stiffness").selection
    share = selection.share(selection.residual)
    more, less = (SensorFault(1, gain=1.2, gain_error=0.01, explained=share + change) for change in (0.01, -0.01))
    assert why_unnamed(selection, NamingRules()) == why_unnamed(selection, NamingRules(), less) == ""
    said = why_unnamed(selection, NamingRules(), more)
    assert "floor_acceleration_1 has a gain of 1.2 in all tests" in said and "cubic-stiffness" in said
