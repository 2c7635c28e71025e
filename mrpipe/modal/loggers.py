"""Clocks of loggers that are far apart in forced tests, found before the search for modes.

The fine search for clocks (:mod:`mrpipe.modal.clocks.delays`) starts from fitted modes and covers a few periods of the
highest mode. Loggers that a person starts by hand differ by more, and then the modes themselves are found wrongly: the
response of one logger has another phase at each mode. The cross-spectrum of two sensors of a structure with real shapes
is real at all frequencies, also under a measured excitation, so that the coherency of the sensors gives their relative
delays without modes. Only delays of more than half a period at the top of the band are taken from it, because the fine
search is more exact and handles all smaller ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.ambient.clocks import ambient_clocks, largest_reach_s
from mrpipe.modal.clocks.delays import SensorClock, corrected
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.forced_modes import bands_to_try

_NEAR_LIMIT = 0.9
"""Share of the largest delay of the search from which on a delay counts as lying at its limit."""


def far_clocks(tests: Sequence[FrameTest], low_hz: float, high_hz: float) -> tuple[SensorClock, ...]:
    """Return the delays of sensors of forced tests that exceed half a period at the top of the band.

    Parameters
    ----------
    tests
        Forced tests.
    low_hz, high_hz
        Settings of the user; 0 for `high_hz`: up to the end of the excitation.
    """
    found: list[SensorClock] = []
    for test in tests:
        if len({sensor.direction for sensor in test.sensors}) > 1:
            # directions of a building may move independently, and then their cross-spectrum has no meaning
            continue
        top = bands_to_try([test], low_hz, high_hz)[-1][1]
        own = ambient_clocks(test, low_hz, top, reach_s=largest_reach_s(test))
        found += [item for item in own if abs(item.offset_s) > 0.5 / top]
    return tuple(found)


def aligned(test: FrameTest, clocks: Sequence[SensorClock]) -> FrameTest:
    """Return a test without the delays of its sensors, cut to the time that all of its channels cover.

    Parameters
    ----------
    test
        A test.
    clocks
        Delays, also of other tests.
    """
    own = [item for item in clocks if item.test == test.name]
    if not own:
        return test
    samples, rate = test.responses.shape[0], test.sampling_rate_hz
    time = np.arange(samples) / rate
    moved = np.array([time + item.delay(time) for item in own])
    covered = np.flatnonzero(np.all((moved >= 0.0) & (moved <= time[-1]), axis=0))
    part = slice(int(covered[0]), int(covered[-1]) + 1)

    def cut(values: FloatArray) -> FloatArray:
        return np.asarray(values[part])

    whole = corrected(test, own)
    return replace(
        whole,
        excitation=None if whole.excitation is None else cut(whole.excitation),
        responses=cut(whole.responses),
        displacements=tuple((floor, cut(values)) for floor, values in whole.displacements),
        further_inputs=tuple((place, cut(values)) for place, values in whole.further_inputs),
    )


def limit_findings(tests: Sequence[FrameTest], clocks: Sequence[SensorClock]) -> list[str]:
    """Return a sentence for each test with a delay at the limit of the search, because the true one may be larger.

    Parameters
    ----------
    tests, clocks
        The tests, and the delays that were found.
    """
    findings = []
    for test in tests:
        largest = largest_reach_s(test)
        own = [item for item in clocks if item.test == test.name and abs(item.offset_s) > _NEAR_LIMIT * largest]
        if own:
            floors = ", ".join(f"{item.sensor.floor}{item.sensor.direction}" for item in own)
            findings.append(
                f"test {test.name}: the delay of the sensors of floor {floors} is at the limit of the search (+-"
                f"{largest:.2g} s) and may be larger: synchronise the loggers before the modes are used"
            )
    return findings
