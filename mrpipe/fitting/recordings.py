"""Concatenated recordings for the tracing: displacement with zero-phase filter, force as it was measured."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.effects.contract import EffectScales
from mrpipe.signals.channel_noise import DISPLACEMENT_HARMONICS
from mrpipe.signals.differentiation import spline_derivatives
from mrpipe.signals.filters import butterworth_lowpass
from mrpipe.signals.prepared import PreparedTest

SETTLING_SHARE = 0.3
"""Forces are compared after this share of the peak-to-peak displacement, as the initial hysteresis is unknown."""

STEADY_OFFSET_SHARE = 0.03
"""Displacement offsets whose spread is below this share of the stroke are replaced by one common offset."""

MOST_TESTS = 48
"""Largest number of training tests; of larger campaigns every second, third, ... test is used."""

MOST_SAMPLES = 50_000
"""Largest number of samples; of longer campaigns the same duration of every test is used."""

MOST_JUDGED = 200_000
"""Largest number of samples of validation tests; it is larger, because these are simulated once and not fitted."""

JUMP_RATE_HZ = 1000.0
"""Least sampling rate of a test with jumps of the drive. Linear interpolation of the drive makes a jump as long as a
sampling interval, and the lag of a driver can be as short as 4 ms.
"""

FILTER_ORDER = 4
"""Order of the low-pass of the displacement in each direction. A lower order attenuates random motion near the edge of
its band by several percent, and the hysteresis doubles this error.
"""

ACCELERATION_HARMONICS = 25.0
"""Lowest cut-off of a measured acceleration, in multiples of the frequency of the motion."""


@dataclass(frozen=True)
class Recordings:
    """Several tests, concatenated.

    Attributes
    ----------
    displacement, velocity, acceleration, drive, force
        Signals, shape (n,) [m, m/s, m/s^2, A or V, N]. The force contains the measured offset.
    starts
        Index of the first sample of each test, and n, shape (tests + 1,).
    dt
        Shape (tests,) [s].
    names
        Names of the tests.
    test
        Test of each sample, shape (n,).
    used
        Samples at which forces are compared, shape (n,).
    displacement_noise, velocity_noise, force_noise, force_rounding
        Standard deviation of the sensor noise after filtering, and of the rounding of the force, shape (tests,); m,
        m/s, N, N.
    force_offset
        Offset that the stage prepare found, shape (tests,) [N].
    period_s
        Period of the motion, shape (tests,) [s]; 0 if it is not periodic.
    cutoff_hz
        Cut-off frequency of the displacement, shape (tests,) [Hz].
    noise_band_hz
        Upper end of the band of the displacement noise, shape (tests,) [Hz]; the cut-off if no other is known.
    noise_repeats
        Share of the variance of the displacement noise that repeats from cycle to cycle, shape (tests,) [1].
    displacement_rounding, displacement_dither
        Step of a quantised displacement and the noise that was added before rounding, shape (tests,) [m]; the step is 0
        where the displacement is not quantised.
    recorded_dt
        Sampling interval of the record that the samples are taken from, shape (tests,) [s].
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    drive: FloatArray
    force: FloatArray
    starts: IntArray
    dt: FloatArray
    names: tuple[str, ...]
    test: IntArray
    used: BoolArray
    displacement_noise: FloatArray
    velocity_noise: FloatArray
    force_noise: FloatArray
    force_rounding: FloatArray
    force_offset: FloatArray
    period_s: FloatArray
    cutoff_hz: FloatArray
    noise_band_hz: FloatArray
    noise_repeats: FloatArray
    displacement_rounding: FloatArray
    displacement_dither: FloatArray
    recorded_dt: FloatArray

    @property
    def tests(self) -> int:
        """Number of tests."""
        return len(self.dt)

    @property
    def time(self) -> FloatArray:
        """Time since the beginning of each test [s], shape (n,)."""
        index = np.arange(len(self.force)) - self.starts[self.test]
        return index * self.dt[self.test]

    @property
    def motion_period_s(self) -> FloatArray:
        """Mean period of the motion, also of random motion: 2 pi RMS displacement over RMS velocity, (tests,) [s]."""
        pieces = [slice(int(a), int(b)) for a, b in itertools.pairwise(self.starts)]
        sizes = [(np.std(self.displacement[piece]), np.std(self.velocity[piece])) for piece in pieces]
        lengths = np.diff(self.starts) * self.dt
        periods = [2.0 * np.pi * x / v if v > 0.0 else length for (x, v), length in zip(sizes, lengths, strict=True)]
        return np.minimum(periods, lengths)

    def blocks(self, periods: float) -> IntArray:
        """Return the index of the block of each sample, shape (n,); a block lasts `periods` periods of the motion."""
        length = np.maximum(1, np.round(periods * self.motion_period_s / self.dt).astype(np.int64))
        within = (np.arange(len(self.force)) - self.starts[self.test]) // length[self.test]
        return np.asarray(self.test * 100_000 + within)

    @property
    def force_rms(self) -> float:
        """RMS of the offset-free force over the samples that are compared [N]."""
        force = (self.force - self.force_offset[self.test])[self.used]
        return float(np.sqrt(np.mean(force**2)))

    def subset(self, tests: Sequence[int]) -> Recordings:
        """Return the recordings of some of the tests."""
        pieces = [slice(int(self.starts[k]), int(self.starts[k + 1])) for k in tests]
        lengths = [piece.stop - piece.start for piece in pieces]
        chosen = np.asarray(tests, dtype=np.int64)

        def cut(values: FloatArray) -> FloatArray:
            return np.ascontiguousarray(np.concatenate([values[piece] for piece in pieces]))

        return replace(
            self,
            displacement=cut(self.displacement),
            velocity=cut(self.velocity),
            acceleration=cut(self.acceleration),
            drive=cut(self.drive),
            force=cut(self.force),
            starts=np.cumsum([0, *lengths], dtype=np.int64),
            dt=self.dt[chosen],
            names=tuple(self.names[k] for k in tests),
            test=np.repeat(np.arange(len(tests)), lengths).astype(np.int64),
            used=np.concatenate([self.used[piece] for piece in pieces]),
            displacement_noise=self.displacement_noise[chosen],
            velocity_noise=self.velocity_noise[chosen],
            force_noise=self.force_noise[chosen],
            force_rounding=self.force_rounding[chosen],
            force_offset=self.force_offset[chosen],
            period_s=self.period_s[chosen],
            cutoff_hz=self.cutoff_hz[chosen],
            noise_band_hz=self.noise_band_hz[chosen],
            noise_repeats=self.noise_repeats[chosen],
            displacement_rounding=self.displacement_rounding[chosen],
            displacement_dither=self.displacement_dither[chosen],
            recorded_dt=self.recorded_dt[chosen],
        )

    def scales(self) -> EffectScales:
        """Return the scales of the campaign; bounds and starts of effects are multiples of them."""
        starts = self.starts
        strokes = [0.5 * np.ptp(self.displacement[a:b]) for a, b in itertools.pairwise(starts)]
        lengths = np.diff(starts) * self.dt
        return EffectScales(
            stroke=float(max(strokes)),
            speed=float(np.quantile(np.abs(self.velocity), 0.998)),
            acceleration=float(np.quantile(np.abs(self.acceleration), 0.998)),
            drive=float(np.max(np.abs(self.drive))) or 1.0,
            force=self.force_rms or 1.0,
            time=float(np.max(lengths)),
        )


