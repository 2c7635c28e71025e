"""Poles that are no modes take part in later fits of the modes, if the data support them."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.fit.information import poles_of_fit
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.fit.own_residues import with_own_residues
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import complex_modes
from tests.modal.rig import Rig, random_frame, random_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3, low=0.005, high=0.02)
MODES = complex_modes(FRAME)
RIG = Rig(noise=0.003, rate=100.0, sweep_s=40.0)
TESTS = [random_test(FRAME, np.random.default_rng(seed), RIG) for seed in (1, 2)]
SPECTRA = [record_spectrum(test, (0.3, 14.0)) for test in TESTS]
WHOLE = fit_modes(SPECTRA, MODES.angular_frequencies, MODES.damping_ratios, passes=2, evaluations=8)


@pytest.mark.parametrize("left", [0, 2])
def test_the_response_of_a_pole_that_is_no_mode_is_not_attributed_to_the_modes(left: int) -> None:
    modes = [mode for mode in range(3) if mode != left]
    found = with_own_residues(WHOLE.only(modes))
    whole = with_own_residues(WHOLE)
    assert found.angular_frequencies == pytest.approx(whole.angular_frequencies[modes], rel=1e-9)
    assert found.residues == pytest.approx(whole.residues[:, modes], rel=1e-4)
    both = [*modes, *(mode + 3 for mode in modes)]
    assert np.diag(found.covariance) == pytest.approx(np.diag(whole.covariance)[both], rel=1e-2)
    assert np.exp(poles_of_fit(found, SPECTRA)[2]) == pytest.approx(WHOLE.angular_frequencies[left], rel=1e-3)


def test_a_pole_that_the_data_do_not_support_takes_no_part() -> None:
    empty = 0.5 * (MODES.angular_frequencies[1] + MODES.angular_frequencies[2])
    more = fit_modes(SPECTRA, np.append(MODES.angular_frequencies, empty), np.append(MODES.damping_ratios, 0.003))
    spurious = int(np.argmin(np.abs(more.angular_frequencies - empty)))
    modes = more.only([pole for pole in range(4) if pole != spurious])
    assert modes.other_poles.shape == (2, 1)
    assert poles_of_fit(modes, SPECTRA).size == 6


def test_a_pole_beyond_the_band_takes_no_part() -> None:
    low = [item.below(0.5 * float(MODES.angular_frequencies[1:].sum())) for item in SPECTRA]
    assert poles_of_fit(WHOLE.only([0, 1]), low).size == 4
