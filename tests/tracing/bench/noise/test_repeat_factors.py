"""Differences of repeated motion are noise, events, or a disturbance that grows with the speed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from mrpipe.tracing.bench.noise.repeat_factors import Differences, _factors, _robust_factors, parts_of_differences
from mrpipe.tracing.rules import NoiseRules


@pytest.mark.property
@pytest.mark.parametrize("events", [0.0, 0.1])
def test_events_that_do_not_repeat_are_no_noise(events: float) -> None:
    """A tenth of all differences is 30 times as large as the noise, so the mean square is 90 times too large."""
    rng = np.random.default_rng(5)
    columns = np.stack([np.ones(8000), np.where(np.arange(8000) % 10 == 0, 4.0, 0.01)], axis=1)
    difference = np.sqrt(columns @ [3.0, 5.0]) * rng.standard_normal(8000)
    difference[rng.random(8000) < events] *= 30.0
    factors, limited = _robust_factors(columns, difference**2, np.zeros(8000))
    assert (np.sum(limited) < 0.5 * np.sum(difference**2)) == (events > 0.0)
    # with a tenth of events the limited mean settles 1.65 times above that of the noise
    assert factors == pytest.approx(np.array([3.0, 5.0]) * (1.0 if events == 0.0 else 1.65), rel=0.15)
    if events == 0.0:
        assert _factors(columns, difference**2) == pytest.approx([3.0, 5.0], rel=0.1)


@pytest.mark.property
@pytest.mark.parametrize("amplitude", [0.0, 10.0])
def test_a_disturbance_that_grows_with_the_speed_is_no_noise(amplitude: float) -> None:
    """The disturbance has a frequency that the motion does not have, so that cycles differ by it."""
    rng = np.random.default_rng(6)
    time = np.arange(8000) / 500.0
    speed = np.sqrt(2.0) * np.abs(np.cos(2.0 * np.pi * 0.9 * time))
    columns = np.stack([np.ones(8000), np.where(speed < 0.1, 4.0, 0.01), speed], axis=1)
    noise = np.sqrt(columns[:, :2] @ [3.0, 5.0]) * rng.standard_normal(8000)
    disturbance = amplitude * speed * np.sin(2.0 * np.pi * 7.3 * time)
    factors, without, disturbed = parts_of_differences(
        Differences((noise + disturbance,), columns, np.zeros(8000)), NoiseRules()
    )
    if amplitude == 0.0:
        assert not disturbed.any()
        assert factors == pytest.approx([3.0, 5.0], rel=0.1)
    else:
        assert np.mean(disturbed) == pytest.approx(np.mean(disturbance**2), rel=0.25)
        assert np.mean(without) == pytest.approx(np.mean(noise**2) + np.mean(disturbance**2), rel=0.05)
        # without the third part the noise of the force would be 17 times as large as it is
        assert factors[0] < 0.25 * float(np.mean(without))


def repeats(rng: np.random.Generator, count: int, corner: float = 0.0) -> Differences:
    """Return differences of `count` cycles of a motion, with the noise that the channels show, white or coloured."""
    phase = 2.0 * np.pi * np.arange(120) / 120.0
    speed = np.sqrt(2.0) * np.abs(np.cos(phase))
    one = np.stack([np.full(120, 2.0), np.where(speed < 0.3, 1.0, 0.01), 2.0 * speed], axis=1)
    pieces = []
    for _ in range(count):
        values = rng.standard_normal(620)
        if corner:
            values = signal.lfilter([np.sqrt(1.0 - corner**2)], [1.0, -corner], values)
        pieces.append(np.sqrt(one[:, 0] + one[:, 1]) * values[500:])
    return Differences(tuple(pieces), np.tile(one, (count, 1)), np.zeros(120 * count))


@pytest.mark.property
@pytest.mark.parametrize("count", [4, 12])
def test_few_repeats_of_white_noise_leave_what_the_channels_show(count: int) -> None:
    """A regression alone divides the noise of few cycles between the parts at random."""
    kept = 0
    for seed in range(40):
        found = repeats(np.random.default_rng(seed), count)
        factors, without, disturbed = parts_of_differences(found, NoiseRules())
        assert not disturbed.any() and np.array_equal(without, found.squares)
        kept += bool(np.all(factors == 1.0))
        free = _factors(found.columns, found.squares)
        assert np.any(free != 1.0)
    assert kept >= 36


@pytest.mark.property
def test_noise_in_the_band_of_the_motion_raises_the_factor_of_the_force() -> None:
    rng = np.random.default_rng(3)
    found = repeats(rng, 12)
    louder = Differences(tuple(2.0 * piece for piece in found.pieces), found.columns, found.step_squared)
    factors, _, disturbed = parts_of_differences(louder, NoiseRules())
    assert factors[0] == pytest.approx(4.0, rel=0.25)
    assert not disturbed.any()


@pytest.mark.property
def test_correlated_differences_count_for_less() -> None:
    """With correlation 0.9 from sample to sample, 1 + 2 (0.81 + 0.81^2 + ...) = 9.5 samples count as one."""
    rng = np.random.default_rng(8)
    white, coloured = repeats(rng, 40), repeats(rng, 40, corner=0.9)
    expected = white.columns[:, :2].sum(axis=1)
    assert white.independent(expected) == pytest.approx(4800.0, rel=0.1)
    assert coloured.independent(expected) == pytest.approx(4800.0 / 9.5, rel=0.3)


@pytest.mark.property
def test_a_slow_disturbance_in_few_cycles_is_no_noise() -> None:
    """It has few independent samples, so that no criterion requires its growth; but no channel is so noisy."""
    rng = np.random.default_rng(5)
    found = repeats(rng, 14, corner=0.97)
    growing = np.sqrt(found.columns[:120, 2] / np.mean(found.columns[:120, 2]))
    loud = Differences(tuple(60.0 * growing * piece for piece in found.pieces), found.columns, found.step_squared)
    factors, _, disturbed = parts_of_differences(loud, NoiseRules())
    assert np.mean(disturbed) > 0.5 * np.mean(loud.squares)
    assert factors[0] < 0.5 * np.mean(loud.squares) / np.mean(found.columns[:, 0])
