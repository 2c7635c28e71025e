"""Tests of a structure that changed between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.sessions import difference, odd_tests, own_fits, poles_of_tests, with_spread
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import complex_modes
from tests.modal.rig import Rig, random_frame, sweep_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3)
NAMES = ("a", "b", "c")


def _test(name: str, seed: int, factor: float) -> FrameTest:
    frame = replace(FRAME, stiffness=factor * FRAME.stiffness)
    rig = Rig(noise=0.01, rate=100.0, sweep_s=80.0)
    return replace(sweep_test(frame, np.random.default_rng(seed), rig), name=name)


def _fit(*factors: float) -> MultiModeFit:
    tests = [_test(name, seed, factor) for seed, (name, factor) in enumerate(zip(NAMES, factors, strict=False))]
    modes = complex_modes(FRAME)
    spectra = [record_spectrum(test, (0.5, 14.0)) for test in tests]
    return fit_modes(spectra, modes.angular_frequencies, modes.damping_ratios)


def test_tests_of_one_structure_agree() -> None:
    poles = poles_of_tests(_fit(1.0, 1.0, 1.0))
    assert poles is not None and not poles.differ(range(3)) and odd_tests(poles) == ()
    assert poles_of_tests(_fit(1.0)) is None


def test_the_test_of_a_softer_structure_is_named() -> None:
    fit = _fit(1.0, 0.96, 1.0)
    poles = poles_of_tests(fit)
    assert poles is not None and poles.differ(range(3)) and odd_tests(poles) == (1,)
    assert "test b (-2" in difference(NAMES, poles, (1,))
    alone = own_fits(fit, poles)[1]
    expected = np.sqrt(0.96) * complex_modes(FRAME).angular_frequencies
    assert alone.angular_frequencies == pytest.approx(expected, rel=1e-3)


def test_without_a_majority_the_intervals_contain_both_tests() -> None:
    fit = _fit(1.0, 0.96)
    poles = poles_of_tests(fit)
    assert poles is not None and odd_tests(poles) is None
    wide = with_spread(fit, poles)
    modes = fit.angular_frequencies.size
    reach = 1.96 * np.sqrt(np.diag(wide.covariance))[:modes]
    mean = np.log(wide.angular_frequencies)
    assert np.all(np.abs(poles.values[:, :modes] - mean) <= reach)
    # each test alone has the true damping; a common fit has too much
    assert wide.damping_ratios == pytest.approx(complex_modes(FRAME).damping_ratios, rel=0.1)
    assert "Hz" in difference(NAMES[:2], poles, None)
