"""Towers that are not shear frames: band, weights and noise of a general linear frame."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy import linalg

from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.bending import bounded, natural_frequencies
from mrpipe.tracing.structure.coordinates import Weighting
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.sensor_noise import Noise
from mrpipe.tracing.structure.spectra import storey_sums
from tests.tracing.structure.towers import MASSES, RATE, stiffness_of, tower_records


@functools.cache
def _problem(kind: str, noise: float = 0.005) -> FrameProblem:
    records = tower_records(kind, noise)
    return frame_problem(records[:2], records[2:], MASSES)


@pytest.mark.planted
def test_the_residual_of_a_wall_is_noise_in_a_band_that_contains_its_modes() -> None:
    """With band and weights of a shear frame, lines of the residual of a bending wall exceed the noise."""
    problem = _problem("wall", 0.002)
    assert problem.bends and not np.any(groups_of(design_of("linear-frame", problem.training)).flagged)
    # the third mode lies just above the excitation of up to 40 Hz
    second = float(np.sqrt(linalg.eigh(stiffness_of("wall"), np.diag(MASSES), eigvals_only=True)[1]) / 2.0 / np.pi)
    assert problem.band.low_hz < 2.5 and problem.band.high_hz > 1.3 * second


@pytest.mark.planted
def test_a_shear_frame_keeps_band_and_weights_of_its_storeys() -> None:
    problem = _problem("shear")
    assert not problem.bends and not np.any(problem.weighting.ground)


@pytest.mark.property
def test_the_natural_frequencies_of_a_linear_frame_come_out() -> None:
    stiffness = stiffness_of("wall and frame")
    expected = np.sqrt(linalg.eigh(stiffness, np.diag(MASSES), eigvals_only=True)) / 2.0 / np.pi
    weighting = Weighting.of_displacements(storey_sums(len(MASSES)) @ stiffness)
    assert natural_frequencies(weighting, MASSES) == pytest.approx(expected, rel=1e-6)


@pytest.mark.property
def test_noise_that_was_taken_too_large_is_lowered_to_the_residual() -> None:
    problem = _problem("shear")
    true = np.full(len(MASSES) + 1, 2.0 * 0.005**2 / RATE)
    loud = np.where(np.arange(true.size) == 2, 25.0, 1.0) * true
    found = bounded(problem.training[0], Noise(loud, {}, rate_hz=RATE), MASSES)
    assert found.acceleration[2] < 6.0 * true[2]
    assert np.all(found.acceleration >= 0.5 * true)
