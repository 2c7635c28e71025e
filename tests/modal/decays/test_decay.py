from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.decays.decay import (
    analyse_decay,
    damping_from_decrement,
    decay_start,
    linear_envelope,
    logarithmic_envelope,
    modal_coordinates,
)
from mrpipe.modal.records import FrameTest
from mrpipe.structures import complex_modes, frame_from_parameter_set, natural_modes, shear_frame
from mrpipe.structures.response import linear_response
from tests.modal.rig import Rig, decay_test


def decay_of(zeta, noise=1e-3, omega=20.0, seconds=30.0, rate=500.0, seed=0):
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * rate)) / rate
    wave = np.exp(-zeta * omega * time) * np.cos(omega * np.sqrt(1 - zeta**2) * time)
    return FrameTest(
        "decay", "free-decay", rate, None, (wave + noise * rng.standard_normal(time.size))[:, None], (False,)
    )


def analyse(zeta, **options):
    return analyse_decay(decay_of(zeta, **options), np.ones((1, 1)), np.array([20.0]), np.array([zeta]))


@pytest.mark.literature
def test_an_exponential_decay_has_an_exponential_envelope():
    # peaks of both signs, half a period apart, of a mode with zeta = 0.01
    omega, zeta = 20.0, 0.01
    time = 0.3 + np.arange(30) * np.pi / (omega * np.sqrt(1 - zeta**2))
    peak = 2.0 * np.exp(-zeta * omega * time)
    exact, straight = logarithmic_envelope(time, peak), linear_envelope(time, peak)
    assert exact.damping_ratio == pytest.approx(zeta, rel=1e-9)
    assert exact.rms_error < 1e-12 < 0.01 < straight.rms_error
    # the chord of a convex curve is flatter than its tangent at the first peak
    assert 0.4 * zeta < straight.damping_ratio < zeta


@pytest.mark.literature
def test_friction_has_a_straight_envelope():
    # dry friction takes the same height from each peak
    time, peak = np.arange(20) * 0.2, 1.0 - 0.04 * np.arange(20)
    assert linear_envelope(time, peak).rms_error < 1e-12 < logarithmic_envelope(time, peak).rms_error
    assert linear_envelope(time, peak).damping_ratio == pytest.approx(damping_from_decrement(0.08), rel=1e-9)


@pytest.mark.literature
def test_decrement_of_one_period():
    # (3.1): a decrement of 2 pi zeta / sqrt(1 - zeta2) gives zeta back
    for zeta in (0.001, 0.1, 0.5):
        assert damping_from_decrement(2 * np.pi * zeta / np.sqrt(1 - zeta**2)) == pytest.approx(zeta, rel=1e-12)


@pytest.mark.planted
@pytest.mark.parametrize("zeta", [0.001, 0.003, 0.01, 0.02])
def test_three_methods_agree_where_the_band_pass_is_right(zeta):
    result = analyse(zeta)
    assert result.filtered
    assert result.exponential_fit.value == pytest.approx(zeta, rel=0.005)
    assert result.logarithmic_decrement.value == pytest.approx(zeta, rel=0.05)
    assert result.point_to_point.value == pytest.approx(zeta, rel=0.05)
    assert result.angular_frequency == pytest.approx(20.0, rel=1e-4)


@pytest.mark.planted
def test_heavy_damping_is_not_band_passed():
    result = analyse(0.1)
    assert not result.filtered
    assert result.exponential_fit.value == pytest.approx(0.1, rel=0.01)


@pytest.mark.planted
def test_the_interval_of_the_exponential_fit_holds_the_truth_about_as_often_as_it_says():
    inside = 0
    for seed in range(20):
        fit = analyse(0.01, noise=0.05, seed=seed, seconds=15.0, rate=200.0).exponential_fit
        inside += fit.low <= 0.01 <= fit.high
        assert fit.half_width < 0.002
    assert inside >= 16


