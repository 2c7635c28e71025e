"""Merging of ambient set-ups with sensors that are moved between tests and reference sensors that are not.

Ambient shapes have no scale. Each set-up therefore gives shapes with an unknown factor for every mode, and the sensors
that two set-ups share (reference sensors) determine the ratio of these factors. Modes of different set-ups are the same
if their frequencies are close and their shapes at the shared sensors are similar. If a set-up has no stable pole of a
mode, the strongest singular vector of the spectral densities at its frequency gives the shape.

Source: Au (2011), Assembling mode shapes by least squares, Mechanical Systems and Signal Processing 25.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest, Sensor

_NEAR = 0.03
"""Largest relative difference of frequencies of two set-ups that may be the same mode."""
_ALIKE = 0.7
"""Least modal assurance at the shared sensors for shapes that may be the same mode."""

PICKED_UP = 0.01
"""Least error of a sensor over the mean motion of the mode, because of cross-talk and gain errors."""


@dataclass(frozen=True)
class SetUp:
    """Tests with the same sensors, and the stable poles that they show.

    Attributes
    ----------
    tests, fit
        The tests, and their poles.
    doubtful
        Whether each pole may be a copy of another pole of the set-up with the same shape at the sensors; empty: none.
    """

    tests: tuple[FrameTest, ...]
    fit: MultiModeFit
    doubtful: tuple[bool, ...] = ()


@dataclass(frozen=True)
class Merged:
    """Modes of several set-ups in one fit; `places` gives for each set-up the index of each mode, or -1."""

    fit: MultiModeFit
    set_ups: tuple[SetUp, ...]
    places: tuple[tuple[int, ...], ...]

    def parts(self, modes: Sequence[int]) -> list[tuple[SetUp, list[int], list[int]]]:
        """Return for each set-up the positions within `modes` that it shows, and their indices in its fit."""
        found = []
        for item, own in zip(self.set_ups, self.places, strict=True):
            positions = [i for i, mode in enumerate(modes) if own[mode] >= 0]
            if positions:
                found.append((item, positions, [own[modes[i]] for i in positions]))
        return found


@dataclass
class _Shape:
    """A mode while set-ups are added: values and standard errors of the sensors known so far."""

    omega: float
    values: dict[Sensor, float]
    errors: dict[Sensor, float]
    places: dict[int, int]


def merge_set_ups(set_ups: Sequence[SetUp], source: Path) -> Merged:
    """Return the modes of all set-ups with shapes at all sensors.

    Raises
    ------
    UserError
        If a set-up shares no sensor with the others.
    """
    base = max(range(len(set_ups)), key=lambda i: set_ups[i].fit.angular_frequencies.size)
    shapes = _shapes_of(set_ups[base].fit, base)
    known = set(set_ups[base].fit.sensors)
    waiting = [i for i in range(len(set_ups)) if i != base]
    while waiting:
        index = max(waiting, key=lambda i: len(known & set(set_ups[i].fit.sensors)))
        own = set_ups[index]
        shared = [sensor for sensor in own.fit.sensors if sensor in known]
        if not shared:
            raise UserError(
                source,
                f"tests.{own.tests[0].name}",
                "has no sensor in common with the other ambient tests",
                "keep at least one sensor (reference) at the same place in all set-ups",
            )
        for shape in shapes:
            _add(shape, index, own, shared)
        known |= set(own.fit.sensors)
        waiting.remove(index)
    return _collect(set_ups, base, shapes)


def confirmed(set_ups: Sequence[SetUp]) -> list[SetUp]:
    """Return set-ups without the doubtful poles that no other set-up shows.

    A mode of the structure has the same frequency in all set-ups. A pole that an estimator splits from a mode has
    another frequency in each of them. Poles of two set-ups are paired one to one, so that the mode itself does not
    confirm its copy.
    """
    kept = []
    for index, own in enumerate(set_ups):
        others = [item for place, item in enumerate(set_ups) if place != index]
        seen = {pole for other in others for pole in _paired(own, other)}
        poles = [i for i in range(own.fit.angular_frequencies.size) if i in seen or not any(own.doubtful[i : i + 1])]
        kept.append(SetUp(own.tests, own.fit.only(poles)))
    return kept


def _paired(one: SetUp, other: SetUp) -> set[int]:
    """Return the poles of a set-up that belong to a pole of another one, the nearest frequencies first."""
    shared = [sensor for sensor in one.fit.sensors if sensor in other.fit.sensors]
    rows, columns = ([item.fit.sensors.index(sensor) for sensor in shared] for item in (one, other))
    first, second = one.fit.angular_frequencies, other.fit.angular_frequencies
    gaps = sorted(
        (abs(second[j] / first[i] - 1.0), i, j)
        for i in range(first.size)
        for j in range(second.size)
        if _assurance(one.fit.residues[rows, i].real, other.fit.residues[columns, j].real) > _ALIKE
    )
    pairs: dict[int, int] = {}
    for gap, i, j in gaps:
        if gap < _NEAR and i not in pairs and j not in pairs.values():
            pairs[i] = j
    return set(pairs)


def _shapes_of(fit: MultiModeFit, index: int) -> list[_Shape]:
    return [
        _Shape(
            float(fit.angular_frequencies[mode]),
            dict(zip(fit.sensors, fit.residues[:, mode].real.tolist(), strict=True)),
            dict(zip(fit.sensors, fit.residue_errors[:, mode].tolist(), strict=True)),
            {index: mode},
        )
        for mode in range(fit.angular_frequencies.size)
    ]


def _add(shape: _Shape, index: int, own: SetUp, shared: Sequence[Sensor]) -> None:
    """Scale the shape of a set-up by the shared sensors and join it."""
    fit = own.fit
    rows = [fit.sensors.index(sensor) for sensor in shared]
    reference = np.array([shape.values[sensor] for sensor in shared])
    near = np.flatnonzero(np.abs(fit.angular_frequencies / shape.omega - 1.0) < _NEAR)
    alike = [(_assurance(fit.residues[rows, mode].real, reference), int(mode)) for mode in near]
    alike = [item for item in alike if item[0] > _ALIKE]
    if alike:
        # with one shared sensor all shapes are equal there, so the nearest frequency decides
        gaps = np.abs(fit.angular_frequencies - shape.omega)
        best = max(alike, key=lambda item: (round(item[0], 2), -float(gaps[item[1]])))[1]
        shape.places[index] = best
    values, errors = part_of(own, shape.places.get(index, -1), shape.omega)
    scale = float(values[rows] @ reference) / max(float(values[rows] @ values[rows]), 1e-300)
    reference_error = np.array([shape.errors[sensor] for sensor in shared])
    # error of the scale from noise and other motion in both set-ups at the shared sensors
    other = PICKED_UP * float(np.sqrt(np.mean(np.square(list(shape.values.values())))))
    noise = np.sqrt(reference_error**2 + (scale * errors[rows]) ** 2 + other**2)
    relative = float(np.linalg.norm(noise)) / max(float(np.linalg.norm(reference)), 1e-300)
    for row, sensor in enumerate(fit.sensors):
        value, error = scale * float(values[row]), abs(scale) * float(np.hypot(errors[row], relative * values[row]))
        if sensor in shape.values:
            first, second = 1.0 / max(shape.errors[sensor], 1e-300) ** 2, 1.0 / max(error, 1e-300) ** 2
            value = (first * shape.values[sensor] + second * value) / (first + second)
            error = float(1.0 / np.sqrt(first + second))
        shape.values[sensor], shape.errors[sensor] = value, error


def part_of(set_up: SetUp, pole: int, omega: float) -> tuple[FloatArray, FloatArray]:
    """Return a mode at the sensors of one set-up with arbitrary scale, and its errors, shape (s,) each.

    Parameters
    ----------
    set_up
        Tests and poles.
    pole
        Index of the mode among its poles; -1: no stable pole, so that the spectral densities are used.
    omega
        Angular frequency of the mode [rad/s].
    """
    if pole < 0:
        return _singular_vector(set_up.tests, omega)
    return set_up.fit.residues[:, pole].real, set_up.fit.residue_errors[:, pole]


def _assurance(first: FloatArray, second: FloatArray) -> float:
    return float((first @ second) ** 2) / max(float((first @ first) * (second @ second)), 1e-300)


def _singular_vector(tests: Sequence[FrameTest], omega: float) -> tuple[FloatArray, FloatArray]:
    """Return the strongest singular vector of the spectral densities near a frequency, and its errors, shape (s,)."""
    sensors = tests[0].responses.shape[1]
    density = np.zeros((sensors, sensors), dtype=np.complex128)
    count = 0
    for test in tests:
        values = np.fft.rfft(test.responses - test.responses.mean(axis=0), axis=0)
        lines = 2.0 * np.pi * np.fft.rfftfreq(test.responses.shape[0], 1.0 / test.sampling_rate_hz)
        near = np.abs(lines / omega - 1.0) < 0.5 * _NEAR
        density += values[near].T @ values[near].conj()
        count += int(np.count_nonzero(near))
    power, vectors = (np.asarray(item, dtype=np.float64) for item in np.linalg.eigh(np.real(density)))
    rest = float(power[:-1].mean()) if sensors > 1 else 0.0
    error = np.sqrt(rest / max(float(power[-1]), 1e-300) / max(count, 1) * sensors)
    return np.asarray(vectors[:, -1]), np.full(sensors, float(error))


def _collect(set_ups: Sequence[SetUp], base: int, shapes: Sequence[_Shape]) -> Merged:
    fit = set_ups[base].fit
    sensors = tuple(sorted({sensor for item in set_ups for sensor in item.fit.sensors}))
    residues = np.array([[shape.values[sensor] for shape in shapes] for sensor in sensors])
    errors = np.array([[shape.errors[sensor] for shape in shapes] for sensor in sensors])
    merged = replace(
        fit,
        residues=residues.astype(np.complex128),
        residue_errors=errors,
        coherence=np.tile(fit.coherence[0], (len(sensors), 1)),
        noise_variance=np.ones(len(sensors)),
        sensors=sensors,
        input_residues=np.full((len(sensors), 1, len(shapes)), np.nan, dtype=np.complex128),
    )
    places = tuple(tuple(shape.places.get(index, -1) for shape in shapes) for index in range(len(set_ups)))
    return Merged(merged, tuple(set_ups), places)


def pooled_poles(fit: MultiModeFit, parts: Sequence[tuple[Sequence[int], MultiModeFit]]) -> MultiModeFit:
    """Return a merged fit with the weighted means of the poles of its set-ups.

    Parameters
    ----------
    fit
        Modes with merged shapes.
    parts
        For each set-up: the modes that it shows, and its fit of these. If set-ups differ by more than their errors, for
        example due to temperature, the error of the mean follows from the scatter.
    """
    modes = fit.angular_frequencies.size
    logs = [np.log(fit.angular_frequencies), np.log(fit.damping_ratios)]
    variances = [np.diag(fit.covariance)[:modes].copy(), np.diag(fit.covariance)[modes:].copy()]
    for mode in range(modes):
        own = [(item, list(positions).index(mode)) for positions, item in parts if mode in positions]
        for which in (0, 1):
            values = np.array([
                np.log((item.angular_frequencies, item.damping_ratios)[which][place]) for item, place in own
            ])  # fmt: skip
            if not values.size:
                continue
            weight = np.array([
                1.0 / max(item.covariance[which * item.angular_frequencies.size + place,
                                          which * item.angular_frequencies.size + place], 1e-16)
                for item, place in own
            ])  # fmt: skip
            mean = float(weight @ values / weight.sum())
            scatter = float(weight @ (values - mean) ** 2) / max(values.size - 1, 1)
            logs[which][mode] = mean
            variances[which][mode] = max(1.0, scatter) / weight.sum()
    return replace(
        fit,
        angular_frequencies=np.exp(logs[0]),
        damping_ratios=np.exp(logs[1]),
        covariance=np.diag(np.concatenate(variances)),
    )
