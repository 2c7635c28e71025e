from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.fit.lscf import stable_poles
from mrpipe.modal.fit.multimode import FREQUENCY_RANGE, fit_again, fit_modes
from mrpipe.modal.fit.projection import Problem
from mrpipe.modal.spectra import averaged_responses, excited_band, record_spectrum
from mrpipe.modal.verification import verify_in_frequency, verify_in_time
from mrpipe.structures import complex_modes, frame_from_parameter_set, modal_assurance, natural_modes
from tests.modal.rig import Rig, sweep_test

RIG = Rig(noise=0.01, rate=250.0, sweep_s=120.0)


@pytest.fixture(scope="module")
def thesis():
    frame = frame_from_parameter_set("thesis")
    test = sweep_test(frame, np.random.default_rng(1), RIG)
    return frame, test, record_spectrum(test, (0.2, 14.0))


@pytest.mark.planted
def test_poles_are_found_without_a_first_guess(thesis):
    frame, _, spectrum = thesis
    truth = complex_modes(frame)
    found = stable_poles([spectrum], range(12, 30, 2), (1.3, 80.0))
    firm = [item for item in found if item.occurrences >= 7]
    for omega, zeta in zip(truth.angular_frequencies, truth.damping_ratios, strict=True):
        nearest = min(firm, key=lambda item: abs(item.angular_frequency - omega))
        assert nearest.angular_frequency == pytest.approx(omega, rel=1e-3)
        assert nearest.damping_ratio == pytest.approx(zeta, rel=0.15)


@pytest.mark.planted
def test_fit_returns_poles_and_shapes(thesis):
    frame, _, spectrum = thesis
    truth = complex_modes(frame)
    fit = fit_modes([spectrum], truth.angular_frequencies * 1.002, np.full(5, 0.004))
    assert fit.angular_frequencies == pytest.approx(truth.angular_frequencies, rel=2e-4)
    assert fit.damping_ratios == pytest.approx(truth.damping_ratios, rel=0.05)
    assert np.diag(modal_assurance(fit.residues.real, natural_modes(frame).mode_shapes)).min() > 0.9999
    assert fit.mode_coherence().min() > 0.99


@pytest.mark.planted
def test_a_pole_that_leaves_its_mode_for_a_missing_one_is_kept(thesis):
    frame, _, spectrum = thesis
    truth = complex_modes(frame)
    omega, zeta = truth.angular_frequencies, truth.damping_ratios
    complete = fit_modes([spectrum], omega, zeta)
    same = fit_again([spectrum], complete, passes=2, evaluations=10)
    assert same.angular_frequencies == pytest.approx(omega, rel=2e-4)
    # a pole that was beyond the range of the search from the third mode runs to the end of this range
    wrong = replace(complete, angular_frequencies=omega * [1.0, 1.0, 1.0 + 1.5 * FREQUENCY_RANGE, 1.0, 1.0])
    kept = fit_again([spectrum], wrong, passes=2, evaluations=10)
    assert kept.angular_frequencies == pytest.approx(wrong.angular_frequencies, rel=1e-12)
    assert kept.damping_ratios == pytest.approx(complete.damping_ratios, rel=1e-12)
    assert not np.allclose(kept.residues, complete.residues)


@pytest.mark.property
def test_without_noise_the_fit_is_nearly_exact():
    frame = frame_from_parameter_set("thesis")
    quiet = Rig(noise=0.0, rate=1000.0, sweep_s=100.0)
    test = sweep_test(frame, np.random.default_rng(0), quiet)
    truth = complex_modes(frame)
    fit = fit_modes([record_spectrum(test, (0.2, 14.0))], truth.angular_frequencies * 0.999, np.full(5, 0.003))
    assert fit.angular_frequencies == pytest.approx(truth.angular_frequencies, rel=1e-5)
    assert fit.damping_ratios == pytest.approx(truth.damping_ratios, rel=5e-3)


@pytest.mark.planted
def test_intervals_of_the_sweep_are_honest(thesis):
    frame, _, _ = thesis
    truth = np.concatenate(
        [np.log(complex_modes(frame).angular_frequencies), np.log(complex_modes(frame).damping_ratios)]
    )
    scores = []
    for seed in range(6):
        test = sweep_test(frame, np.random.default_rng(100 + seed), RIG)
        fit = fit_modes([record_spectrum(test, (0.2, 14.0))], np.exp(truth[:5]), np.exp(truth[5:]))
        estimate = np.concatenate([np.log(fit.angular_frequencies), np.log(fit.damping_ratios)])
        scores.append((estimate - truth) / np.sqrt(np.diag(fit.covariance)))
    spread = np.sqrt(np.mean(np.square(scores)))
    assert 0.5 < spread < 2.0


@pytest.mark.planted
def test_the_excited_band_ends_where_the_sweep_does(thesis):
    _, test, _ = thesis
    low, high = excited_band((test,))
    assert low < 0.6
    assert high == pytest.approx(RIG.top_hz, rel=0.05)


@pytest.mark.planted
def test_averaged_spectra_see_the_peaks(thesis):
    frame, test, _ = thesis
    averaged = averaged_responses(test, 16.0)
    first = natural_modes(frame).frequencies_hz[0]
    near = np.abs(averaged.frequency_hz - first) < 0.5
    peak = averaged.frequency_hz[near][np.argmax(np.abs(averaged.response[near, 4]))]
    assert peak == pytest.approx(first, abs=0.07)
    assert np.all((averaged.coherence >= 0.0) & (averaged.coherence <= 1.0 + 1e-9))


@pytest.mark.planted
def test_the_true_frame_returns_what_was_measured_and_another_does_not(thesis):
    frame, test, spectrum = thesis
    truth = complex_modes(frame)
    fit = fit_modes([spectrum], truth.angular_frequencies, truth.damping_ratios)
    good = verify_in_frequency(frame, fit, (0.2, 10.0))
    assert good.error.max() < 0.03
    assert verify_in_time(frame, test, (0.2, 10.0)).fit_percent.min() > 95.0
    other = frame_from_parameter_set("geometry")
    assert verify_in_frequency(other, fit, (0.2, 10.0)).error.min() > 0.3
    assert verify_in_time(other, test, (0.2, 10.0)).fit_percent.max() < 50.0


@pytest.mark.property
def test_what_lies_above_the_band_is_scaled_alike_in_all_tests(thesis):
    """Its coefficients are shared: scaled by each test's own strength they bent the shapes by a quarter."""
    frame, _, _ = thesis
    rng = np.random.default_rng(3)
    tests = [sweep_test(frame, rng, Rig(rate=100.0, sweep_s=20.0, amplitude=size)) for size in (0.3, 3.0)]
    spectra = [record_spectrum(test, (0.2, 14.0)) for test in tests]
    columns = Problem(spectra, 5, displacement=False).smooth_columns()[:, 0]
    excitation = np.concatenate([item.excitation for item in spectra])
    assert np.ptp(np.abs(columns / excitation)) < 1e-12
