"""Times of the tracing follow from the motion of each test, not from fixed seconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.fitting.recordings import Recordings, enough_tests, record_tests
from mrpipe.signals.filters import butterworth_lowpass
from mrpipe.signals.prepared import PreparedTest

pytestmark = pytest.mark.property

RATE = 500.0


def sine(name: str, frequency_hz: float, seconds: float = 20.0) -> PreparedTest:
    """Return a sine of 10 mm with a force that follows its velocity, and white noise of 2 micrometres."""
    time = np.arange(int(seconds * RATE)) / RATE
    omega = 2.0 * np.pi * frequency_hz
    x, v = 0.01 * np.sin(omega * time), 0.01 * omega * np.cos(omega * time)
    raw = x + 2e-6 * np.random.default_rng(1).standard_normal(len(x))
    return PreparedTest(
        name, "training", RATE, time, x, v, -(omega**2) * x, np.ones_like(x), 100.0 * v, raw, 100.0 * v,
        np.array([], dtype=np.int64), "A", "periodic",
    )  # fmt: skip


@pytest.fixture(scope="module")
def recordings() -> Recordings:
    return record_tests([sine("slow", 0.2), sine("fast", 2.0)], rate_hz=250.0)


def test_the_period_is_that_of_the_motion(recordings: Recordings) -> None:
    np.testing.assert_allclose(recordings.motion_period_s, [5.0, 0.5], rtol=0.02)
    assert sine("one", 1.3).motion_frequency_hz == pytest.approx(1.3, rel=1e-3)


def test_no_period_is_longer_than_its_test(recordings: Recordings) -> None:
    still = replace(recordings, velocity=np.zeros_like(recordings.velocity))
    np.testing.assert_allclose(still.motion_period_s, np.diff(still.starts) * still.dt)


def test_blocks_last_the_same_share_of_every_period(recordings: Recordings) -> None:
    blocks = recordings.blocks(0.5)
    counts = [len(np.unique(blocks[recordings.test == test])) for test in range(2)]
    # 20 s are 4 periods of the slow test and 40 of the fast one
    assert counts[0] == pytest.approx(8, abs=1)
    assert counts[1] == pytest.approx(80, abs=2)
    assert not set(blocks[recordings.test == 0]) & set(blocks[recordings.test == 1])


def test_the_least_cut_off_rises_with_the_frequency_of_the_motion() -> None:
    slow, fast = (sine("one", frequency).displacement_cutoff_hz for frequency in (0.2, 4.0))
    assert slow < 10.0
    assert fast >= 32.0


def test_a_channel_without_motion_still_has_a_cut_off() -> None:
    still = sine("still", 1.0)
    zero = np.zeros_like(still.time_s)
    still = replace(still, displacement_m=zero, velocity_m_s=zero, displacement_raw_m=zero)
    assert still.displacement_cutoff_hz == 0.25 * RATE
    assert np.all(np.isfinite(record_tests([still]).displacement))


def stepped(filtered: bool) -> PreparedTest:
    """Return a sine whose recorded drive jumps at 10 s; `drive` is what a low-pass makes of it."""
    test = sine("stepped", 1.0)
    drive = np.where(test.time_s < 10.0, 0.0, 2.0)
    return replace(test, drive=butterworth_lowpass(drive, 20.0, RATE) if filtered else drive, drive_raw=drive)


def test_a_jump_of_the_drive_is_not_filtered() -> None:
    found = record_tests([stepped(filtered=True)], rate_hz=250.0)
    # the test keeps its rate, because interpolation between samples makes a jump as long as an interval
    assert found.dt[0] == pytest.approx(1.0 / RATE)
    np.testing.assert_array_equal(found.drive, np.where(found.time < 10.0 - 1e-9, 0.0, 2.0))


def test_a_smooth_drive_is_the_filtered_one() -> None:
    test = stepped(filtered=False)
    smooth = 1.0 + np.sin(np.pi * test.time_s)
    noisy = smooth + 0.01 * np.random.default_rng(2).standard_normal(len(smooth))
    found = record_tests([replace(test, drive=smooth, drive_raw=noisy)], rate_hz=250.0)
    assert found.dt[0] == pytest.approx(1.0 / 250.0)
    np.testing.assert_array_equal(found.drive, smooth[::2])


def test_a_test_cut_into_pieces_keeps_its_recorded_drive() -> None:
    pieces = enough_tests([stepped(filtered=True)])
    joined = np.concatenate([piece.recorded_drive for piece in pieces])
    np.testing.assert_array_equal(joined, stepped(filtered=True).drive_raw)
