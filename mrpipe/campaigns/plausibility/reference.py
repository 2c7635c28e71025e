"""A flexible force map learned from all other tests, against which one test is compared.

The map is not a damper model. It is a ridge regression on the forces of elastic-plastic elements of several yield
displacements (stop operators, which carry the hysteresis), on velocity, and on saturating functions of velocity, each
multiplied by powers of the drive. It follows most dampers within a few percent in gain. The normal equations of every
test are kept apart, so that leaving tests out is cheap.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.plausibility.finding import TestArrays

POINTS = 3000
"""Largest number of samples of a test that enter the comparison."""

SAMPLES_PER_CYCLE = 60
"""Samples that remain of each cycle of the motion's mean frequency; averaging within them removes noise."""

RIDGE = 1e-4
"""Ridge parameter over the mean diagonal element of the normal equations."""

ROUNDS = 12
"""Turns in which a gain and the coefficients are found together."""

YIELD_DISPLACEMENTS = (0.02, 0.15, 0.6)
"""Yield displacements of the elastic-plastic elements over the typical RMS displacement of the tests."""

SPEEDS = (0.2, 1.0)
"""Speeds at which the force saturates, over the typical RMS velocity of the tests."""


@dataclass(frozen=True)
class Slow:
    """A test at a reduced rate: averages over blocks of samples, shape (m,) each, displacement without its mean."""

    name: str
    role: str
    interval_s: float
    displacement: FloatArray
    velocity: FloatArray
    drive: FloatArray
    force: FloatArray

    @property
    def speed_rms(self) -> float:
        """RMS velocity [m/s]."""
        return float(np.sqrt(np.mean(self.velocity**2)))

    @property
    def drive_level(self) -> float:
        """Mean of the absolute drive."""
        return float(np.mean(np.abs(self.drive)))

    @property
    def work(self) -> float:
        """Correlation of force and velocity; positive where the damper dissipates, as every damper does."""
        force = self.force - np.mean(self.force)
        scale = float(np.linalg.norm(force) * np.linalg.norm(self.velocity))
        return float(force @ self.velocity) / scale if scale > 0.0 else 0.0

    @property
    def frequency_hz(self) -> float:
        """Mean frequency of the displacement [Hz]."""
        return mean_frequency(self.displacement, 1.0 / self.interval_s)

    @property
    def frequency_ratio(self) -> float:
        """Mean frequency of the displacement over that of the force; at most 1 where a damper's force is measured."""
        below = mean_frequency(self.force, 1.0 / self.interval_s)
        return self.frequency_hz / below if below > 0.0 else 1.0

    def scaled(self, displacement: float = 1.0, force: float = 1.0, drive: float = 1.0) -> Slow:
        """Return the test with scaled channels."""
        return replace(
            self,
            displacement=self.displacement * displacement,
            velocity=self.velocity * displacement,
            force=self.force * force,
            drive=self.drive * drive,
        )

    def part(self, begin: float, end: float) -> Slow:
        """Return the part of the test between two shares of its length."""
        size = self.force.size
        chosen = slice(int(begin * size), int(end * size))
        return replace(
            self,
            displacement=self.displacement[chosen],
            velocity=self.velocity[chosen],
            drive=self.drive[chosen],
            force=self.force[chosen],
        )

    def exchanged(self, travel: float) -> Slow:
        """Return the test with displacement and force exchanged; the displacement is scaled to an RMS of `travel`."""
        displacement = self.force - np.mean(self.force)
        displacement = displacement * travel / max(float(np.std(displacement)), 1e-300)
        velocity = np.gradient(displacement, self.interval_s)
        return replace(self, displacement=displacement, velocity=velocity, force=self.displacement)


