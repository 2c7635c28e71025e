"""Filters, changes of rate, differences, spectra and cut-offs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.artifacts import FloatArray
from mrpipe.signals.differentiation import backward_difference, central_difference, savitzky_golay
from mrpipe.signals.filters import butterworth_lowpass, even_clock, resample, samples_needed, usable_cutoff
from mrpipe.signals.spectra import cutoff_by_criterion, noise_level, power_spectrum

RATE = 1000.0
T = np.arange(8000) / RATE
MIDDLE = slice(2000, 6000)


def response(values: FloatArray, frequency: float) -> complex:
    """Return gain and phase of a filtered sine over the middle of the record."""
    wave = np.exp(-2j * np.pi * frequency * T[MIDDLE])
    return complex(2j * np.mean(values[MIDDLE] * wave))


@pytest.mark.literature
@pytest.mark.parametrize("phase", ["zero", "causal"])
@pytest.mark.parametrize("cutoff", [20.0, 100.0])
def test_half_power_lies_at_the_cutoff(phase: str, cutoff: float) -> None:
    sine = np.sin(2 * np.pi * cutoff * T)
    gain = response(butterworth_lowpass(sine, cutoff, RATE, phase=phase), cutoff)  # type: ignore[arg-type]
    assert abs(gain) == pytest.approx(np.sqrt(0.5), rel=0.01)


@pytest.mark.literature
@pytest.mark.parametrize(("cutoff", "late_s"), [(20.0, 11.25e-3), (100.0, 2.2e-3)])
def test_the_causal_filter_is_late_as_errata_d_says_and_the_other_is_not(cutoff: float, late_s: float) -> None:
    sine = np.sin(2 * np.pi * 2.0 * T)
    late, in_time = (
        response(butterworth_lowpass(sine, cutoff, RATE, phase=phase), 2.0) for phase in ("causal", "zero")
    )
    assert -np.angle(late) / (2 * np.pi * 2.0) == pytest.approx(late_s, rel=0.03)
    assert abs(np.angle(in_time)) < 1e-4 and abs(in_time) == pytest.approx(1.0, abs=1e-3)


@settings(max_examples=30, deadline=None)
@given(st.floats(-1e3, 1e3), st.floats(1.0, 350.0), st.sampled_from(["zero", "causal"]), st.integers(1, 4))
@pytest.mark.property
def test_a_constant_passes_unchanged(level: float, cutoff: float, phase: str, order: int) -> None:
    values = np.full(500, level)
    smooth = butterworth_lowpass(values, cutoff, RATE, order=order, phase=phase)  # type: ignore[arg-type]
    np.testing.assert_allclose(smooth, values, atol=1e-6 * (1 + abs(level)))


@pytest.mark.golden
def test_a_cutoff_beyond_the_sampling_rate_leaves_the_channel_alone() -> None:
    values = np.random.default_rng(0).standard_normal(300)
    np.testing.assert_array_equal(butterworth_lowpass(values, 100.0, 100.0), values)
    assert usable_cutoff(100.0, 100.0) is None and usable_cutoff(20.0, 100.0) == 20.0
    assert samples_needed(20.0, 1000.0) == 151


@pytest.mark.planted
def test_decimation_does_not_alias() -> None:
    low, high = np.sin(2 * np.pi * 7.0 * T), np.sin(2 * np.pi * 193.0 * T)
    kept = resample(low + high, 5.0, 1.0)
    assert kept.size == 1600
    # 193 Hz at 200 Hz would appear as 7 Hz
    np.testing.assert_allclose(kept[50:-50], low[::5][50:-50], atol=2e-3)


@settings(max_examples=25, deadline=None)
@given(st.sampled_from([(200.0, 1000.0), (1000.0, 200.0), (3004.8, 1000.0), (100.0, 250.0)]), st.floats(0.5, 20.0))
@pytest.mark.property
def test_resampling_keeps_a_slow_sine_in_its_place(rates: tuple[float, float], frequency: float) -> None:
    start, goal = rates
    wave = np.sin(2 * np.pi * frequency * np.arange(round(8 * start)) / start)
    other = resample(wave, start, goal)
    t = np.arange(other.size) / goal
    inner = (t > 1.0) & (t < 7.0)
    np.testing.assert_allclose(other[inner], np.sin(2 * np.pi * frequency * t)[inner], atol=5e-3)


@pytest.mark.property
def test_resampling_a_record_with_an_offset_does_not_ring_at_its_ends() -> None:
    ramp = 30.0 + 2.0 * np.arange(400) / 100.0
    np.testing.assert_allclose(resample(ramp, 100.0, 1000.0)[:-20], 30.0 + 2.0 * np.arange(3980) / 1000.0, atol=1e-2)


@pytest.mark.golden
def test_an_uneven_clock_is_brought_to_an_even_one() -> None:
    rng = np.random.default_rng(1)
    t = T + 1e-4 * rng.uniform(-1, 1, T.size)
    even = even_clock(t, np.sin(2 * np.pi * t), RATE, T)
    np.testing.assert_allclose(even[1:-1], np.sin(2 * np.pi * T)[1:-1], atol=2e-5)
    assert even_clock(T, t, RATE, T) is t


@pytest.mark.literature
def test_differences_and_their_delay() -> None:
    omega = 2 * np.pi * 1.0
    x, v = 5e-3 * np.sin(omega * T), 5e-3 * omega * np.cos(omega * T)
    backward = backward_difference(x, 1 / RATE)
    assert backward[0] == 0.0 and backward[5] == pytest.approx((x[5] - x[4]) * RATE)
    late = np.angle(response(v, 1.0) / response(backward, 1.0)) / omega
    assert late == pytest.approx(0.5 / RATE, rel=1e-3)
    for centred in (central_difference(x, 1 / RATE), savitzky_golay(x, 1 / RATE, window_s=0.03)):
        np.testing.assert_allclose(centred, v, atol=2e-5)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=3, max_size=3), st.integers(5, 400))
@pytest.mark.property
def test_parabolas_are_differentiated_exactly(coefficients: list[float], samples: int) -> None:
    t = np.arange(samples) * 0.01
    values = np.polyval(coefficients, t)
    slope = np.polyval(np.polyder(coefficients), t)
    np.testing.assert_allclose(central_difference(values, 0.01), slope, atol=1e-9)
    np.testing.assert_allclose(savitzky_golay(values, 0.01, window_s=0.09), slope, atol=1e-9)


@pytest.mark.planted
def test_noise_level_and_spectrum_are_those_planted() -> None:
    rng = np.random.default_rng(2)
    noise = 20e-6 * rng.standard_normal(T.size)
    assert noise_level(5e-3 * np.sin(2 * np.pi * T) + noise, RATE) == pytest.approx(20e-6, rel=0.1)
    frequencies, density = power_spectrum(noise, RATE)
    assert np.sqrt(np.sum(density) * frequencies[1]) == pytest.approx(20e-6, rel=0.05)


@pytest.mark.planted
@pytest.mark.parametrize("top", [30.0, 80.0, 200.0])
def test_the_criterion_finds_where_the_motion_ends(top: float) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(20_000) / RATE
    tones = np.arange(1.0, top, 0.37)
    phases = rng.uniform(0, 2 * np.pi, tones.size)
    motion = np.sum(1e-4 * np.sin(2 * np.pi * tones[:, None] * t + phases[:, None]), axis=0)
    cutoff = cutoff_by_criterion(motion + 5e-6 * rng.standard_normal(t.size), RATE)
    assert top <= cutoff <= 1.6 * top


@pytest.mark.planted
def test_the_criterion_leaves_steps_their_harmonics_and_cuts_pure_noise() -> None:
    assert cutoff_by_criterion(np.sign(np.sin(2 * np.pi * 0.7 * T)), RATE) > 250.0
    assert cutoff_by_criterion(np.random.default_rng(4).standard_normal(T.size), RATE) == 5.0
