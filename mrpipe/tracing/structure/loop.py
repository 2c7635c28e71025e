"""Closed-loop tests of a structure as tests of its damper: motion at the damper, drive and force on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy import fft, signal

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.tracing.structure.delay import LoopSignals
from mrpipe.tracing.structure.records import part_of
from mrpipe.tracing.structure.sensor_noise import noise_density

CROSSOVERS = (0.4, 12.0)
"""Numerical technique: bounds of the frequency above which the accelerometers replace the laser, in multiples of the
mean frequency of the motion.
"""

LOWEST = 0.2
"""Numerical technique: without a laser the motion is taken from accelerometers above this multiple of its mean
frequency; below it integrated noise dominates."""

SMOOTHED = 50.0
"""Numerical technique: cut-off of the motion before differentiation, in multiples of its mean frequency."""

OF_RATE = 0.3
"""Numerical technique: highest cut-off frequency, as a share of the sampling rate."""

NOISE_ABOVE_SHARE = 0.25
"""Numerical technique: the noise of a channel is measured above this share of the sampling rate."""

STRONG_LINES = 1e-3
"""Numerical technique: lines below this share of the strongest one do not count in the mean frequency."""


def mean_frequency(values: FloatArray, rate_hz: float, *, acceleration: bool) -> float:
    """Return the mean frequency of a motion [Hz]: RMS velocity over RMS displacement, divided by 2 pi.

    Parameters
    ----------
    values
        Displacement or acceleration, shape (m,).
    rate_hz
        Sampling rate.
    acceleration
        Whether `values` is an acceleration.
    """
    frequencies, density = signal.welch(values - np.mean(values), rate_hz, nperseg=max(len(values) // 4, 8))
    frequencies, density = frequencies[1:], density[1:]
    power = np.maximum(density - noise_density(values, rate_hz, NOISE_ABOVE_SHARE * rate_hz), 0.0)
    power = np.where(power >= STRONG_LINES * float(power.max()), power, 0.0)
    displacement = power / frequencies**4 if acceleration else power
    whole = float(np.sum(displacement))
    return float(np.sqrt(np.sum(frequencies**2 * displacement) / whole)) if whole > 0.0 else float(frequencies[0])


def crossover_of(recording: Recording) -> float:
    """Return the frequency [Hz] above which floor 1's accelerometers measure its motion better than its laser."""
    laser, relative = _densities(recording)
    low, high = (factor * _frequency_of(recording) for factor in CROSSOVERS)
    return float(np.clip((relative / max(laser, 1e-300)) ** 0.25 / (2.0 * np.pi), low, high))


def _frequency_of(recording: Recording) -> float:
    """Return the mean frequency [Hz] of the motion of floor 1, from its relative acceleration."""
    relative = recording.channels["floor_acceleration_1"] - recording.channels["ground_acceleration"]
    return mean_frequency(relative, recording.sampling_rate_hz, acceleration=True)


def motion_noise(recording: Recording) -> tuple[float, float]:
    """Return standard deviation [m] and band [Hz] of the noise of :func:`damper_motion`.

    The noise of integrated accelerometers lies in the band of the motion, so it cannot be estimated from the motion
    itself. Both are 0 if a single displacement sensor measures the motion.
    """
    channels = recording.channels
    if "damper_displacement" in channels or not {"floor_acceleration_1", "ground_acceleration"} <= set(channels):
        return 0.0, 0.0
    laser, relative = _densities(recording)
    if "floor_displacement_1" not in channels:
        lowest = LOWEST * _frequency_of(recording)
        return float(np.sqrt(relative / (3.0 * (2.0 * np.pi) ** 4 * lowest**3))), 2.0 * lowest
    crossover = crossover_of(recording)
    # both sensors, each weighted by the noise of the other: the integral of laser / (1 + (f / crossover)^4)
    return float(np.sqrt(laser * crossover * np.pi / np.sqrt(8.0))), crossover


def _densities(recording: Recording) -> tuple[float, float]:
    """Return the noise of floor 1's laser [m2/Hz] (0 without one) and of its relative acceleration [(m/s2)^2/Hz]."""
    channels, rate = recording.channels, recording.sampling_rate_hz
    above = NOISE_ABOVE_SHARE * rate
    laser = channels.get("floor_displacement_1")
    relative = channels["floor_acceleration_1"] - channels["ground_acceleration"]
    return 0.0 if laser is None else noise_density(laser, rate, above), noise_density(relative, rate, above)


