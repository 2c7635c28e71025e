"""Clocks of loggers that are far apart in forced tests, found before the search for modes.

The fine search for clocks (:mod:`mrpipe.modal.clocks.delays`) starts from fitted modes and covers a few periods of the
highest mode. Loggers that a person starts by hand differ by more, and then the modes themselves are found wrongly: the
response of one logger has another phase at each mode. The cross-spectrum of two sensors of a structure with real shapes
is real at all frequencies, and so is that of a sensor and the excitation outside the peaks. Coherency therefore gives
the delays without modes. Only delays of more than half a period at the top of the band are taken from it, because the
fine search is more exact and handles all smaller ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.ambient.clocks import ambient_clocks, reach_s
from mrpipe.modal.clocks.delays import SensorClock, corrected
from mrpipe.modal.doubts import Doubt
from mrpipe.modal.records import FrameTest, Place, Sensor
from mrpipe.modal.search.forced_modes import bands_to_try

_EXCITATION = Sensor(0, "", False)
_NEAR_LIMIT = 0.9
"""Share of the largest delay of the search from which on a delay counts as lying at its limit."""


def far_clocks(tests: Sequence[FrameTest], low_hz: float, high_hz: float) -> tuple[SensorClock, ...]:
    """Return the delays of sensors, relative to the excitation, that exceed half a period at the top of the band.

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
        own = {
            item.sensor: item for item in ambient_clocks(_with_excitation(test), low_hz, top, longest_s=reach_s(test))
        }
        ground = own.get(_EXCITATION)
        late = ground if ground is not None and abs(ground.offset_s) > 0.5 / top else None
        for sensor in test.sensors:
            item = own.get(sensor, SensorClock(test.name, sensor, 0.0, 0.0))
            if late is not None:
                offset, drift = item.offset_s - late.offset_s, item.drift - late.drift
                item = replace(item, offset_s=offset, offset_error_s=late.offset_error_s, drift=drift)
            if abs(item.offset_s) > 0.5 / top:
                found.append(item)
    return tuple(found)


def _with_excitation(test: FrameTest) -> FrameTest:
    """Return a test whose first response is its excitation, as the sensor of floor 0."""
    places = (Place(0), *(Place(sensor.floor, sensor.direction) for sensor in test.sensors))
    responses = np.column_stack([test.inputs[next(iter(test.inputs))], test.responses])
    return replace(test, responses=responses, is_displacement=(False, *test.is_displacement), places=places)


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
    findings: list[str] = []
    for test in tests:
        largest = reach_s(test)
        own = [item for item in clocks if item.test == test.name and abs(item.offset_s) > _NEAR_LIMIT * largest]
        if own:
            floors = ", ".join(f"{item.sensor.floor}{item.sensor.direction}" for item in own)
            findings.append(
                Doubt(
                    f"test {test.name}: the delay of the sensors of floor {floors} is at the limit of the search (+-"
                    f"{largest:.2g} s) and may be larger: synchronise the loggers before the modes are used"
                )
            )
    return findings