def record_tests(
    tests: Sequence[PreparedTest],
    *,
    rate_hz: float = 500.0,
    cutoff_hz: float = 0.0,
    highest_cutoff_hz: float = np.inf,
    longest_s: float = 60.0,
    most_samples: int = MOST_SAMPLES,
) -> Recordings:
    """Concatenate prepared tests.

    Parameters
    ----------
    tests
        Prepared tests; their raw displacement and force are used.
    rate_hz
        Tests are decimated to about this rate after the displacement has been filtered. Forces are picked and never
        filtered. A test with jumps of the drive has a higher rate, and its drive is not filtered either.
    cutoff_hz
        Cut-off frequency of the displacement; 0: chosen for each test from its spectrum. A displacement from which the
        noise was removed is not filtered again.
    highest_cutoff_hz
        Upper limit of the cut-off frequencies that are chosen from spectra.
    longest_s
        Longer tests are cut to this length.
    most_samples
        Largest number of samples; of longer campaigns the same duration of every test is used.
    """
    offsets = np.array([test.displacement_offset_m for test in tests])
    stroke = max(0.5 * float(np.ptp(test.displacement_m)) for test in tests)
    periodic = np.array([test.excitation == "periodic" for test in tests])
    trusted = offsets[periodic] if periodic.any() else offsets
    one = bool(np.std(trusted) < STEADY_OFFSET_SHARE * stroke)
    shared = float(np.median(trusted))
    longest_s = min(longest_s, max(most_samples / (rate_hz * len(tests)), 4.0))
    largest = max(float(np.max(np.abs(test.drive))) for test in tests)
    rows = [
        _one_test(
            test,
            rate_hz,
            drive_jumps(test, largest),
            _cutoff(test, cutoff_hz, highest_cutoff_hz),
            shared if one else test.displacement_offset_m,
            longest_s,
        )
        for test in tests
    ]
    lengths = [len(row["force"]) for row in rows]

    def joined(name: str) -> FloatArray:
        return np.ascontiguousarray(np.concatenate([row[name] for row in rows]), dtype=np.float64)

    def numbers(name: str) -> FloatArray:
        return np.array([row[name] for row in rows], dtype=np.float64)

    return Recordings(
        displacement=joined("displacement"),
        velocity=joined("velocity"),
        acceleration=joined("acceleration"),
        drive=joined("drive"),
        force=joined("force"),
        starts=np.cumsum([0, *lengths], dtype=np.int64),
        dt=numbers("dt"),
        names=tuple(test.name for test in tests),
        test=np.repeat(np.arange(len(tests)), lengths).astype(np.int64),
        used=np.concatenate([row["used"] for row in rows]).astype(np.bool_),
        displacement_noise=numbers("displacement_noise"),
        velocity_noise=numbers("velocity_noise"),
        force_noise=numbers("force_noise"),
        force_rounding=numbers("force_rounding"),
        force_offset=numbers("force_offset"),
        period_s=numbers("period_s"),
        cutoff_hz=numbers("cutoff_hz"),
        noise_band_hz=numbers("noise_band_hz"),
        noise_repeats=numbers("noise_repeats"),
        displacement_rounding=numbers("displacement_rounding"),
        displacement_dither=numbers("displacement_dither"),
        recorded_dt=numbers("recorded_dt"),
    )


