"""Errors on validation records: noise floor, flexible model, and the states that a residual depends on."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.candidates import Surroundings
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.model import FrameModel, model_of
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.scores import (
    dependence,
    flexible_score,
    frame_score,
    noise_floor,
    residual_in_time,
    states_of,
)
from tests.tracing.structure.rig import frame_campaign

pytestmark = pytest.mark.planted


@functools.cache
def fitted(effect: str) -> tuple[FrameProblem, FrameModel]:
    data = frame_data(frame_campaign(effect))
    problem = frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)
    design = design_of("linear-frame", problem.training)
    return problem, model_of(design, (), Surroundings(problem.storey_stiffness))


def test_the_error_of_a_clean_frame_is_the_noise_floor() -> None:
    problem, model = fitted("clean")
    scale = groups_of(design_of("linear-frame", problem.training), problem.rules).scale
    score = frame_score(model, problem.validation)
    assert score.nrmse == pytest.approx(noise_floor(problem.validation, scale), rel=0.2)
    assert score.fit_percent == pytest.approx(100.0 * (1.0 - score.nrmse))
    assert score.by_test == {"random-2": pytest.approx(score.nrmse)}


def test_a_flexible_model_recovers_what_friction_leaves_and_nothing_of_noise() -> None:
    def scores(effect: str) -> tuple[float, float]:
        problem, model = fitted(effect)
        period = 1.0 / float(problem.frequencies_hz[0])
        flexible = flexible_score(model, problem.training, problem.validation, [0, 1, 2], period)
        return frame_score(model, problem.validation).nrmse, flexible

    plain, flexible = scores("joint-friction")
    assert flexible < 0.8 * plain
    plain, flexible = scores("clean")
    assert flexible > 0.97 * plain


def test_the_residual_of_a_bumper_depends_on_the_displacement_of_its_floor() -> None:
    problem, model = fitted("impact")
    (first, share), *others = dependence(model, problem.training, 1)
    assert first in ("floor displacement", "drift") and share > 0.1
    assert all(share >= value for _, value in others)
    noise = dict(dependence(*[fitted("clean")[k] for k in (1,)], fitted("clean")[0].training, 1))
    assert max(noise.values()) < 0.02


def test_states_have_the_length_of_the_record_and_slip_restarts_at_reversals() -> None:
    problem, _ = fitted("clean")
    record = problem.training[0]
    states = states_of(record, 1)
    size = len(record.motion.drift[1])
    assert {len(values) for values in states.values()} == {size}
    rate, slip = states["drift rate"], states["slip since reversal"]
    turned = np.flatnonzero(np.diff(np.sign(rate)) != 0) + 1
    assert np.abs(slip[turned]).max() < 1e-12
    assert np.all(slip * rate >= 0.0)


def test_the_residual_in_time_has_the_energy_of_its_lines() -> None:
    problem, model = fitted("joint-friction")
    record = problem.validation[0]
    force = residual_in_time(model, record)
    assert force.shape == record.motion.acceleration.shape
    lines = record.target - model.predict(record)
    assert record.lines_of(force * 0.0).shape[-1] == lines.shape[-1]
    # the taper is in the history: its mean square is that of the lines
    energy = 2.0 * record.record.dt * np.sum(force**2, axis=0)
    assert np.all(energy > 0.0)
    assert energy / energy.sum() == pytest.approx(
        np.sum(np.abs(lines) ** 2, axis=1) / np.sum(np.abs(lines) ** 2), rel=0.05
    )
