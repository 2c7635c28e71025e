"""Closed-loop tests of a structure as tests of its damper: motion at the damper, drive, force, on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy import fft, signal

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.discrepancy.frame_delay import LoopSignals
from mrpipe.discrepancy.frame_records import part_of

CROSSOVER_HZ = 3.5
"""Below it the laser tells the damper's motion, above it the accelerometer."""


def damper_motion(recording: Recording, part: slice) -> FloatArray | None:
    """Return the displacement at the damper [m], shape (m,): its own sensor, else floor 1's laser and accelerometer."""
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
    corner = 0.25 if laser is None else CROSSOVER_HZ
    share = (frequencies / corner) ** 4 / (1.0 + (frequencies / corner) ** 4)
    mixed = share * (-lines[:, 0] / omega**2) + (1.0 - share) * lines[:, 1]
    return np.asarray(fft.irfft(mixed, len(longer))[size - 1 : 2 * size - 1])


def bench_of(loops: Sequence[Recording], directory: Path, name: str, drive_unit: str) -> Campaign | None:
    """Return the closed-loop tests as a campaign of a damper bench; None where none holds motion, drive and force."""
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
        found.append(
            Recording(
                item.name,
                item.role,
                item.sampling_rate_hz,
                time - time[0],
                channels,
                ((0, len(time)),),
                "",
                item.details,
            )
        )
    if len(found) < 2 or not any(item.role == "validation" for item in found):
        return None
    return Campaign(name, "damper-bench", directory, tuple(found), drive_unit or "A")


def loop_signals(loops: Sequence[Recording]) -> list[LoopSignals]:
    """Return the tests that hold desired force, drive and the damper's motion."""
    found = []
    for item in loops:
        part = part_of(item)
        moved = damper_motion(item, part) if {"drive", "desired_force"} <= set(item.channels) else None
        if moved is None:
            continue
        rate = item.sampling_rate_hz
        smooth = signal.filtfilt(*signal.butter(2, min(60.0, 0.3 * rate), fs=rate), moved)
        found.append(
            LoopSignals(
                item.name, item.role, rate, smooth, np.gradient(smooth, 1.0 / rate), item.channels["drive"][part],
                item.channels["desired_force"][part], float(item.details.get("controller_rate_hz", 0.0)),
                _gains_of(item),
            )
        )  # fmt: skip
    return found


def _gains_of(recording: Recording) -> tuple[float, float] | None:
    gains = recording.details.get("gains") or {}
    if "c_n_s_m" not in gains:
        return None
    return float(gains["c_n_s_m"]), float(gains.get("k_n_m", 0.0))
