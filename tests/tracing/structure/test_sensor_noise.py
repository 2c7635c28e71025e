"""Noise of the sensors of a structure: colour, level, and excitation above the band that is no noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.base import FrameProblem, frame_problem, ladder
from mrpipe.tracing.structure.records import FrameRecord
from mrpipe.tracing.structure.sensor_noise import Noise, noise_of, possible_colours, shape_of

RATE = 200.0
MASSES = np.full(3, 5.0)
HIGH_HZ = 12.0


def frame_response(ground: FloatArray, storey: float = 5000.0, damping: float = 8.0) -> FloatArray:
    """Return the absolute acceleration of three floors, shape (m, 3), by an exact discrete state space."""
    sums = np.eye(3) * 2 - np.eye(3, k=1) - np.eye(3, k=-1)
    sums[2, 2] = 1.0
    K, C = storey * sums, damping * sums
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-K / MASSES[:, None], -C / MASSES[:, None]]])
    B = np.concatenate([np.zeros(3), -np.ones(3)])[:, None]
    output = np.hstack([-K, -C]) / MASSES[:, None]
    system = signal.StateSpace(A, B, output, np.zeros((3, 1)))
    return np.asarray(signal.lsim(system, ground, np.arange(ground.size) / RATE)[1])


def noise(rng: np.random.Generator, shape: tuple[int, ...], colour: float) -> FloatArray:
    values = signal.lfilter([1.0], [1.0, -colour], rng.standard_normal(shape), axis=0)
    return np.asarray(values / np.std(values))


def record(
    name: str, rng: np.random.Generator, *, colour: float = 0.0, size: float = 0.02, highest_hz: float = 15.0
) -> FrameRecord:
    """Return a record of 40 s under random ground motion up to a frequency, with noise on all accelerometers."""
    band = signal.butter(4, [0.5, highest_hz], "band", fs=RATE, output="sos")
    ground = signal.sosfilt(band, rng.standard_normal(8000))
    motion = frame_response(ground)
    sensors = noise(rng, (8000, 4), colour) * size
    return FrameRecord(name, "training", "random", RATE, ground + sensors[:, 0], motion + sensors[:, 1:], {}, {}, {})


def problem(*records: FrameRecord) -> FrameProblem:
    return frame_problem(records, records[:1], MASSES)


def chi_square(found: FrameProblem) -> float:
    return ladder(found.training)["linear-frame"].chi_square


@pytest.mark.planted
def test_coloured_noise_is_recognised_and_white_noise_is_not_called_coloured() -> None:
    rng = np.random.default_rng(1)
    coloured = possible_colours([record("a", rng, colour=0.85)], HIGH_HZ)
    # white noise stays possible, because vibration above the band may look coloured
    assert coloured[0] == 0.0 and min(coloured[1:]) <= 0.85 <= max(coloured[1:])
    assert possible_colours([record("b", rng)], HIGH_HZ) == (0.0,)


@pytest.mark.planted
@pytest.mark.parametrize("colour", [0.0, 0.85])
def test_a_linear_frame_leaves_noise_of_either_colour(colour: float) -> None:
    rng = np.random.default_rng(2)
    found = problem(*(record(f"r{k}", rng, colour=colour) for k in range(3)))
    # the tracing tolerates a residual of this share above the noise
    assert 0.6 < chi_square(found) < 1.0 + FrameRules().of_floor


@pytest.mark.planted
def test_excitation_above_the_band_is_no_noise() -> None:
    """Ground motion that reached above the band made the noise several times the residual."""
    rng = np.random.default_rng(3)
    found = problem(record("narrow", rng), record("wide", rng, highest_hz=80.0))
    assert 0.5 < chi_square(problem(record("wide", rng, highest_hz=80.0))) < 1.3
    assert 0.5 < chi_square(found) < 1.3


@pytest.mark.property
def test_density_of_an_autoregressive_process() -> None:
    rng = np.random.default_rng(4)
    values = signal.lfilter([1.0], [1.0, -0.7], rng.standard_normal(400_000))
    frequencies, density = signal.welch(values, 1.0, nperseg=512)
    inside = (frequencies > 0.01) & (frequencies < 0.49)
    expected = 2.0 * shape_of(0.7, frequencies[inside])
    np.testing.assert_allclose(density[inside], expected, rtol=0.25)
    np.testing.assert_allclose(
        Noise(np.array([2.0, 4.0]), {}, colour=0.7, rate_hz=1.0).of_accelerometers(frequencies[inside]),
        np.stack([expected, 2.0 * expected]),
    )


@pytest.mark.property
def test_spectra_of_a_channel_are_computed_once_and_not_for_a_changed_record() -> None:
    first = record("a", np.random.default_rng(3))
    noises = [noise_of(first, HIGH_HZ, colour=colour) for colour in (0.0, 0.5)]
    kept = dict(first.averages)
    assert len(kept) == 4
    again = noise_of(replace(first), HIGH_HZ, colour=0.5)
    np.testing.assert_array_equal(noises[1].acceleration, again.acceleration)
    assert all(first.averages[key] is item for key, item in kept.items())
    louder = replace(first, acceleration=2.0 * first.acceleration)
    assert louder.averages == {}
    np.testing.assert_allclose(noise_of(louder, HIGH_HZ).acceleration[1:], 4.0 * noises[0].acceleration[1:])
