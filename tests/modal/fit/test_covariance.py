"""Standard errors of poles: those of white noise, and those of errors that a sensor has over a whole peak."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.fit.covariance import clustered_covariance, pole_covariance
from mrpipe.modal.fit.projected import ProjectedFit
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import complex_modes
from tests.modal.rig import Rig, random_frame, sweep_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3, low=0.005, high=0.02)
MODES = complex_modes(FRAME)
TRUE = np.log(np.concatenate([MODES.angular_frequencies, MODES.damping_ratios]))


def _fit(noise: float) -> ProjectedFit:
    test = sweep_test(FRAME, np.random.default_rng(1), Rig(noise=noise, rate=100.0, sweep_s=60.0))
    fit = ProjectedFit([record_spectrum(test, (0.3, 14.0))], 3)
    fit.renew_weights(TRUE)
    return fit


def test_standard_errors_grow_with_the_noise() -> None:
    errors = [np.sqrt(np.diag(pole_covariance(_fit(noise), TRUE))) for noise in (0.01, 0.1)]
    assert errors[1] / errors[0] == pytest.approx(np.full(6, 10.0), rel=0.3)


def test_clusters_only_widen_and_count_as_few_degrees_of_freedom() -> None:
    fit = _fit(0.03)
    covariance, freedom = clustered_covariance(fit, TRUE)
    widened = np.diag(covariance) > np.diag(pole_covariance(fit, TRUE))
    assert np.all(np.diag(covariance) >= 0.999 * np.diag(pole_covariance(fit, TRUE)))
    # five sensors in one test
    assert np.array_equal(freedom, np.where(widened, len(fit.groups[0].sensors) - 1.0, np.inf))