@pytest.mark.planted
def test_only_noise_is_no_decay():
    rng = np.random.default_rng(0)
    test = FrameTest("noise", "free-decay", 200.0, None, rng.standard_normal((4000, 1)), (False,))
    assert analyse_decay(test, np.ones((1, 1)), np.array([20.0]), np.array([0.01])) is None


@pytest.mark.planted
@pytest.mark.parametrize("table", [0.1, 0.01])
def test_the_stop_of_the_table_is_found_above_and_below_the_noise(table):
    # at a resonance a hundredth of a m/s2 is enough, half of what the accelerometer's noise is
    frame = frame_from_parameter_set("thesis")
    modes = natural_modes(frame)
    rig = Rig(rate=250.0, decay_s=40.0)
    for mode, zeta in ((1, 0.0030), (2, 0.0024)):
        test = decay_test(frame, np.random.default_rng(mode), rig, mode, table)
        coordinate = modal_coordinates(test, modes.mode_shapes, modes.angular_frequencies)[:, mode - 1]
        start = decay_start(test, coordinate, float(modes.angular_frequencies[mode - 1]))
        assert start / rig.rate == pytest.approx(15.0, abs=1.0)
        result = analyse_decay(test, modes.mode_shapes, modes.angular_frequencies, np.full(5, 0.002))
        assert result.exponential_fit.value == pytest.approx(zeta, rel=0.03)


@pytest.mark.planted
def test_close_modes_are_told_apart_by_their_shapes():
    # the two highest modes of eight floors lie closer than the band-pass is wide
    frame = shear_frame(np.full(8, 6.0), np.full(8, 5500.0), np.linspace(0.002, 0.006, 8))
    modes = natural_modes(frame)
    truth = complex_modes(frame).damping_ratios
    assert np.diff(modes.angular_frequencies)[-1] < np.pi
    rig = Rig(rate=250.0, decay_s=20.0)
    for mode in (7, 8):
        test = decay_test(frame, np.random.default_rng(mode), rig, mode)
        result = analyse_decay(test, modes.mode_shapes, modes.angular_frequencies, 1.3 * truth)
        assert result.exponential_fit.value == pytest.approx(truth[mode - 1], rel=0.05)


@pytest.mark.planted
@pytest.mark.parametrize("zeta", [0.004, 0.01, 0.02, 0.04])
def test_a_record_that_begins_with_the_release_is_a_decay(zeta):
    """The ground sensor records nothing but its noise, whose power once decided where the decay begins."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        frame = shear_frame(rng.uniform(20, 40, 3), rng.uniform(3e4, 6e4, 3), zeta)
        modes, rate, samples = natural_modes(frame), 200.0, 4000
        for mode, (omega, shape) in enumerate(zip(modes.angular_frequencies, modes.mode_shapes.T, strict=True), 1):
            start = np.concatenate([2.0 * shape / np.abs(shape).max() / omega**2, np.zeros(3)])
            response = linear_response(frame, np.zeros(samples), 1 / rate, initial_state=start).absolute_acceleration
            test = FrameTest(
                "release",
                "free-decay",
                rate,
                0.01 * rng.standard_normal(samples),
                response + 0.01 * rng.standard_normal(response.shape),
                (False,) * 3,
                mode=mode,
            )
            result = analyse_decay(test, modes.mode_shapes, modes.angular_frequencies, np.full(3, 0.7 * zeta))
            assert result is not None
            assert result.exponential_fit.value == pytest.approx(zeta, rel=0.02)


@pytest.mark.planted
def test_a_channel_of_the_excitation_that_is_zero_is_no_excitation():
    # a pull-and-release test records the ground too, as zeros
    test = decay_of(0.01)
    still = replace(test, excitation=np.zeros(test.responses.shape[0]))
    assert decay_start(still, still.responses[:, 0], 20.0) == decay_start(test, test.responses[:, 0], 20.0) == 0
    found = analyse_decay(still, np.ones((1, 1)), np.array([20.0]), np.array([0.01]))
    assert found is not None
    assert found.exponential_fit.value == pytest.approx(0.01, rel=0.01)
