"""Training history from prepared tests: steady cycles joined at the rate of the network (thesis 2.3.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.signal import fftconvolve, firwin

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray, IntArray
from mrpipe.networks.network import CHANNEL_UNITS, FeatureSpec
from mrpipe.signals.prepared import PreparedTest

CHANNELS = ("displacement", "velocity", "acceleration", "drive", "force")
"""Channels of each test in a history."""

_ATTRIBUTES = ("displacement_m", "velocity_m_s", "acceleration_m_s2", "drive", "force_n")

CONTINUOUS = 2.0
"""Largest step at a join, over the largest step within a test, of a displacement that is continuous."""


@dataclass(frozen=True)
class History:
    """Tests joined end to end, all at one sampling rate.

    Attributes
    ----------
    names
        Names of the tests, in order.
    channels
        Channel -> shape (n,), SI.
    starts
        Index of the first sample of each test, and n: shape (tests + 1,). No window of past values crosses a start.
    drive_varies
        Whether the drive varies within each test (half-sine or random), shape (tests,).
    sampling_rate_hz
        Sampling rate of the network [Hz].
    drive_unit
        A or V; empty where no test or no channel of the drive gives it.
    """

    names: tuple[str, ...]
    channels: Mapping[str, FloatArray]
    starts: IntArray
    drive_varies: tuple[bool, ...]
    sampling_rate_hz: float
    drive_unit: str

    @property
    def samples(self) -> int:
        """Number of samples of all tests."""
        return int(self.starts[-1])

    def record(self, index: int, channel: str) -> FloatArray:
        """Return one channel of one test."""
        return self.channels[channel][self.starts[index] : self.starts[index + 1]]

    def test_of_samples(self) -> IntArray:
        """Return the index of the test that each sample belongs to, shape (n,)."""
        return np.repeat(np.arange(len(self.names)), np.diff(self.starts))

    def select(self, indices: Sequence[int]) -> History:
        """Return the history of some of the tests."""
        lengths = [int(self.starts[index + 1] - self.starts[index]) for index in indices]
        return replace(
            self,
            names=tuple(self.names[index] for index in indices),
            channels={
                name: np.concatenate([self.record(index, name) for index in indices]) if indices else np.zeros(0)
                for name in self.channels
            },
            starts=np.cumsum([0, *lengths], dtype=np.int64),
            drive_varies=tuple(self.drive_varies[index] for index in indices),
        )

    def largest_jump(self, channel: str) -> float:
        """Return the ratio of the largest step at a join to the largest step within a test.

        It is at most 2 (:data:`CONTINUOUS`) for the displacement of periodic tests, because one test ends one sample
        before its zero crossing and the next begins one sample after it. A test whose motion is not periodic is used
        completely, so that the displacement may have a step of any size at its ends. The ratio is 0 if the channel is
        constant within every test (constant drive).
        """
        values = self.channels[channel]
        steps = np.abs(np.diff(values))
        joins = self.starts[1:-1] - 1
        within = np.delete(steps, joins)
        largest = float(within.max()) if len(within) else 0.0
        # rounding of a constant channel is not a step
        moves = largest > 1e-9 * float(np.max(np.abs(values), initial=0.0))
        return float(steps[joins].max()) / largest if len(joins) and moves else 0.0


@dataclass(frozen=True)
class Samples:
    """Feature rows with their targets.

    Attributes
    ----------
    features
        Shape (n, R), SI.
    target
        Shape (n,), SI.
    sample
        Index into the history of the present value of each row, shape (n,).
    test
        Index of the test of each row, shape (n,).
    """

    features: FloatArray
    target: FloatArray
    sample: IntArray
    test: IntArray


def decimation_factor(native_rate_hz: float, wanted_rate_hz: float) -> int:
    """Return the integer factor with the rate nearest to the requested one; 1 if the record is slower."""
    return max(1, round(native_rate_hz / wanted_rate_hz))


def without_aliases(signal: FloatArray, factor: int) -> FloatArray:
    """Low-pass at four fifths of the Nyquist frequency after decimation by `factor`, without delay.

    The filter is a symmetric FIR filter with 20 taps times the factor. The record is extended by odd reflection, so
    that the ends keep their level and slope. Input and output have shape (n,).
    """
    if factor == 1:
        return np.asarray(signal, dtype=np.float64)
    half = min(10 * factor, len(signal) - 1)
    taps = firwin(2 * half + 1, 0.8 / factor)
    before = 2.0 * signal[0] - signal[half:0:-1]
    after = 2.0 * signal[-1] - signal[-2 : -half - 2 : -1]
    return np.asarray(fftconvolve(np.concatenate([before, signal, after]), taps, mode="valid"))


def cut(test: PreparedTest, cycles: int) -> tuple[int, int]:
    """Return the half-open range of samples that is used for the history.

    These are the last `cycles` steady cycles, from one upward zero crossing of displacement to another. A test with
    fewer cycles is used with all of them. A test whose motion is not periodic is used completely.
    """
    if test.excitation != "periodic" or len(test.cycles) < 2:
        return 0, len(test.time_s)
    first = max(0, len(test.cycles) - 1 - cycles)
    return int(test.cycles[first]), int(test.cycles[-1])


def join(tests: Sequence[PreparedTest], *, cycles: int, sampling_rate_hz: float) -> History:
    """Join the steady cycles of tests at zero crossings of the displacement, at the rate of the network.

    Each test is low-passed as a whole before it is cut, so that no filter runs across a join. Displacement is
    continuous between periodic tests. It has a step where a test begins or ends whose motion is not periodic, because
    such a test is used completely. Other channels have steps at every join (the velocity at another frequency, the
    force at another current); no window of past values crosses a join, because smoothing would invent data.

    Parameters
    ----------
    tests
        Tests of one role, all with the same sampling rate.
    cycles
        Number of steady cycles of each periodic test.
    sampling_rate_hz
        Requested rate [Hz]; the nearest rate with an integer factor is used, and the native rate if that is lower.

    Raises
    ------
    ValueError
        If the tests differ in sampling rate.
    """
    rates = {test.sampling_rate_hz for test in tests}
    if len(rates) > 1:
        raise ValueError(f"tests at {sorted(rates)} Hz cannot be joined; prepare them at one rate")
    native = next(iter(rates)) if rates else sampling_rate_hz
    factor = decimation_factor(native, sampling_rate_hz)
    parts: dict[str, list[FloatArray]] = {name: [np.zeros(0)] for name in CHANNELS}
    lengths = [0]
    for test in tests:
        start, stop = cut(test, cycles)
        for name, attribute in zip(CHANNELS, _ATTRIBUTES, strict=True):
            parts[name].append(without_aliases(getattr(test, attribute), factor)[start:stop:factor])
        lengths.append(len(parts["force"][-1]))
    channels = {name: np.concatenate(pieces) for name, pieces in parts.items()}
    starts = np.cumsum(lengths, dtype=np.int64)
    history = History(
        names=tuple(test.name for test in tests),
        channels=channels,
        starts=starts,
        drive_varies=tuple(False for _ in tests),
        sampling_rate_hz=native / factor,
        drive_unit=tests[0].drive_unit if tests else "",
    )
    return replace(history, drive_varies=_which_drives_vary(history))


def _which_drives_vary(history: History) -> tuple[bool, ...]:
    """Return for each test whether its drive varies by more than a twentieth of the range of the campaign."""
    drive = history.channels["drive"]
    span = float(np.ptp(drive)) if len(drive) else 0.0
    records = [history.record(index, "drive") for index in range(len(history.names))]
    # percentiles, because noise and the ends of a filter are not a change of the set point
    moves = [float(np.ptp(np.percentile(record, [2, 98]))) if len(record) else 0.0 for record in records]
    return tuple(bool(span > 0.0 and move > 0.05 * span) for move in moves)


def drive_range(history: History) -> float:
    """Return the range of the drive over the whole history (0.5 to 99.5 % percentile) [A or V]."""
    drive = history.channels["drive"]
    return float(np.ptp(np.percentile(drive, [0.5, 99.5]))) if len(drive) else 0.0


def samples(history: History, spec: FeatureSpec) -> Samples:
    """Return feature rows and targets of a history, with no window of past values across a join."""
    places = window_starts(history, spec.past_values)
    features, target = rows_at(history, spec, places)
    return Samples(features=features, target=target, sample=places, test=history.test_of_samples()[places])


def window_starts(history: History, past_values: int) -> IntArray:
    """Return the samples whose window of past values lies within one test, shape (m,)."""
    ranges = [np.arange(first + past_values, last) for first, last in pairwise(history.starts.tolist())]
    return np.concatenate([np.zeros(0, dtype=np.int64), *ranges]).astype(np.int64)


def rows_at(history: History, spec: FeatureSpec, places: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return features (m, R) and targets (m,) of the samples `places`, which :func:`window_starts` lists."""
    columns = [history.channels[name][places - lag] for name in spec.channels for lag in range(spec.past_values + 1)]
    if spec.past_target:
        columns += [history.channels[spec.target][places - lag] for lag in range(1, spec.past_values + 1)]
    features = np.stack(columns, axis=1)
    return np.abs(features) if spec.absolute else features, history.channels[spec.target][places]


def write_history(artifact: ArtifactWriter, group: str, history: History) -> None:
    """Store a history under `group`."""
    for name, values in history.channels.items():
        unit = CHANNEL_UNITS.get(name, history.drive_unit)
        artifact.put(f"{group}/{name}", values, unit=unit, dims=("time",))
    artifact.put(f"{group}/starts", history.starts, unit="1", dims=("test",))
    artifact.put_json(f"{group}/names", list(history.names))
    artifact.put_json(f"{group}/drive_varies", list(history.drive_varies))
    artifact.attributes(group, sampling_rate_hz=history.sampling_rate_hz, drive_unit=history.drive_unit)


def read_history(artifact: Artifact, group: str) -> History:
    """Read the history that :func:`write_history` wrote."""
    notes = artifact.attributes(group)
    return History(
        names=tuple(artifact.json(f"{group}/names")),
        channels={name: artifact.array(f"{group}/{name}") for name in CHANNELS},
        starts=artifact.array(f"{group}/starts").astype(np.int64),
        drive_varies=tuple(artifact.json(f"{group}/drive_varies")),
        sampling_rate_hz=float(notes["sampling_rate_hz"]),
        drive_unit=str(notes["drive_unit"]),
    )