def damper_motion(recording: Recording, part: slice) -> FloatArray | None:
    """Return the displacement at the damper [m], shape (m,): of its sensor, else of laser and accelerometer."""
    channels = recording.channels
    if "damper_displacement" in channels:
        return np.asarray(channels["damper_displacement"][part])
    laser = channels.get("floor_displacement_1")
    accelerometer, ground = channels.get("floor_acceleration_1"), channels.get("ground_acceleration")
    if laser is None and (accelerometer is None or ground is None):
        return None
    rate = recording.sampling_rate_hz
    if accelerometer is None or ground is None:
        return np.asarray(laser[part]) if laser is not None else None
    relative = accelerometer[part] - ground[part]
    size = len(relative)
    stack = np.column_stack([relative - relative.mean(), np.zeros(size) if laser is None else laser[part]])
    longer = np.concatenate([2.0 * stack[0] - stack[:0:-1], stack, 2.0 * stack[-1] - stack[-2::-1]])
    lines, frequencies = fft.rfft(longer, axis=0), fft.rfftfreq(len(longer), 1.0 / rate)
    omega = 2.0 * np.pi * np.maximum(frequencies, 1e-9)
    corner = LOWEST * _frequency_of(recording) if laser is None else crossover_of(recording)
    share = (frequencies / corner) ** 4 / (1.0 + (frequencies / corner) ** 4)
    mixed = share * (-lines[:, 0] / omega**2) + (1.0 - share) * lines[:, 1]
    return np.asarray(fft.irfft(mixed, len(longer))[size - 1 : 2 * size - 1])


def bench_of(loops: Sequence[Recording], directory: Path, name: str, drive_unit: str) -> Campaign | None:
    """Return the closed-loop tests as a campaign of a damper bench; None if no test has motion, drive and force."""
    found = []
    for item in loops:
        part = part_of(item)
        moved = damper_motion(item, part) if {"drive", "damper_force"} <= set(item.channels) else None
        if moved is None:
            continue
        channels = {
            "displacement": moved, "drive": item.channels["drive"][part], "force": item.channels["damper_force"][part]
        }  # fmt: skip
        if {"floor_acceleration_1", "ground_acceleration"} <= set(item.channels):
            channels["acceleration"] = (item.channels["floor_acceleration_1"] - item.channels["ground_acceleration"])[
                part
            ]
        time = item.time_s[part]
        noise, band = motion_noise(item)
        details = {**item.details, "displacement_noise_m": noise, "displacement_noise_band_hz": band}
        found.append(
            Recording(
                item.name,
                item.role,
                item.sampling_rate_hz,
                time - time[0],
                channels,
                ((0, len(time)),),
                "",
                details,
            )
        )
    if len(found) < 2 or not any(item.role == "validation" for item in found):
        return None
    return Campaign(name, "damper-bench", directory, tuple(found), drive_unit)


def loop_signals(loops: Sequence[Recording]) -> list[LoopSignals]:
    """Return the tests that have desired force, drive and motion of the damper."""
    found = []
    for item in loops:
        part = part_of(item)
        moved = damper_motion(item, part) if {"drive", "desired_force"} <= set(item.channels) else None
        if moved is None:
            continue
        rate = item.sampling_rate_hz
        cutoff = min(SMOOTHED * mean_frequency(moved, rate, acceleration=False), OF_RATE * rate)
        smooth = signal.filtfilt(*signal.butter(2, cutoff, fs=rate), moved)
        found.append(
            LoopSignals(
                item.name, item.role, rate, smooth, np.gradient(smooth, 1.0 / rate), item.channels["drive"][part],
                item.channels["desired_force"][part], float(item.details.get("controller_rate_hz", 0.0)),
                _gains_of(item), float(item.details.get("command_filter_hz") or 0.0),
            )
        )  # fmt: skip
    return found


def _gains_of(recording: Recording) -> tuple[float, float] | None:
    gains = recording.details.get("gains") or {}
    if "c_n_s_m" not in gains:
        return None
    return float(gains["c_n_s_m"]), float(gains.get("k_n_m", 0.0))
