"""Weights of a structure's spectra: the noise of sensors and of load cells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from mrpipe.discrepancy.frame_base import frame_problem, ladder
from mrpipe.discrepancy.frame_records import FrameRecord
from mrpipe.discrepancy.frame_spectra import noise_density

RATE = 250.0


@pytest.mark.property
@pytest.mark.parametrize("seconds", [4.0, 10.0, 22.0, 120.0])
def test_the_noise_of_a_record_of_any_length_comes_out(seconds: float) -> None:
    rng = np.random.default_rng(9000)
    found = [noise_density(0.05 * rng.standard_normal(int(seconds * RATE)), RATE, 20.0) for _ in range(20)]
    assert np.mean(found) == pytest.approx(2.0 * 0.05**2 / RATE, rel=0.06)


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
