"""Size of a signal, and of an error in relation to it."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.signals.error_size import nrmse, rms

pytestmark = pytest.mark.property


def test_the_rms_of_a_sine_is_its_amplitude_over_the_root_of_two() -> None:
    assert rms(3.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False))) == pytest.approx(3.0 / np.sqrt(2.0))
    assert rms(np.zeros(0)) == 0.0


def test_the_nrmse_of_a_gain_error_is_the_gain_error_whatever_the_size_of_the_signal() -> None:
    signal = np.random.default_rng(1).standard_normal(500)
    for size in (1e-6, 1.0, 1e6):
        assert nrmse(0.1 * size * signal, size * signal) == pytest.approx(0.1, rel=1e-12)
    assert nrmse(np.zeros(5), np.zeros(5)) == 0.0