def mean_frequency(values: FloatArray, rate: float) -> float:
    """Return the mean frequency [Hz] of a channel, weighted by its power above the noise floor, without its mean."""
    centred = values - np.mean(values)
    power = np.abs(np.fft.rfft(centred * np.hanning(centred.size)))[1:] ** 2
    frequency = np.fft.rfftfreq(centred.size, 1.0 / rate)[1:]
    # the median of the upper half of the spectrum is the floor of white noise
    power = np.clip(power - 3.0 * np.median(power[power.size // 2 :]), 0.0, None)
    total = float(np.sum(power))
    return float(np.sum(power * frequency) / total) if total > 0.0 else 0.0


def slow_down(test: TestArrays) -> Slow:
    """Return block averages of a test, from the middle of the record, and its velocity."""
    rate = test.rate_hz
    frequency = mean_frequency(test.displacement_m, rate)
    block = max(1, int(rate / max(SAMPLES_PER_CYCLE * frequency, 1e-9))) if frequency > 0.0 else 1
    block = min(block, max(1, test.displacement_m.size // 200))
    count = min(test.displacement_m.size // block, POINTS)
    first = (test.displacement_m.size - count * block) // 2

    def average(values: FloatArray) -> FloatArray:
        return np.asarray(values[first : first + count * block].reshape(count, block).mean(axis=1))

    displacement = average(test.displacement_m)
    displacement = displacement - np.mean(displacement)
    interval = block / rate
    given = test.velocity_m_s
    velocity = np.gradient(displacement, interval) if given is None else average(given)
    return Slow(test.name, test.role, interval, displacement, velocity, average(test.drive), average(test.force_n))


def moving_tests(tests: Sequence[TestArrays]) -> list[Slow]:
    """Return block averages of the tests in which something moves."""
    return [
        slow_down(test)
        for test in tests
        if test.time_s.size >= 100 and np.std(test.displacement_m) > 0.0 and np.std(test.force_n) > 0.0
    ]


@dataclass(frozen=True)
class Normal:
    """Normal equations of one test: mean products of centred features (p, p), with the force (p,), and of the force."""

    matrix: FloatArray
    vector: FloatArray
    power: float


class ReferenceMap:
    """Normal equations of all tests; predictions for one test from any set of others.

    Parameters
    ----------
    tests
        Tests that are compared; at least two.
    """

    def __init__(self, tests: Sequence[Slow]) -> None:
        self._speed = _typical([test.speed_rms for test in tests])
        self.travel = _typical([float(np.std(test.displacement)) for test in tests])
        self._drive = _typical([float(np.abs(test.drive).max()) for test in tests])
        self._force = _typical([float(np.std(test.force)) for test in tests])
        levels = np.unique(np.round([test.drive_level / self._drive for test in tests], 1))
        self._powers = min(2, levels.size - 1)
        self.parts = [self.normal(test) for test in tests]
        # tests count by relative error, but a test of far smaller force must not outweigh all others
        weights = [1.0 / (part.power + (0.1 * self._force) ** 2) for part in self.parts]
        self._matrices = np.stack([weight * part.matrix for weight, part in zip(weights, self.parts, strict=True)])
        self._vectors = np.stack([weight * part.vector for weight, part in zip(weights, self.parts, strict=True)])

    def coefficients(self, without: Collection[int]) -> FloatArray:
        """Return the coefficients that fit all tests but those with the indices `without`, shape (p,)."""
        kept = [index for index in range(len(self.parts)) if index not in without]
        solved = self._solved(self._matrices[kept].sum(axis=0)[None], self._vectors[kept].sum(axis=0)[None])
        return np.asarray(solved[0])

    def jackknife(self, without: Collection[int]) -> FloatArray:
        """Return the coefficients without one more test each, for all tests not in `without`, shape (m, p)."""
        kept = [index for index in range(len(self.parts)) if index not in without]
        matrices = self._matrices[kept].sum(axis=0) - self._matrices[kept]
        return self._solved(matrices, self._vectors[kept].sum(axis=0) - self._vectors[kept])

    def joint_gains(self, part: Normal, without: Collection[int], gains: FloatArray, *, jackknife: bool) -> FloatArray:
        """Return the gain of a test, with coefficients that are fitted to it and to the tests but `without` together.

        The test enters the fit with its gain free, so its shape helps to determine the coefficients, and its size does
        not. Gain and coefficients are found by turns.

        Parameters
        ----------
        part
            Normal equations of the test, which is one of `without`.
        without
            Indices of the tests that are left out.
        gains
            First estimates, shape (m,).
        jackknife
            Whether one gain is wanted for each further test left out; otherwise m is 1.
        """
        kept = [index for index in range(len(self.parts)) if index not in without]
        matrices, vectors = self._matrices[kept].sum(axis=0)[None], self._vectors[kept].sum(axis=0)[None]
        if jackknife:
            matrices, vectors = matrices - self._matrices[kept], vectors - self._vectors[kept]
        weight = 1.0 / (part.power + (0.1 * self._force) ** 2)
        # the coefficients are linear in 1 / gain, so the equations are solved once for all rounds
        together = matrices + weight * part.matrix
        others, own = self._solved(together, vectors), self._solved(together, weight * part.vector[None])
        for _ in range(ROUNDS):
            size = np.clip(gains, 1e-3, 1e3)
            # a test of gain g is compared as force over g, so that its weight is that of a test of gain 1
            found = others + own / size[:, None]
            product = found @ part.vector
            power = np.einsum("ij,jk,ik->i", found, part.matrix, found)
            gains = np.where(power > 0.0, product / np.where(power > 0.0, power, 1.0), 0.0)
        return gains

    def _solved(self, matrices: FloatArray, vectors: FloatArray) -> FloatArray:
        size = matrices.shape[-1]
        ridge = RIDGE * np.trace(matrices, axis1=1, axis2=2)[:, None, None] / size * np.eye(size)
        return np.asarray(np.linalg.solve(matrices + ridge, vectors[:, :, None])[:, :, 0])

    def predict(self, test: Slow, without: Collection[int]) -> FloatArray:
        """Return the force [N], without its mean, that the tests but those in `without` give for `test`, shape (m,)."""
        return np.asarray(self._features(test) @ self.coefficients(without))

    def normal(self, test: Slow) -> Normal:
        """Return the normal equations of a test."""
        features = self._features(test)
        force = test.force - np.mean(test.force)
        size = force.size
        return Normal(features.T @ features / size, features.T @ force / size, float(force @ force) / size)

    def _features(self, test: Slow) -> FloatArray:
        speed = test.velocity / self._speed
        drive = np.abs(test.drive) / self._drive
        shapes = [_stop(test.displacement / self.travel, limit) for limit in YIELD_DISPLACEMENTS]
        shapes += [np.tanh(speed / scale) for scale in SPEEDS]
        shapes.append(speed)
        columns = [shape * drive**power for shape in shapes for power in range(self._powers + 1)]
        columns.append(test.displacement / self.travel)
        features = np.stack(columns, axis=1) * self._force
        return np.asarray(features - features.mean(axis=0))


def _stop(displacement: FloatArray, limit: float) -> FloatArray:
    """Return the force of an elastic-plastic element that yields at an elongation of `limit`, over its yield force."""
    force, before = 0.0, float(displacement[0])
    forces = []
    for value in displacement.tolist():
        force = min(max(force + value - before, -limit), limit)
        before = value
        forces.append(force)
    return np.asarray(forces) / limit


def _typical(values: Sequence[float]) -> float:
    positive = [value for value in values if value > 0.0]
    return float(np.median(positive)) if positive else 1.0
