"""Which samples a fit sees, and the scales that its guesses follow from."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.dampers.form import Scales
from mrpipe.dampers.motion import Motion, motion_of
from mrpipe.signals.filters import butterworth_lowpass, usable_cutoff
from mrpipe.signals.prepared import PreparedTest
from mrpipe.signals.spectra import cutoff_by_criterion

SETTLING_SHARE = 0.25
"""Share of a test's peak-to-peak displacement that the rod must have travelled before its force is compared.

A recording may begin anywhere on the loop while the model begins at rest; by then the hysteresis has forgotten it.
"""


@dataclass(frozen=True)
class FitData:
    """Motion at full rate, and the samples at which forces are compared.

    Attributes
    ----------
    motion
        The recordings, or windows of them.
    force
        Measured force at the samples compared [N], shape (m,).
    at
        Their places in the motion, shape (m,).
    test
        The recording that each belongs to, shape (m,).
    block
        The stretch (one of some forty) that each belongs to: errors within a stretch hang together, shape (m,).
    """

    motion: Motion
    force: FloatArray
    at: IntArray
    test: IntArray
    block: IntArray

    def subset(self, keep: BoolArray) -> FitData:
        """Return the same motion with fewer samples compared."""
        return FitData(self.motion, self.force[keep], self.at[keep], self.test[keep], self.block[keep])

    def thinned(self, maximum_motion: int) -> FitData:
        """Return every k-th sample of the motion (and the forces there) so that about `maximum_motion` are left."""
        stride = max(1, -(-len(self.motion.drive) // maximum_motion))
        if stride == 1:
            return self
        motion = self.motion
        kept = [np.arange(first, last, stride) for first, last in itertools.pairwise(motion.starts)]
        index = np.concatenate(kept)
        thin = Motion(
            motion.displacement[index],
            motion.velocity[index],
            motion.acceleration[index],
            motion.drive[index],
            starts=np.cumsum([0, *map(len, kept)], dtype=np.int64),
            dt=motion.dt * stride,
        )
        # the forces are known at the samples compared alone: between two neighbours they run straight, gaps stay gaps
        order = np.searchsorted(self.at, index)
        inside = (order > 0) & (order < len(self.at))
        left, right = np.clip(order - 1, 0, len(self.at) - 1), np.clip(order, 0, len(self.at) - 1)
        owner = thin.test_of_sample()
        inside &= (self.test[left] == owner) & (self.test[right] == owner)
        inside &= self.at[right] - self.at[left] <= 1.5 * np.median(np.diff(self.at))
        at = np.flatnonzero(inside).astype(np.int64)
        force = np.interp(index[at], self.at, self.force)
        return FitData(thin, force, at, owner[at], self.block[right[at]])


def settled(displacement: FloatArray) -> BoolArray:
    """Return where the model has forgotten how it began, shape (n,)."""
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(displacement)))])
    return np.asarray(path >= SETTLING_SHARE * np.ptp(displacement), dtype=np.bool_)


def fit_window(test: PreparedTest, cycles: int) -> slice:
    """Return the first `cycles` steady cycles of a periodic test, with half a cycle to settle; else all of it."""
    if cycles <= 0 or test.excitation != "periodic" or len(test.cycles) < 2:
        return slice(None)
    length = int(test.cycles[1] - test.cycles[0])
    last = int(test.cycles[min(cycles, len(test.cycles) - 1)])
    return slice(max(int(test.cycles[0]) - length // 2, 0), last)


def fit_data(
    tests: Sequence[PreparedTest], *, cycles: int = 0, maximum_samples: int = 30_000, raw_force: bool = False
) -> FitData:
    """Choose the samples of a fit.

    Parameters
    ----------
    tests
        Prepared tests, all to be fitted.
    cycles
        Steady cycles of each periodic test; 0 takes whole tests.
    maximum_samples
        Forces are compared at no more than about so many, evenly spread; the model always runs at full rate.
    raw_force
        Compare with the unfiltered force.
    """
    windows = [fit_window(test, cycles) for test in tests]
    motion = motion_of(tests, windows)
    forces = [(test.force_raw_n if raw_force else test.force_n)[w] for test, w in zip(tests, windows, strict=True)]
    force = np.concatenate(forces)
    usable = np.concatenate([settled(test.displacement_m[w]) for test, w in zip(tests, windows, strict=True)])
    at = np.flatnonzero(usable)
    at = at[:: max(1, -(-len(at) // maximum_samples))]
    owner = motion.test_of_sample()[at]
    return FitData(motion, force[at], at.astype(np.int64), owner, _blocks(owner, motion.tests))


def _blocks(owner: IntArray, tests: int) -> IntArray:
    """Split every test into equal stretches, so that there are about forty."""
    pieces = max(1, round(40 / tests))
    block = np.zeros(len(owner), dtype=np.int64)
    for test in range(tests):
        inside = np.flatnonzero(owner == test)
        block[inside] = test * pieces + (np.arange(len(inside)) * pieces) // max(len(inside), 1)
    return block


def smooth_motion(tests: Sequence[PreparedTest]) -> list[PreparedTest]:
    """Return the tests with the displacement of periodic ones low-passed where it sinks into its noise.

    Hysteresis adds up path, and at a reversal a yielding damper turns micrometres of noise into newtons: left in, they
    shorten the yield displacement and bend the share of gamma. The filter has no phase; random motion stays as it is.
    """
    smoothed = []
    for test in tests:
        cutoff = None
        if test.excitation == "periodic":
            found = cutoff_by_criterion(test.displacement_raw_m, test.sampling_rate_hz)
            cutoff = usable_cutoff(found, test.sampling_rate_hz)
        if cutoff is None:
            smoothed.append(test)
            continue
        displacement = butterworth_lowpass(test.displacement_m, cutoff, test.sampling_rate_hz)
        smoothed.append(replace(test, displacement_m=displacement))
    return smoothed


def distinct_levels(tests: Sequence[PreparedTest]) -> int:
    """Return how many levels of drive the tests hold, told apart at 2 % of the largest; 99 where it varies."""
    largest = max(float(np.abs(test.drive).max()) for test in tests)
    if largest == 0.0:
        return 1
    if drive_varies(tests):
        return 99
    means = np.sort([float(np.mean(test.drive)) for test in tests])
    return 1 + int(np.sum(np.diff(means) > 0.02 * largest))


def drive_varies(tests: Sequence[PreparedTest]) -> bool:
    """Return whether the drive changes within any test by more than 5 % of the largest."""
    largest = max(float(np.abs(test.drive).max()) for test in tests)
    return any(float(np.ptp(test.drive)) > 0.05 * largest for test in tests) and largest > 0.0


def scales_of(
    tests: Sequence[PreparedTest], *, yield_order: int = 3, viscosity_order: int = 1, assumed_eta: float = 100.0
) -> Scales:
    """Return the scales of a set of tests; orders are lowered to what the levels of drive can tell."""
    levels = distinct_levels(tests)
    limit = max(float(np.abs(test.drive).max()) for test in tests)
    return Scales(
        stroke=float(np.median([0.5 * np.ptp(test.displacement_m) for test in tests])),
        peak_speed=max(float(np.abs(test.velocity_m_s).max()) for test in tests),
        peak_force=max(float(np.abs(test.force_n).max()) for test in tests),
        drive_limit=limit if limit > 0.0 else 1.0,
        drive_unit=tests[0].drive_unit or "A",
        yield_order=min(yield_order, levels - 1),
        viscosity_order=min(viscosity_order, levels - 1),
        lag_known=drive_varies(tests),
        assumed_eta=assumed_eta,
    )
