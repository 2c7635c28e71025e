"""Modes that the table hardly moves: taken from their decays; poles that are none are not taken for modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.decays.choice import pooled
from mrpipe.modal.decays.decay import Estimate
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.search.free_response import free_mode, strongest_frequency, with_decays
from mrpipe.modal.search.selection import usable
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import natural_modes, shear_frame
from tests.modal.rig import Rig, decay_test, sweep_test

RIG = Rig(noise=0.01, rate=200.0, sweep_s=80.0, decay_s=20.0, top_hz=16.0)


@pytest.fixture(scope="module")
def frame():
    return shear_frame([5.0, 6.0, 5.5], [6000.0, 7000.0, 5000.0], [0.003, 0.004, 0.002])


@pytest.mark.planted
def test_a_decay_gives_frequency_damping_and_shape(frame):
    test = decay_test(frame, np.random.default_rng(1), RIG, 3)
    modes = natural_modes(frame)
    omega = modes.angular_frequencies
    assert strongest_frequency(test, (1.0, 12.0)) == pytest.approx(omega[2], rel=0.01)
    found = free_mode(test, 2, omega * 1.002, np.full(3, 0.004))
    assert found.angular_frequency == pytest.approx(omega[2], rel=2e-4)
    assert found.damping_ratio == pytest.approx(0.002, rel=0.05)
    shape = modes.mode_shapes[:, 2] / modes.mode_shapes[np.argmax(np.abs(modes.mode_shapes[:, 2])), 2]
    assert np.all(np.abs(found.shape - shape) < 4.0 * found.errors + 2e-3)
    assert found.quality.min() > 0.9


@pytest.mark.planted
def test_a_mode_that_the_sweep_hardly_shows_is_taken_from_its_decay(frame):
    rng = np.random.default_rng(2)
    loud = Rig(noise=0.3, rate=200.0, sweep_s=80.0, top_hz=16.0)
    modes = natural_modes(frame)
    sweep = sweep_test(frame, rng, loud)
    fit = fit_modes([record_spectrum(sweep, (0.5, 14.0))], modes.angular_frequencies, np.full(3, 0.004))
    fit.coherence[:, 2] = 0.3
    better = with_decays(fit, [decay_test(frame, rng, RIG, 3)])
    assert better.residue_errors[:, 2].max() < fit.residue_errors[:, 2].max()
    assert better.mode_coherence()[2] > 0.9
    np.testing.assert_array_equal(better.residues[:, :2], fit.residues[:, :2])
    assert np.sqrt(better.covariance[5, 5]) <= np.sqrt(fit.covariance[5, 5])


@pytest.mark.property
def test_poles_that_are_no_modes_are_not_taken(frame):
    """At the bound of damping, run off, incoherent, or of a shape that the noise leaves open."""
    modes = natural_modes(frame)
    sweep = sweep_test(frame, np.random.default_rng(3), RIG)
    fit = fit_modes([record_spectrum(sweep, (0.5, 14.0))], modes.angular_frequencies, np.full(3, 0.004))
    assert usable(fit).tolist() == [True, True, True]
    at_bound = replace(fit, damping_ratios=np.array([1e-6, 0.004, 0.2]))
    assert usable(at_bound).tolist() == [False, True, False]
    errors = fit.residue_errors.copy()
    errors[:, 1] = np.abs(fit.residues[:, 1])
    assert usable(replace(fit, residue_errors=errors)).tolist() == [True, False, True]
    coherence = fit.coherence.copy()
    coherence[:, 2] = 0.4
    assert usable(replace(fit, coherence=coherence)).tolist() == [True, True, False]


@pytest.mark.property
def test_uncertain_damping_is_pooled_of_both_methods():
    first, second = Estimate(0.0016, 0.00148, 0.00172), Estimate(0.0014, 0.00130, 0.00150)
    both = pooled(first, second)
    assert second.value < both.value < 0.0015
    assert both.half_width < second.half_width
