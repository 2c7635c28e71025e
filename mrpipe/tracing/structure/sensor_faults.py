"""Faults of accelerometers that explain the residual of a linear frame: gain, sign, delay, exchanged floors.

A fault of one sensor is a linear error that no effect of the library describes. It enters the equation of motion of
every storey below the sensor through the inertia, and the storeys that the floor is coupled to through the motion. One
sensor after another is therefore given an unknown gain and delay, in all tests or in a single one, and the linear frame
is fitted again. A fault is reported if the corrected records leave little above the noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import ComplexArray
from mrpipe.tracing.structure.fit import Base, base_rows
from mrpipe.tracing.structure.records import FrameRecord
from mrpipe.tracing.structure.spectra import Spectra, storey_sums
from mrpipe.words import listed

SURE = 3.0
"""Numerical technique: a value that differs from that of a sound sensor by more standard errors is mentioned."""

LEAST_DELAY_S = 5e-5
"""Numerical technique: a smaller delay is not mentioned; it turns lines at 50 Hz by less than a degree."""


@dataclass(frozen=True)
class SensorFault:
    """A fault of a sensor of the acceleration of a floor or of the ground.

    Attributes
    ----------
    floor
        Floor of the sensor, from 1; 0: the ground.
    test
        Test in which the sensor has the fault; empty: all tests.
    gain
        Measured over true acceleration [1].
    delay_s
        Time by which the recorded acceleration is late [s].
    exchanged_with
        Floor whose sensor has been exchanged with this one; 0: none.
    gain_error, delay_error_s
        Standard errors of both [1], [s].
    explained
        Share of the residual above the noise that the correction of the sensor removes [1].
    """

    floor: int
    test: str = ""
    gain: float = 1.0
    delay_s: float = 0.0
    exchanged_with: int = 0
    gain_error: float = 0.0
    delay_error_s: float = 0.0
    explained: float = 0.0

    @property
    def channel(self) -> str:
        """Name of the channel in campaign.yaml."""
        return f"floor_acceleration_{self.floor}" if self.floor else "ground_acceleration"

    def as_json(self) -> dict[str, Any]:
        """Return the keys of docs/close-loop-json.md."""
        return {
            "channel": self.channel,
            "test": self.test or None,
            "gain": self.gain,
            "gain_error": self.gain_error,
            "delay_s": self.delay_s,
            "delay_error_s": self.delay_error_s,
            "exchanged_with": f"floor_acceleration_{self.exchanged_with}" if self.exchanged_with else None,
            "explained": self.explained,
        }

    def sentence(self) -> str:
        """Return what is wrong with the sensor, in words."""
        where = f"in test {self.test}" if self.test else "in all tests"
        if self.exchanged_with:
            return f"{self.channel} and floor_acceleration_{self.exchanged_with} are exchanged {where}"
        # a value within three standard errors of that of a sound sensor is not mentioned
        said = []
        gain = f"{self.gain:.3g}"
        if gain != "1" and abs(self.gain - 1.0) > SURE * self.gain_error:
            said.append(f"a gain of {gain}")
        if abs(self.delay_s) > max(SURE * self.delay_error_s, LEAST_DELAY_S):
            said.append(f"a delay of {1e3 * self.delay_s:.2g} ms")
        text = f"{self.channel} has {listed(said)} {where}"
        mass = f", or the mass of floor {self.floor} is {self.gain:.3g} times the declared one"
        return text + (mass if len(said) == 1 and "gain" in said[0] and self._may_be_mass else "")

    def exceeds(self, share: float, frequency_hz: float) -> bool:
        """Return whether the fault changes a signal by more than a share of it, at frequencies up to the given one."""
        phase = 2.0 * math.pi * frequency_hz * abs(self.delay_s)
        return bool(self.exchanged_with) or abs(self.gain - 1.0) > share or phase > share

    def reason(self) -> str:
        """Return why no effect is named, in words."""
        if self.exchanged_with and not self.test:
            why = "the displacement of the lowest mode grows from floor to floor only in this order"
            return f"{self.sentence()}: {why}; correct the channels, and trace again"
        return f"{self.sentence()}, which explains what is missing; correct the channel, and trace again"

    @property
    def _may_be_mass(self) -> bool:
        return bool(self.floor) and not self.test and self.gain > 0.0


def repaired(record: FrameRecord, fault: SensorFault) -> FrameRecord:
    """Return a record in the time domain with the fault of a sensor removed.

    Parameters
    ----------
    record
        The record; one of another test than that of the fault is returned as it is.
    fault
        Fault that is removed from the record.
    """
    if fault.test and record.name != fault.test:
        return record
    acceleration = record.acceleration.copy()
    if fault.exchanged_with:
        first, second = fault.floor - 1, fault.exchanged_with - 1
        acceleration[:, [first, second]] = acceleration[:, [second, first]]
        return replace(record, acceleration=acceleration)
    if not fault.floor:
        return replace(record, ground=_advanced(record.ground, fault.delay_s * record.rate_hz) / fault.gain)
    place = fault.floor - 1
    acceleration[:, place] = _advanced(acceleration[:, place], fault.delay_s * record.rate_hz) / fault.gain
    return replace(record, acceleration=acceleration)


def _advanced(values: FloatArray, samples: float) -> FloatArray:
    """Return a history that is earlier by a number of samples, with constant ends."""
    pad = math.ceil(abs(samples)) + len(values) // 10
    longer = np.concatenate([2.0 * values[0] - values[pad:0:-1], values, 2.0 * values[-1] - values[-2 : -pad - 2 : -1]])
    lines = np.fft.rfft(longer) * np.exp(2j * np.pi * np.fft.rfftfreq(len(longer)) * samples)
    return np.asarray(np.fft.irfft(lines, len(longer))[pad : pad + len(values)])


def corrected(spectra: Spectra, fault: SensorFault, masses: FloatArray) -> Spectra:
    """Return the spectra of a record with the fault of a sensor removed.

    Parameters
    ----------
    spectra
        Spectra of the record.
    fault
        The fault; records of other tests are returned as they are.
    masses
        Floor masses, shape (n,) [kg].
    """
    if fault.test and spectra.record.name != fault.test:
        return spectra
    if fault.exchanged_with:
        first, second = _lines(spectra, fault.floor), _lines(spectra, fault.exchanged_with)
        changed = _changed(spectra, fault.floor, second - first, masses)
        return _changed(changed, fault.exchanged_with, first - second, masses)
    omega = 2.0 * np.pi * spectra.frequencies_hz
    factor = np.exp(1j * omega * fault.delay_s) / fault.gain
    return _changed(spectra, fault.floor, (factor - 1.0) * _lines(spectra, fault.floor), masses)


def sensitivity_of(
    fault: SensorFault, item: Spectra, base: Base, linear: Sequence[FloatArray], masses: FloatArray
) -> ComplexArray:
    """Return the change of the residual of each storey for unit changes of logarithmic gain and delay, negative.

    `item` contains the corrected sensor. Shape (2, n, b).
    """
    turn = 2j * np.pi * item.frequencies_hz
    own = _lines(item, fault.floor) * np.exp(turn * fault.delay_s) / fault.gain
    lines = []
    for change in (own, turn * own):
        moved = _changed(item, fault.floor, change, masses)
        lines.append(-(moved.target - item.target) + motion_change(base, linear, moved, item))
    return np.stack(lines)


def motion_change(base: Base, linear: Sequence[FloatArray], moved: Spectra, item: Spectra) -> ComplexArray:
    """Return the change of the predicted force of each storey because of changed motion, shape (n, b)."""
    found = []
    for storey, numbers in enumerate(linear):
        difference = base_rows(base, moved, storey) - base_rows(base, item, storey)
        found.append(numbers[: len(difference)] @ difference)
    return np.stack(found)


def sensors_of(spectra: Sequence[Spectra]) -> list[int]:
    """Return the floors with an accelerometer, and 0 if the ground moves."""
    record = spectra[0].record
    missing = {*record.computed, *record.from_displacement}
    moving = any(float(np.ptp(item.record.ground)) > 0.0 for item in spectra)
    return [*([0] if moving else []), *(floor for floor in range(1, record.floors + 1) if floor not in missing)]


def _lines(spectra: Spectra, floor: int) -> ComplexArray:
    motion = spectra.motion
    return spectra.lines_of(motion.acceleration[:, floor - 1] if floor else motion.ground)


def _changed(spectra: Spectra, floor: int, change: ComplexArray, masses: FloatArray) -> Spectra:
    """Return the spectra after a change of the lines of an acceleration, shape (b,) [m/s2/sqrt(Hz)]."""
    n, omega = spectra.record.floors, 2.0 * np.pi * spectra.frequencies_hz
    target, values = spectra.target.copy(), spectra.regressors.copy()
    moved, rate = -change / omega**2, change / (1j * omega)
    if floor:
        target += storey_sums(n)[:, floor - 1 : floor] * masses[floor - 1] * change
        integrated = 1.0 - spectra.laser_share[floor - 1]
        values[floor - 1] += integrated * moved
        values[n + floor - 1] += integrated * rate
        return replace(spectra, target=target, regressors=values)
    values[:n] -= (1.0 - spectra.laser_share) * moved
    values[n : 2 * n] -= (1.0 - spectra.laser_share) * rate
    values[2 * n] += change
    values[2 * n + 1] -= change * omega**2 / omega[-1] ** 2
    return replace(spectra, regressors=values)
