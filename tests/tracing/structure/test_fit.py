"""Least squares on the storeys' equations of motion: what is solved for is what was planted."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.fit import Columns, Design, base_rows, coefficients, design_of, predicted, solve
from mrpipe.tracing.structure.records import frame_data
from tests.tracing.structure.rig import DAMPERS, STOREYS, frame_campaign

pytestmark = pytest.mark.property


@functools.cache
def problem() -> FrameProblem:
    data = frame_data(frame_campaign("clean"))
    return frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)


@functools.cache
def design() -> Design:
    return design_of("shear-frame", problem().training)


def planted(seed: int = 1, storey: int = 1) -> list[Columns]:
    """Return lines of a random force in one storey of each record, of the size of the residual."""
    rng = np.random.default_rng(seed)
    found = []
    for item in problem().training:
        lines = np.zeros((1, *item.target.shape), dtype=complex)
        size = item.target.shape[1]
        lines[0, storey] = (rng.standard_normal(size) + 1j * rng.standard_normal(size)) / item.weight[storey]
        found.append(Columns(lines))
    return found


def test_stiffness_and_damping_of_a_clean_frame_come_out() -> None:
    found = coefficients(design(), None, np.zeros(0))
    assert len(found) == len(STOREYS)
    for storey, numbers in enumerate(found):
        # the shear force that inertia shows acts against drift and drift rate
        assert numbers[0] == pytest.approx(-STOREYS[storey], rel=1e-3)
        velocities = np.zeros(len(STOREYS))
        velocities[storey] = -DAMPERS[storey]
        if storey:
            velocities[storey - 1] = DAMPERS[storey]
        assert numbers[1 : 1 + len(STOREYS)] == pytest.approx(velocities, abs=0.05)


def test_the_residual_of_a_clean_frame_is_noise_and_orthogonal_to_the_regressors() -> None:
    found = design()
    # below 1, because the weights contain a floor for errors of clocks and gains, which this rig has not
    assert 0.4 < found.chi_square < 1.1
    for storey, basis in enumerate(found.basis):
        assert np.abs(basis.T @ found.residual[storey]).max() < 1e-6 * np.linalg.norm(found.residual[storey])
        assert basis.T @ basis == pytest.approx(np.eye(basis.shape[1]), abs=1e-9)


def test_what_the_linear_frame_can_be_is_projected_away() -> None:
    drift = []
    for item in problem().training:
        lines = np.zeros((1, *item.target.shape), dtype=complex)
        lines[0, 2] = 50.0 * base_rows("shear-frame", item, 2)[0]
        drift.append(Columns(lines))
    left = design().project(drift)
    assert np.linalg.norm(left) < 1e-6 * np.linalg.norm(drift[0].lines * problem().training[0].weight)
    other = design().project(planted())
    assert np.linalg.norm(other[:, 1]) > 0.9 * np.linalg.norm(
        np.concatenate([item.lines[0, 1] * s.weight[1] for item, s in zip(planted(), problem().training, strict=True)])
    )
    assert np.all(other[:, [0, 2]] == 0.0)


@pytest.mark.parametrize("amplitude", [0.4, 2.5])
def test_amplitudes_are_solved_for_and_none_is_negative(amplitude: float) -> None:
    columns = [design().project(planted(seed)) for seed in (1, 2)]
    projected = np.concatenate(columns)
    changed = Design(
        design().base, design().spectra, design().residual + amplitude * columns[0][0] - columns[1][0],
        design().basis, design().solvers, design().free,
    )  # fmt: skip
    found = solve(changed, projected)
    assert found.amplitudes[0] == pytest.approx(amplitude, abs=0.1)
    assert found.amplitudes[1] == 0.0
    assert found.chi_square < changed.chi_square


def test_a_prediction_is_the_sum_of_frame_and_effect() -> None:
    record, linear = problem().validation[0], coefficients(design(), None, np.zeros(0))
    alone = predicted("shear-frame", record, linear, None, np.zeros(0))
    error = np.linalg.norm((record.target - alone) * record.weight) / np.linalg.norm(record.target * record.weight)
    assert error < 0.1
    lines = np.ones((1, *record.target.shape), dtype=complex)
    both = predicted("shear-frame", record, linear, Columns(lines), np.array([3.0]))
    assert both - alone == pytest.approx(np.full(record.target.shape, 3.0 + 0j))


def test_a_force_that_is_linear_in_the_motion_gets_no_amplitude() -> None:
    """The elastic-plastic force of a storey that never yields is a spring; rounding errors are no evidence for it."""
    found = design_of("linear-frame", problem().training)
    columns = []
    for item in problem().training:
        lines = np.zeros((1, *item.target.shape), dtype=complex)
        lines[0, 1] = item.lines_of(item.motion.displacement[:, 1] * 1e3)
        columns.append(Columns(lines))
    projected = found.project(columns)
    assert not np.any(projected)
    assert solve(found, projected).amplitudes.tolist() == [0.0]