def drive_jumps(test: PreparedTest, largest: float) -> bool:
    """Return whether the drive of a test changes by 10 % of `largest` from one sample to the next."""
    return float(np.max(np.abs(np.diff(test.recorded_drive)))) > 0.1 * largest > 0.0


def spread_tests(tests: Sequence[PreparedTest], most: int = MOST_TESTS) -> list[PreparedTest]:
    """Return all tests, or every second, third, ... test of a large campaign; repeats are all kept.

    A few seconds of each of 100 tests contain less information on slow effects than twice the time of 50 tests.
    """
    kept = [test for test in tests if test.role == "repeat"]
    others = [test for test in tests if test.role != "repeat"]
    step = -(-len(others) // max(most, 1))
    chosen = {id(test) for test in [*kept, *others[:: max(step, 1)]]}
    return [test for test in tests if id(test) in chosen]


def enough_tests(tests: Sequence[PreparedTest], fewest: int = 4) -> list[PreparedTest]:
    """Return the tests; long tests are cut into pieces if there are too few tests for a cross-validation."""
    found = list(tests)
    while 0 < len(found) < fewest:
        longest = max(range(len(found)), key=lambda k: len(found[k].force_n))
        test = found.pop(longest)
        middle = len(test.force_n) // 2
        for part, piece in ((1, slice(0, middle)), (2, slice(middle, None))):
            cut = {
                name: getattr(test, name)[piece]
                for name in (
                    "time_s", "displacement_m", "velocity_m_s", "acceleration_m_s2", "drive", "force_n",
                    "displacement_raw_m", "force_raw_n", "drive_raw",
                )
            }  # fmt: skip
            inside = test.cycles[
                (test.cycles >= (piece.start or 0)) & (test.cycles < (piece.stop or len(test.force_n)))
            ]
            found.append(replace(test, name=f"{test.name}-{part}", cycles=inside - (piece.start or 0), **cut))
    return found


def _one_test(
    test: PreparedTest, rate_hz: float, jumps: bool, cutoff: float, offset: float, longest_s: float
) -> dict[str, Any]:
    rate = test.sampling_rate_hz
    if jumps:
        rate_hz = max(rate_hz, JUMP_RATE_HZ)
    raw = test.displacement_raw_m + (test.displacement_offset_m - offset)
    smooth = raw if test.motion_band_hz > 0.0 else butterworth_lowpass(raw, cutoff, rate, order=FILTER_ORDER)
    velocity, acceleration = spline_derivatives(smooth, 1.0 / rate)
    if _acceleration_was_measured(test):
        # the noise of an accelerometer is far smaller than that of a displacement differentiated twice
        acceleration = butterworth_lowpass(
            test.acceleration_m_s2, max(1.5 * cutoff, ACCELERATION_HARMONICS * test.motion_frequency_hz), rate
        )
    length = min(len(raw), int(longest_s * rate))
    stride = max(1, round(rate / max(rate_hz, 5.0 * min(cutoff, 0.1 * rate))))
    chosen = np.arange(0, length, stride)
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(smooth)))])[chosen]
    edge = chosen / rate
    used = (path >= SETTLING_SHARE * np.ptp(smooth)) & (edge > 1.0 / cutoff) & (length / rate - edge > 1.0 / cutoff)
    band = test.displacement_noise_band_hz or cutoff
    band = band if test.motion_band_hz > 0.0 else min(cutoff, band)
    noise = test.displacement_noise_m or test.channel_noise_m * np.sqrt(min(1.0, 2.0 * band / rate))
    periods = np.diff(test.cycles)
    return {
        "displacement": smooth[chosen],
        "velocity": velocity[chosen],
        "acceleration": acceleration[chosen],
        "drive": (test.recorded_drive if jumps else test.drive)[chosen],
        "force": (test.force_raw_n + test.force_offset_n)[chosen],
        "used": used,
        "dt": stride / rate,
        "displacement_noise": noise,
        "velocity_noise": noise * 2.0 * np.pi * band / np.sqrt(3.0),
        "force_noise": test.force_noise_n,
        "force_rounding": test.force_step_n / np.sqrt(12.0),
        "force_offset": test.force_offset_n,
        "period_s": float(np.median(periods)) / rate if len(periods) else 0.0,
        "cutoff_hz": cutoff,
        "noise_band_hz": band,
        "noise_repeats": test.displacement_noise_repeats if test.motion_band_hz > 0.0 else test.rounding_share,
        "displacement_rounding": test.displacement_step_m,
        "displacement_dither": test.displacement_dither_m,
        "recorded_dt": 1.0 / rate,
    }


def _cutoff(test: PreparedTest, cutoff_hz: float, highest_cutoff_hz: float) -> float:
    """Return the highest frequency of the displacement of a test [Hz]."""
    if test.motion_band_hz > 0.0:
        return float(max(test.motion_band_hz, DISPLACEMENT_HARMONICS * test.motion_frequency_hz))
    return cutoff_hz or min(test.displacement_cutoff_hz, highest_cutoff_hz)


def _acceleration_was_measured(test: PreparedTest) -> bool:
    derived = np.gradient(test.velocity_m_s, test.dt)
    difference = test.acceleration_m_s2 - derived
    return float(np.std(difference)) > 0.02 * float(np.std(derived))
