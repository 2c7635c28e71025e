"""Stiffness that changes between tests: by their order, by the amplitude, or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.structures import modal_damping_matrix, shear_frame
from mrpipe.structures.response import linear_response
from mrpipe.tracing.structure.base import frame_problem, ladder
from mrpipe.tracing.structure.candidates import Surroundings
from mrpipe.tracing.structure.drift import StiffnessBetweenTests, stiffness_between_tests
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.records import frame_data

RATE, SECONDS = 100.0, 20.0
MASSES = [6.0, 5.5, 5.0]
STOREYS = np.array([9000.0, 8000.0, 7000.0])


def _between(
    factors: list[float], levels: list[float], seed: int = 0, *, storey: int = 0, highest: Sequence[float] = ()
) -> StiffnessBetweenTests:
    """Tests of random ground motion on a frame whose stiffness, or that of one storey, has another factor in each test.

    `highest` is the highest frequency of the ground motion in each test [Hz].
    """
    rng = np.random.default_rng(seed)
    time = np.arange(int(SECONDS * RATE)) / RATE
    recordings = []
    for number, (factor, level) in enumerate(zip(factors, levels, strict=True)):
        changed = np.where(np.arange(3) == storey - 1, factor, 1.0) if storey else factor
        frame = shear_frame(MASSES, STOREYS * changed, [0.01, 0.012, 0.015])
        frame = replace(frame, damping=modal_damping_matrix(frame.mass, frame.stiffness, [0.01, 0.012, 0.015]))
        tones = rng.uniform(0.8, highest[number] if highest else 12.0, 80)
        motion = np.sum(np.sin(2 * np.pi * tones[:, None] * time + rng.uniform(0, 7, (80, 1))), axis=0) / 7.0
        ground = level * motion * np.clip(np.minimum(time, SECONDS - 5.0 - time), 0.0, 1.0)
        response = linear_response(frame, ground, 1 / RATE)
        channels = {"ground_acceleration": ground + 0.004 * rng.standard_normal(time.size)}
        for k in range(3):
            seen = response.absolute_acceleration[:, k]
            channels[f"floor_acceleration_{k + 1}"] = seen + 0.004 * rng.standard_normal(time.size)
        role = "validation" if number == 2 else "training"
        segments = ((0, time.size),)
        recordings.append(Recording(f"test-{number + 1}", role, RATE, time, channels, segments, "random", {}))
    campaign = Campaign("own", "shear-frame", Path("nowhere"), tuple(recordings), floor_masses_kg=tuple(MASSES))
    data = frame_data(campaign)
    problem = frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)
    design = ladder(problem.training)["shear-frame"]
    model = model_of(design, (), Surroundings(problem.storey_stiffness, problem.rules))
    known = {item.record.name: item for item in (*problem.training, *problem.validation)}
    return stiffness_between_tests(model, [known[item.name] for item in recordings], problem.rules)


@pytest.mark.planted
def test_a_frame_that_loosens_from_test_to_test_drifts() -> None:
    found = _between([1.0, 0.988, 0.98, 0.968, 0.962, 0.95], [0.5, 0.3, 0.5, 0.4, 0.3, 0.5])
    assert found.kind == "drift"
    assert found.change == pytest.approx(-0.05, abs=0.01)
    changes = np.array([item.change for item in found.tests])
    assert changes - changes[0] == pytest.approx([0.0, -0.012, -0.02, -0.032, -0.038, -0.05], abs=0.006)
    assert "drifts from test test-1 to test-6" in found.finding()


@pytest.mark.planted
def test_a_bolt_that_comes_loose_is_a_step() -> None:
    found = _between([1.0, 1.0, 1.0, 0.95, 0.95, 0.95, 0.95], [0.5, 0.3, 0.4, 0.4, 0.3, 0.5, 0.4])
    assert found.kind == "step"
    assert found.step_before == "test-4"
    assert found.change == pytest.approx(-0.05, abs=0.008)


@pytest.mark.planted
def test_one_storey_that_loosens_is_named() -> None:
    """Tests with different spectra weight the storeys differently: the change of all storeys together scattered."""
    factors, highest = [1.0, 0.994, 0.988, 0.982, 0.976, 0.97], [3.0, 12.0, 4.0, 12.0, 3.0, 12.0]
    found = _between(factors, [0.4, 0.3, 0.5, 0.4, 0.3, 0.5], storey=2, highest=highest)
    assert (found.kind, found.storey) == ("drift", 2)
    assert found.change == pytest.approx(-0.03, abs=0.006)
    assert "the stiffness of storey 2 drifts from test test-1 to test-6 by -" in found.finding()


@pytest.mark.planted
def test_one_storey_with_a_loose_bolt_is_named() -> None:
    found = _between([1.0, 1.0, 1.0, 0.94, 0.94, 0.94], [0.5, 0.3, 0.4, 0.4, 0.3, 0.5], storey=3)
    assert (found.kind, found.storey, found.step_before) == ("step", 3, "test-4")
    assert found.change == pytest.approx(-0.06, abs=0.01)


@pytest.mark.planted
def test_softening_with_amplitude_is_no_drift() -> None:
    levels = [0.2, 0.6, 0.3, 0.8, 0.25, 0.5]
    found = _between([1.0 - 0.03 * np.log(level / 0.2) for level in levels], levels)
    assert found.kind == "amplitude"
    assert found.finding() == ""


@pytest.mark.planted
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_frame_that_stays_the_same_does_not_drift(seed: int) -> None:
    found = _between([1.0] * 5, [0.5, 0.3, 0.4, 0.6, 0.2], seed)
    assert not found.drifts
    assert max(abs(item.change) for item in found.tests) < 0.01


@pytest.mark.planted
def test_three_tests_are_too_few() -> None:
    assert _between([1.0, 0.95, 0.9], [0.4, 0.4, 0.4]).kind == "constant"
