"""A small shaking table for tests: random frames, sweeps, decays, noise; not the program's laboratory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from mrpipe.campaigns import Campaign, Recording, TestFile, write_campaign
from mrpipe.modal.records import FrameTest
from mrpipe.structures import Frame, natural_modes, shear_frame
from mrpipe.structures.response import linear_response


@dataclass(frozen=True)
class Rig:
    """Noise [m/s2] of each accelerometer, sweep and rate."""

    noise: float = 0.02
    sweep_s: float = 150.0
    rate: float = 500.0
    amplitude: float = 0.3
    top_hz: float = 14.0
    decay_s: float = 40.0


def random_frame(rng, floors, low=0.001, high=0.01):
    return shear_frame(rng.uniform(4, 8, floors), rng.uniform(4000, 8000, floors), rng.uniform(low, high, floors))


def on_flexible_support(frame, support_hz):
    """The frame on a table whose mount has a mode of its own; floor 0 is the table's plate."""
    n = frame.floors
    storeys = -np.diag(frame.stiffness, -1)
    first = frame.stiffness[0, 0] - (storeys[0] if n > 1 else 0.0)
    plate = 60.0
    mount = plate * (2 * np.pi * support_hz) ** 2
    masses = np.concatenate([[plate], np.diag(frame.mass)])
    return shear_frame(masses, np.concatenate([[mount, first], storeys]), 0.004)


def measure(frame, rng, rig, excitation, shaker_floor=0):
    """Return excitation and absolute accelerations with noise and offsets."""
    response = linear_response(frame, excitation, 1 / rig.rate, shaker_floor=shaker_floor).absolute_acceleration
    offset = rng.normal(0.0, 0.05, response.shape[1])
    noisy = response + offset + rig.noise * rng.standard_normal(response.shape)
    scale = 0.01 if shaker_floor else rig.noise
    return excitation + scale * rng.standard_normal(excitation.size), noisy


def sweep_test(frame, rng, rig, shaker_floor=0):
    time = np.arange(int(rig.sweep_s * rig.rate)) / rig.rate
    amplitude = rig.amplitude * (20.0 if shaker_floor else 1.0)
    excitation = amplitude * signal.chirp(time, 0.3, rig.sweep_s, rig.top_hz)
    u, y = measure(frame, rng, rig, excitation, shaker_floor)
    return FrameTest("sweep", "sweep", rig.rate, u, y, (False,) * y.shape[1], shaker_floor)


def random_test(frame, rng, rig):
    white = rng.standard_normal(int(rig.sweep_s * rig.rate))
    excitation = signal.sosfilt(signal.butter(4, 40.0, fs=rig.rate, output="sos"), white)
    excitation *= rig.amplitude / excitation.std()
    u, y = measure(frame, rng, rig, excitation)
    return FrameTest("random", "random", rig.rate, u, y, (False,) * y.shape[1])


def decay_test(frame, rng, rig, mode, table=0.1):
    omega = natural_modes(frame).angular_frequencies[mode - 1]
    time = np.arange(int((15.0 + rig.decay_s) * rig.rate)) / rig.rate
    u, y = measure(frame, rng, rig, np.where(time < 15.0, table * np.sin(omega * time), 0.0))
    return FrameTest(f"decay-{mode}", "free-decay", rig.rate, u, y, (False,) * y.shape[1], mode=mode)


def campaign_of(frame, tests, directory, masses=None):
    """A campaign in memory that holds these tests."""
    recordings = []
    for test in tests:
        channels = {f"floor_acceleration_{i + 1}": test.responses[:, i] for i in range(test.floors)}
        details = {"mode": test.mode} if test.mode else {}
        if test.shaker_floor:
            channels["input_force"] = test.excitation
            details["input_force_floor"] = test.shaker_floor
        else:
            channels["ground_acceleration"] = test.excitation
        time = np.arange(test.responses.shape[0]) / test.sampling_rate_hz
        recordings.append(
            Recording(test.name, "training", test.sampling_rate_hz, time, channels, (), test.kind, details)
        )
    masses = tuple(np.diag(frame.mass)) if masses is None else tuple(masses)
    return Campaign("planted", "shear-frame", directory, tuple(recordings), floor_masses_kg=masses)


def write(frame, tests, directory):
    """Write the tests as a campaign directory."""
    n = frame.floors
    channels = {"ground_acceleration": ("ground", "m/s^2")}
    channels |= {f"floor_acceleration_{i + 1}": (f"a{i + 1}", "m/s^2") for i in range(n)}
    files = []
    for test in tests:
        columns = {"ground": test.excitation, **{f"a{i + 1}": test.responses[:, i] for i in range(n)}}
        details = {"kind": test.kind, **({"mode": test.mode} if test.mode else {})}
        files.append(TestFile(test.name, "training", columns, details))
    return write_campaign(
        directory,
        campaign="planted",
        rig="shear-frame",
        sampling_rate_hz=tests[0].sampling_rate_hz,
        channels=channels,
        tests=files,
        extra={"frame": {"floor_masses_kg": [float(m) for m in np.diag(frame.mass)]}},
    )


def full_set(frame, rng, rig):
    """A sweep and a decay of each mode."""
    decays = [decay_test(frame, rng, rig, mode) for mode in range(1, frame.floors + 1)]
    return [sweep_test(frame, rng, rig), *decays]


__all__ = ["Frame", "Rig", "campaign_of", "decay_test", "full_set", "measure", "on_flexible_support", "random_frame"]
