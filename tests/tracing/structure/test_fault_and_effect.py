"""A faulty sensor and a missing effect in one campaign."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.structure.fault_and_effect import without_effects
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.records import frame_data
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


def test_a_fault_alone_is_not_reported_with_an_effect() -> None:
    summary = _traced("gain", "clean").summary
    assert not summary["effects"] and summary["verdict_class"] == "unknown"
    assert summary["frame"]["sensor_fault"]["gain"] == pytest.approx(0.85, abs=0.01)


def test_the_force_of_an_effect_is_subtracted() -> None:
    found = _traced("none", "cubic-stiffness")
    rest = design_of(found.selection.base, without_effects(found.problem.training, found.selection))
    np.testing.assert_allclose(np.mean(rest.residual**2), np.mean(found.selection.residual**2), rtol=1e-3)
