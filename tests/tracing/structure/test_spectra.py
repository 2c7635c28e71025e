"""Weights of a structure's spectra: the noise of sensors and of load cells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from mrpipe.tracing.structure.base import coupled_stiffness, frame_problem, ladder
from mrpipe.tracing.structure.groups import Groups
from mrpipe.tracing.structure.records import FrameRecord
from mrpipe.tracing.structure.sensor_noise import noise_density
from mrpipe.tracing.structure.spectra import storey_sums

RATE = 250.0


@pytest.mark.property
@pytest.mark.parametrize("seconds", [4.0, 10.0, 22.0, 120.0])
def test_the_noise_of_a_record_of_any_length_comes_out(seconds: float) -> None:
    rng = np.random.default_rng(9000)
    found = [noise_density(0.05 * rng.standard_normal(int(seconds * RATE)), RATE, 20.0) for _ in range(20)]
    assert np.mean(found) == pytest.approx(2.0 * 0.05**2 / RATE, rel=0.06)


@pytest.mark.property
def test_what_reaches_above_the_band_now_and_then_is_no_noise() -> None:
    rng = np.random.default_rng(9002)
    values = 0.05 * rng.standard_normal(int(40.0 * RATE))
    values[2000:7000] += 0.2 * rng.standard_normal(5000)
    assert noise_density(values, RATE, 20.0) == pytest.approx(2.0 * 0.05**2 / RATE, rel=0.1)


@pytest.mark.property
def test_couplings_that_are_none_of_a_shear_frame_come_out() -> None:
    # storey 1 feels floor 3: without that in the weights, floor 3's noise passes for structure
    rng = np.random.default_rng(9003)
    masses, size = np.array([6.0, 5.5, 5.0]), int(60.0 * RATE)
    sheared = np.array([[9e3, 0.0, 0.0], [-8e3, 8e3, 0.0], [0.0, -7e3, 7e3]])
    coupled = sheared + np.array([[0.0, -400.0, 500.0], [0.0, 0.0, -150.0], [0.0, 0.0, 0.0]])
    ground = signal.sosfilt(signal.butter(4, [1.0, 12.0], "bandpass", fs=RATE, output="sos"), rng.standard_normal(size))
    ground *= 0.3 * signal.windows.tukey(size, 0.4)
    omega = 2.0 * np.pi * np.fft.rfftfreq(size, 1.0 / RATE)
    sums = storey_sums(3) * masses
    dynamic = coupled[None] * (1.0 + 2e-3j * omega[:, None, None]) - omega[:, None, None] ** 2 * sums[None]
    moved = np.linalg.solve(dynamic, -(sums.sum(axis=1))[None, :, None] * np.fft.rfft(ground)[:, None, None])[:, :, 0]
    absolute = np.fft.irfft(-(omega[:, None] ** 2) * moved, size, axis=0) + ground[:, None]
    noisy = absolute + 0.02 * rng.standard_normal((size, 3))
    place = np.fft.irfft(moved, size, axis=0)
    lasers = {floor: place[:, floor - 1] + 1e-6 * rng.standard_normal(size) for floor in (1, 2)}
    seen = ground + 0.02 * rng.standard_normal(size)
    record = FrameRecord("a", "training", "random", RATE, seen, noisy, lasers, {}, {})
    problem = frame_problem([record], [record], masses)
    assert coupled_stiffness(problem.training, sheared)[0] == pytest.approx(coupled[0], abs=60.0)


@pytest.mark.property
def test_what_stands_out_counts_only_where_it_matters() -> None:
    # two groups of a record and storey: one stands out, beside forces of two sizes
    index = np.repeat(np.arange(2), 48)[None, :]
    residual = np.ones((1, 96))
    residual[0, :48] *= 2.0
    common = (index, np.full(2, 48.0), np.ones(1), np.zeros(2, dtype=np.int64), np.array([True, False]))
    record = np.zeros(2, dtype=np.int64)
    assert Groups(*common, record, np.full(2, 1e6)).material(residual)
    assert not Groups(*common, record, np.full(2, 1e8)).material(residual)
    assert not Groups(*common, record, np.full(2, 1e6)).material(np.ones((1, 96)))


@pytest.mark.property
def test_the_noise_of_a_load_cell_belongs_to_the_storeys_below_it() -> None:
    rng = np.random.default_rng(9001)
    size = int(24.0 * RATE)
    load = 4.0 * signal.sosfilt(signal.butter(8, 11.0, fs=RATE, output="sos"), rng.standard_normal(size))
    load *= signal.windows.tukey(size, 0.4)
    mass, stiffness, damping = np.diag([6.0, 5.0]), np.array([[17e3, -8e3], [-8e3, 8e3]]), 2e-3
    omega = 2.0 * np.pi * np.fft.rfftfreq(size, 1.0 / RATE)
    dynamic = stiffness[None] * (1.0 + 1j * damping * omega[:, None, None]) - omega[:, None, None] ** 2 * mass[None]
    force = np.stack([np.fft.rfft(load * 20.0), np.zeros_like(omega)], axis=1)
    moved = np.linalg.solve(dynamic, force[:, :, None])[:, :, 0]
    acceleration = np.fft.irfft(-(omega[:, None] ** 2) * moved, size, axis=0)
    noisy = acceleration + 0.002 * rng.standard_normal((size, 2))
    measured = 20.0 * load + 0.5 * rng.standard_normal(size)
    record = FrameRecord(
        "a", "training", "random", RATE, 0.002 * rng.standard_normal(size), noisy, {}, {1: measured}, {}
    )
    problem = frame_problem([record], [record], np.array([6.0, 5.0]))
    residual = ladder(problem.training)["shear-frame"].residual
    assert float(np.mean(residual[0] ** 2)) == pytest.approx(1.0, abs=0.35)
