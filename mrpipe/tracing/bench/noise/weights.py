"""Weights of the samples, from the noise of the channels and from differences of repeated motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.fitting.engine import Fit, predict
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.noise.hum import hum_variance
from mrpipe.tracing.bench.noise.motion_noise import noisy_motion
from mrpipe.tracing.bench.noise.repeat_factors import Differences, parts_of_differences
from mrpipe.tracing.rules import NoiseRules

MOST_SHIFT = 3.0
"""Numerical technique: largest shift, in samples, by which two motions are aligned in time."""

SHORTEST_CYCLE = 8
"""Numerical technique: cycles with fewer samples are not compared sample by sample."""

AVERAGED = 0.03
"""Numerical technique: time, in periods of the motion, over which the simulated variance of the noise is averaged."""

TOP = 0.9
"""Numerical technique: quantile above which a part of the noise counts as large."""


@dataclass(frozen=True)
class NoiseScale:
    """Factors by which the variance of the noise exceeds that of the white noise of the channels.

    White noise of a channel is visible at its highest frequencies. Noise in the band of the motion, hum, and motion
    that the machine does not repeat are not visible there, but in differences of repeated motion.

    Attributes
    ----------
    force, motion
        Factors on the variance of the force channel's noise, and on that of the force that displacement noise causes.
    repeats, cycles
        Number of pairs of repeated tests and of repeated cycles that the factors are estimated from.
    events
        Root mean square, over all samples of these pairs, of the force of single events that do not repeat [N].
    disturbance
        Root mean square of a force that does not repeat and that grows with the speed [N].
    hum
        Variance of the hum of the mains over that of the force channel's noise; 0 where none is visible.
    """

    force: float = 1.0
    motion: float = 1.0
    repeats: int = 0
    cycles: int = 0
    events: float = 0.0
    disturbance: float = 0.0
    hum: float = 0.0

    @property
    def source(self) -> str:
        """Return in words what the noise was estimated from."""
        parts = [f"{self.repeats} repeated pairs of tests"] if self.repeats else []
        parts += [f"{self.cycles} repeated pairs of cycles"] if self.cycles else []
        return " and ".join(parts) or "sensor channels"


AS_SHOWN = NoiseScale()
"""Noise as the channels show it: all factors are 1."""


def noise_variances(
    found: Fit, recordings: Recordings, rules: NoiseRules | None = None, *, draws: int = 3
) -> tuple[FloatArray, FloatArray]:
    """Return the variances of the force due to white noise of the force and the displacement channel [N^2], (n,) each.

    The variance due to the displacement is (F(x + noise) - F(x))^2 from simulations, averaged over a short time. At a
    reversal the force rises by hundreds of newtons per millimetre, so that micrometres of displacement noise cause
    newtons of force. Where the rod rests or creeps, noise reverses the hysteresis repeatedly. A linearisation does not
    show this.

    Parameters
    ----------
    found
        The fit.
    recordings
        Tests laid end to end.
    rules
        Rules whose `seed` is that of the simulated noise; their defaults if None.
    draws
        Number of simulated noise records.
    """
    rng = np.random.default_rng((rules or NoiseRules()).seed)
    calm = predict(found, recordings)
    spread = np.zeros(len(calm))
    for _ in range(draws):
        spread += np.square(predict(found, noisy_motion(recordings, rng)) - calm)
    averaged = _locally_averaged(spread / draws, recordings)
    return np.asarray(recordings.force_noise[recordings.test] ** 2), averaged


def sensor_deviation(
    found: Fit, recordings: Recordings, scale: NoiseScale = AS_SHOWN, rules: NoiseRules | None = None
) -> FloatArray:
    """Return the standard deviation of the force that noise explains [N], shape (n,)."""
    force, motion = noise_variances(found, recordings, rules)
    return np.asarray(np.sqrt(scale.force * force + scale.motion * motion), dtype=np.float64)


def noise_scale(found: Fit, rules: NoiseRules | None = None) -> NoiseScale:
    """Return the noise in repeated tests and cycles, in units of the noise that the channels show.

    The error of a model is the same function of the motion in both repeats, so it cancels in the difference of their
    residuals. The squared differences are regressed on the two variances of the channels, and on one that grows with
    the speed; no factor is negative. The noise of a channel does not depend on the speed. The third part is therefore
    not noise, but a force that motion and drive do not determine, such as a disturbance that is not synchronous with
    the motion, or a damper that changes from cycle to cycle. Hum of the mains is estimated separately, because it can
    be equal in both repeats.
    """
    rules = rules or NoiseRules()
    problem = found.problem
    recordings, root = problem.recordings, problem.root_weight
    repeats, cycles = _repeats(recordings, rules), _cycles(recordings, rules)
    residual = np.divide(found.residual, root, out=np.zeros_like(root), where=root > 0.0)
    force, motion = noise_variances(found, recordings, rules)
    growing = force * _relative_speed(recordings)
    rows, differences, steps = [], [], []
    for first, second in (*repeats, *cycles):
        begin, part = _aligned(recordings, first, second)
        end = np.minimum(begin + 1, len(root) - 1)
        both = (root[first] > 0.0) & (root[begin] > 0.0) & (root[end] > 0.0)
        a, b, c = first[both], begin[both], end[both]
        left, right = (1.0 - part) ** 2, part**2
        rows.append(
            np.stack([values[a] + left * values[b] + right * values[c] for values in (force, motion, growing)], axis=1)
        )
        steps.append(12.0 * recordings.force_rounding[recordings.test[a]] ** 2)
        differences.append(residual[a] - (1.0 - part) * residual[b] - part * residual[c])
    used = root > 0.0
    # the sum of white noise and hum of the channel cannot exceed the total noise
    hum = hum_variance(residual, recordings, rules) / max(float(np.mean(force[used])), 1e-300)
    hum = hum if hum <= rules.most_hum else 0.0
    least = 1.0 + hum
    if not rows or sum(map(len, differences)) < rules.least_samples:
        limit = _limit(residual[used], least * force[used] + motion[used], recordings.test[used])
        return NoiseScale(limit * least, limit, hum=hum)
    found_in = Differences(tuple(differences), np.concatenate(rows), np.concatenate(steps))
    columns, target = found_in.columns, found_in.squares
    factors, without, disturbed = parts_of_differences(found_in, rules)
    # a difference contains the events of both repeats
    events, disturbance = (float(np.sqrt(0.5 * np.mean(part))) for part in (target - without, disturbed))
    target = without - disturbed
    # no part exceeds the difference: force noise in total, motion noise where its part is largest
    most = columns[:, 1] >= np.quantile(columns[:, 1], TOP)
    parts = ((target, columns[:, 0]), (target[most], columns[most, 1]))
    largest = [float(np.sum(all_)) / max(float(np.sum(part)), 1e-300) for all_, part in parts]
    force_factor, motion_factor = (
        max(min(float(factor), limit), rules.least_factor) for factor, limit in zip(factors, largest, strict=True)
    )
    # rounding errors, and errors of the filter, are equal in repeated motion, so that the difference does not show them
    lasting = recordings.noise_repeats[recordings.test] * motion
    motion_factor = max(motion_factor, float(np.sum(lasting[used])) / max(float(np.sum(motion[used])), 1e-300))
    rounding = recordings.force_rounding[recordings.test] ** 2
    force_factor = max(force_factor, float(np.sum(rounding)) / max(float(np.sum(force)), 1e-300))
    if least > 1.0:
        force_factor = max(force_factor, least)
    limit = _limit(residual[used], (force_factor * force + motion_factor * motion)[used], recordings.test[used])
    return NoiseScale(limit * force_factor, limit * motion_factor, len(repeats), len(cycles), events, disturbance, hum)


def _relative_speed(recordings: Recordings) -> FloatArray:
    """Return the speed in units of the RMS speed of its test, shape (n,)."""
    power = np.bincount(recordings.test, weights=recordings.velocity**2, minlength=recordings.tests)
    rms = np.sqrt(power / np.maximum(np.bincount(recordings.test, minlength=recordings.tests), 1))
    return np.asarray(np.abs(recordings.velocity) / np.maximum(rms, 1e-300)[recordings.test])


def _limit(residual: FloatArray, variance: FloatArray, test: IntArray) -> float:
    """Return the factor, at most 1, on the noise variance, because noise cannot exceed the residual of the model.

    The simulated variance can be several times too large in one test, if the rod rests for a long time and noise
    reverses a hysteresis that depends on velocity or acceleration. The limit for the sums would then reduce the noise
    of all other tests, and the mean of the limits of the tests takes its place. The mean alone would be too small,
    because noise is above its expected power in some tests and below it in others.
    """
    overall = float(np.sum(residual**2)) / max(float(np.sum(variance)), 1e-300)
    return max(min(1.0, overall), float(np.mean(noise_limits(residual, variance, test)[test])))


def noise_limits(residual: FloatArray, variance: FloatArray, test: IntArray, tests: int = 0) -> FloatArray:
    """Return the factor, at most 1, by which the noise variance of each test stays below its residual, shape (tests,).

    Parameters
    ----------
    residual, variance, test
        Residual [N], variance of the noise [N^2] and test of each sample, shape (n,).
    tests
        Least number of tests, if the samples are not of all tests.
    """
    left = np.bincount(test, weights=residual**2, minlength=tests)
    noise = np.bincount(test, weights=variance, minlength=tests)
    return np.asarray(np.minimum(1.0, left / np.maximum(noise, 1e-300)), dtype=np.float64)


def _aligned(recordings: Recordings, first: IntArray, second: IntArray) -> tuple[IntArray, float]:
    """Return the indices, and the fraction of a sample beyond them, at which the second motion equals the first one.

    A period is rarely a whole number of samples. Without the fraction an error of the model that changes fast in time
    would not cancel.
    """
    dt = recordings.dt[recordings.test[second[0]]]
    step = recordings.velocity[second] * dt
    ahead = recordings.displacement[first] - recordings.displacement[second]
    shift = float(ahead @ step) / max(float(step @ step), 1e-300)
    whole = int(np.floor(shift)) if abs(shift) < MOST_SHIFT else 0
    part = shift - whole if abs(shift) < MOST_SHIFT else 0.0
    return np.clip(second + whole, 0, len(recordings.force) - 1), part


def _repeats(recordings: Recordings, rules: NoiseRules) -> list[tuple[IntArray, IntArray]]:
    starts = recordings.starts
    return [
        (np.arange(starts[first], starts[first + 1]), np.arange(starts[second], starts[second + 1]))
        for first, second in repeated_pairs(recordings, rules)
    ]


def _cycles(recordings: Recordings, rules: NoiseRules) -> list[tuple[IntArray, IntArray]]:
    """Return the samples of one cycle and of the next, for tests whose motion and drive repeat from cycle to cycle."""
    found = []
    largest = max(float(np.max(np.abs(recordings.drive))), 1e-12)
    for test in np.flatnonzero(recordings.period_s > 0.0):
        period = round(recordings.period_s[test] / recordings.dt[test])
        first, end = int(recordings.starts[test]), int(recordings.starts[test + 1])
        if period < SHORTEST_CYCLE or first + 2 * period > end:
            continue
        for begin in range(first, end - 2 * period + 1, 2 * period):
            a = np.arange(begin, begin + period)
            b = a + period
            x, y = recordings.displacement[a], recordings.displacement[b]
            alike = np.sqrt(np.mean((recordings.drive[a] - recordings.drive[b]) ** 2)) < rules.same_drive * largest
            if alike and np.std(x - y) < rules.same_motion * np.std(x):
                found.append((a, b))
    return found


def _locally_averaged(values: FloatArray, recordings: Recordings) -> FloatArray:
    result = np.empty_like(values)
    times = AVERAGED * recordings.motion_period_s
    for test in range(recordings.tests):
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        width = 2 * max(1, round(0.5 * times[test] / recordings.dt[test])) + 1
        result[piece] = ndimage.uniform_filter1d(values[piece], width, mode="nearest")
    return result


def force_deviation(
    found: Fit,
    recordings: Recordings,
    model_error_share: float = 0.0,
    scale: NoiseScale = AS_SHOWN,
    rules: NoiseRules | None = None,
) -> FloatArray:
    """Return the standard deviation of noise and expected model error [N], shape (n,); its inverse is the root weight.

    Parameters
    ----------
    found
        Fit whose model is simulated.
    recordings
        Tests.
    model_error_share
        Expected model error, as a share of the RMS force.
    scale
        Factors on the force noise and on the motion noise.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or NoiseRules()
    floor = max(rules.least_share, model_error_share) * recordings.force_rms
    return np.asarray(np.hypot(sensor_deviation(found, recordings, scale, rules), floor), dtype=np.float64)


def repeated_pairs(recordings: Recordings, rules: NoiseRules | None = None) -> list[tuple[int, int]]:
    """Return pairs of tests with the same motion and drive, within the accuracy of the machine."""
    rules = rules or NoiseRules()
    pairs = []
    starts = recordings.starts
    drive_scale = max(float(np.max(np.abs(recordings.drive))), 1e-12)
    for first in range(recordings.tests):
        for second in range(first + 1, recordings.tests):
            if starts[first + 1] - starts[first] != starts[second + 1] - starts[second]:
                continue
            a, b = slice(starts[first], starts[first + 1]), slice(starts[second], starts[second + 1])
            x, y = recordings.displacement[a], recordings.displacement[b]
            same = np.std(x - y) < rules.same_motion * np.std(x)
            difference = np.sqrt(np.mean((recordings.drive[a] - recordings.drive[b]) ** 2))
            alike = difference < rules.same_drive * drive_scale
            if same and alike and np.std(x) > 0.0:
                pairs.append((first, second))
    return pairs
