"""Cross-talk that differs between tests: it must not move the poles, nor make their intervals too narrow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.clocks.delays import SensorClock, corrected
from mrpipe.modal.fit.information import information
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.fit.own_residues import with_own_residues
from mrpipe.modal.fit.projected import ProjectedFit
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import complex_modes
from tests.modal.rig import Rig, random_frame, random_test, sweep_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3, low=0.005, high=0.02)
RIG = Rig(noise=0.003, rate=100.0, sweep_s=100.0)
MODES = complex_modes(FRAME)


def _fit(crosstalk: float, seed: int, tests: int = 2, late_s: float = 0.0) -> MultiModeFit:
    rng = np.random.default_rng(seed)
    measured = [sweep_test(FRAME, rng, RIG), random_test(FRAME, rng, RIG)][:tests]
    mixed = [
        replace(test, responses=test.responses @ (np.eye(3) + crosstalk * rng.uniform(-1.0, 1.0, (3, 3))).T)
        for test in measured
    ]
    if late_s:
        mixed = [corrected(test, [_growing(test, column, late_s, rng) for column in range(3)]) for test in mixed]
    spectra = [record_spectrum(test, (0.3, 14.0)) for test in mixed]
    return fit_modes(spectra, MODES.angular_frequencies, MODES.damping_ratios)


def _growing(test: FrameTest, column: int, late_s: float, rng: np.random.Generator) -> SensorClock:
    """A clock error that no residue takes up: it grows during the test."""
    return SensorClock(test.name, test.sensors[column], 0.0, 0.0, drift=late_s * rng.uniform(-1.0, 1.0) / 100.0)


def _scores(fit: MultiModeFit) -> np.ndarray:
    """Errors of the poles over their standard errors, shape (6,)."""
    found = np.log(np.concatenate([fit.angular_frequencies, fit.damping_ratios]))
    true = np.log(np.concatenate([MODES.angular_frequencies, MODES.damping_ratios]))
    return np.asarray((found - true) / np.sqrt(np.diag(fit.covariance)))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_cross_talk_that_differs_between_tests_does_not_blur_the_poles(seed: int) -> None:
    shared = _fit(0.1, seed)
    own = with_own_residues(shared)
    assert own is not shared
    # what the tests contradict each other in is no noise of the poles
    assert np.diag(own.covariance).sum() < 0.5 * np.diag(shared.covariance).sum()
    assert np.sqrt(np.mean(_scores(own) ** 2)) < 2.0
    assert own.residues.shape == shared.residues.shape


def test_what_a_sensor_has_wrong_over_a_whole_peak_is_in_the_interval() -> None:
    scores = np.array([_scores(with_own_residues(_fit(0.1, seed, late_s=0.03))) for seed in range(6)])
    # 58 % with errors that change from line to line only; 83 % with a cluster for each of the six records
    assert np.mean(np.abs(scores) < 1.96) > 0.75


def test_tests_that_agree_keep_their_poles() -> None:
    shared = _fit(0.0, 1)
    found = with_own_residues(shared)
    assert np.array_equal(found.damping_ratios, shared.damping_ratios)
    assert found.residues == pytest.approx(shared.residues, rel=1e-3, abs=1e-4)


def test_a_single_test_has_nothing_to_contradict_it() -> None:
    shared = _fit(0.1, 1, tests=1)
    assert np.array_equal(with_own_residues(shared).angular_frequencies, shared.angular_frequencies)


def test_the_criterion_counts_the_residues_of_each_test() -> None:
    shared = _fit(0.0, 2)
    theta = np.log(np.concatenate([shared.angular_frequencies, shared.damping_ratios]))
    both = [ProjectedFit(shared.spectra, 3, separate) for separate in (False, True)]
    for fit in both:
        fit.renew_weights(theta)
    assert information(both[0], theta) < information(both[1], theta)
