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
"""Forces are compared after the rod has travelled this share of the peak-to-peak displacement.

A recording may begin anywhere on the loop, but the model begins at rest; after this path the initial state of the
hysteresis has no effect.
"""

BLOCKS = 40
"""A campaign is divided into about this many parts; errors within a part are correlated."""


def settled(displacement: FloatArray) -> BoolArray:
    """Return the samples at which the initial state of the model no longer has an effect, shape (n,) of bool."""
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(displacement)))])
    return np.asarray(path >= SETTLING_SHARE * np.ptp(displacement), dtype=np.bool_)


def fit_window(test: PreparedTest, cycles: int) -> slice:
    """Return the first `cycles` steady cycles of a periodic test plus half a cycle to settle, or else all samples."""
    if cycles <= 0 or test.excitation != "periodic" or len(test.cycles) < 2:
        return slice(None)
    length = int(test.cycles[1] - test.cycles[0])
    last = int(test.cycles[min(cycles, len(test.cycles) - 1)])
    return slice(max(int(test.cycles[0]) - length // 2, 0), last)


def bench_recordings(
    tests: Sequence[PreparedTest], *, cycles: int = 0, maximum_samples: int = 30_000, raw_force: bool = False
) -> Recordings:
    """Concatenate windows of prepared tests.

    Parameters
    ----------
    tests
        Prepared tests that are fitted.
    cycles
        Number of steady cycles of each periodic test; 0: whole tests.
    maximum_samples
        Largest number of samples, evenly spread, at which forces are compared; the model always runs at the full rate.
    raw_force
        Whether the unfiltered force is compared.
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
    """Return every k-th sample of all tests, about `most` in total, which is sufficient to rank forms."""
    stride = max(1, -(-len(recordings.force) // most))
    if stride == 1:
        return recordings
    pieces = [
        np.arange(first, last, stride)
        for first, last in zip(recordings.starts[:-1], recordings.starts[1:], strict=True)
    ]
    index = np.concatenate(pieces)
    usable = recordings.used.copy()
    # if only every k-th sample is compared, the samples in between count as usable too
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
    """Return the index of the part of the campaign (one of about 40) of each sample, shape (n,)."""
    pieces = max(1, round(BLOCKS / recordings.tests))
    block = np.zeros(len(recordings.force), dtype=np.int64)
    for test in range(recordings.tests):
        inside = np.arange(recordings.starts[test], recordings.starts[test + 1])
        used = np.cumsum(recordings.used[inside])
        block[inside] = test * pieces + np.minimum(used * pieces // max(int(used[-1]), 1), pieces - 1)
    return block


def smooth_motion(tests: Sequence[PreparedTest]) -> list[PreparedTest]:
    """Return the tests; the displacement of periodic tests is low-passed where noise exceeds its spectrum.

    The hysteresis depends on the path, and at a reversal micrometres of displacement noise cause newtons of force.
    Without the filter, the noise reduces the fitted yield displacement and biases the share of gamma. The filter has
    zero phase; random motion is not filtered.
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
