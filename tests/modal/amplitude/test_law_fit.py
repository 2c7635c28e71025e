"""Columns of the fit of amplitude laws: each mode by itself equals all modes together."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.amplitude.law_fit import _common, _Record
from mrpipe.modal.amplitude.laws import AmplitudeLaws, simulated
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import shear_frame
from tests.modal.rig import Rig, sweep_test

pytestmark = pytest.mark.property

FRAME = shear_frame([6.0, 5.0], [6000.0, 5500.0], 0.01)


@pytest.fixture(scope="module")
def record():
    test = sweep_test(FRAME, np.random.default_rng(1), Rig(noise=0.01, rate=50.0, sweep_s=60.0))
    fit = fit_modes([record_spectrum(test, (0.5, 9.0))], np.array([19.0, 50.0]), np.full(2, 0.01), passes=2)
    return _Record(test, _common(fit), "test", np.ones(len(test.responses)))


@pytest.mark.parametrize("measure", ["constant", "mode", "motion"])
def test_modes_one_by_one_are_the_modes_together(record, measure):
    exponent = 0.0 if measure == "constant" else 0.1
    laws = AmplitudeLaws(
        measure,
        np.array([19.0, 50.0]),
        np.full(2, 0.01),
        np.full(2, exponent),
        np.full(2, exponent),
        np.array([1e-3, 1e-4]),
    )
    # the second pass reads what the first one stored, and a new start must not be answered by the old one
    for start in (0.0, 0.0, 0.01):
        record.initial = np.full((2, 2), start)
        whole = simulated(laws, record.forces, record.dt, record.initial)
        displacement, acceleration = record.mode_columns(laws)
        assert len(displacement) == 0
        np.testing.assert_allclose(acceleration, record.spectra(whole.acceleration), rtol=1e-12)
