"""Prepared tests as recordings for the identification of a damper: windows of steady cycles, motion as prepared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.filters import butterworth_lowpass, usable_cutoff
from mrpipe.signals.prepared import PreparedTest
from mrpipe.signals.spectra import cutoff_by_criterion

SETTLING_SHARE = 0.25
"""Share of a test's peak-to-peak displacement that the rod must have travelled before its force is compared.

A recording may begin anywhere on the loop while the model begins at rest; by then the hysteresis has forgotten it.
"""

BLOCKS = 40
"""A campaign is split into about this many stretches; errors within a stretch are correlated."""


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


def bench_recordings(
    tests: Sequence[PreparedTest], *, cycles: int = 0, maximum_samples: int = 30_000, raw_force: bool = False
) -> Recordings:
    """Lay windows of prepared tests end to end.

    Parameters
    ----------
    tests
        Prepared tests, all to be fitted.
    cycles
        Steady cycles of each periodic test; 0 takes whole tests.
    maximum_samples
        Forces are compared at no more than about so many samples, evenly spread; the model always runs at full rate.
    raw_force
        Compare with the unfiltered force.
    """
    windows = [fit_window(test, cycles) for test in tests]

    def joined(name: str) -> FloatArray:
        pieces = [getattr(test, name)[window] for test, window in zip(tests, windows, strict=True)]
        return np.ascontiguousarray(np.concatenate(pieces), dtype=np.float64)

    usable = [settled(test.displacement_m[window]) for test, window in zip(tests, windows, strict=True)]
    lengths = [len(piece) for piece in usable]
    used = np.concatenate(usable)
    at = np.flatnonzero(used)
    kept = np.zeros(len(used), dtype=np.bool_)
    kept[at[:: max(1, -(-len(at) // maximum_samples))]] = True
    zeros = np.zeros(len(tests))
    return Recordings(
        displacement=joined("displacement_m"),
        velocity=joined("velocity_m_s"),
        acceleration=joined("acceleration_m_s2"),
        drive=joined("drive"),
        force=joined("force_raw_n" if raw_force else "force_n"),
        starts=np.cumsum([0, *lengths], dtype=np.int64),
        dt=np.array([test.dt for test in tests], dtype=np.float64),
        names=tuple(test.name for test in tests),
        test=np.repeat(np.arange(len(tests)), lengths).astype(np.int64),
        used=kept,
        displacement_noise=zeros,
        velocity_noise=zeros,
        force_noise=zeros,
        force_rounding=zeros,
        force_offset=zeros,
        period_s=zeros,
        cutoff_hz=zeros,
        noise_band_hz=zeros,
        noise_repeats=zeros,
        displacement_rounding=zeros,
        displacement_dither=zeros,
        recorded_dt=np.array([test.dt for test in tests], dtype=np.float64),
    )


def thinned(recordings: Recordings, most: int) -> Recordings:
    """Return every k-th sample of all tests, so that about `most` are left: enough to rank forms."""
    stride = max(1, -(-len(recordings.force) // most))
    if stride == 1:
        return recordings
    pieces = [
        np.arange(first, last, stride)
        for first, last in zip(recordings.starts[:-1], recordings.starts[1:], strict=True)
    ]
    index = np.concatenate(pieces)
    usable = recordings.used.copy()
    # where only every k-th sample is compared, those in between count as usable too
    for test in range(recordings.tests):
        inside = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        compared = np.flatnonzero(recordings.used[inside])
        if len(compared) > 1 and np.max(np.diff(compared)) <= stride:
            usable[inside][compared[0] : compared[-1] + 1] = True
    return replace(
        recordings,
        displacement=recordings.displacement[index],
        velocity=recordings.velocity[index],
        acceleration=recordings.acceleration[index],
        drive=recordings.drive[index],
        force=recordings.force[index],
        test=recordings.test[index],
        starts=np.cumsum([0, *map(len, pieces)], dtype=np.int64),
        dt=recordings.dt * stride,
        used=usable[index],
    )


def blocks_of(recordings: Recordings) -> IntArray:
    """Return the stretch (one of some forty) that each sample belongs to, shape (n,)."""
    pieces = max(1, round(BLOCKS / recordings.tests))
    block = np.zeros(len(recordings.force), dtype=np.int64)
    for test in range(recordings.tests):
        inside = np.arange(recordings.starts[test], recordings.starts[test + 1])
        used = np.cumsum(recordings.used[inside])
        block[inside] = test * pieces + np.minimum(used * pieces // max(int(used[-1]), 1), pieces - 1)
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
