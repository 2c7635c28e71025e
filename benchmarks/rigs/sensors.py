"""Sensors of a rig: noise of four kinds, quantisation, constant offsets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from benchmarks.rigs.types import Array

NOISES = ("white", "coloured", "harmonics", "quantised")


@dataclass(frozen=True)
class Channel:
    """Noise of one channel: standard deviation, hum (amplitude), step of the converter, offset; in its unit."""

    deviation: float
    hum: float
    step: float
    offset: float


@dataclass(frozen=True)
class Sensors:
    """The channels' noise, and the corner of coloured noise [Hz] (0 for white)."""

    displacement: Channel
    force: Channel
    drive: Channel
    corner_hz: float


def draw_sensors(kind: str, rng: np.random.Generator, *, stroke: float, force_rms: float, drive: float) -> Sensors:
    """Draw sensors: 1 to 5 micrometres at 10 mm of stroke, 0.3 to 0.8 % of the force RMS, in proportion elsewhere."""
    x = stroke * 1e-4 * rng.uniform(1.0, 5.0)
    f = force_rms * rng.uniform(0.003, 0.008)
    i = drive * rng.uniform(0.0005, 0.002)
    offsets = rng.standard_normal(3) * np.array([0.003 * stroke, 0.003 * force_rms, 0.0])
    hum, steps, share = np.zeros(3), np.zeros(3), 1.0
    if kind == "harmonics":
        hum, share = np.array([0.5 * x, 1.2 * f, 1.5 * i]), 0.5
    elif kind == "quantised":
        # the step of a converter of 12 bits whose range is larger than what is measured
        steps, share = np.array([2.0 * x, 1.5 * f, 3.0 * i]), 0.3
    return Sensors(
        *(
            Channel(share * deviation, float(hum[k]), float(steps[k]), float(offsets[k]))
            for k, deviation in enumerate((x, f, i))
        ),
        corner_hz=float(rng.uniform(5.0, 30.0)) if kind == "coloured" else 0.0,
    )


def measured(exact: Array, channel: Channel, corner_hz: float, rate_hz: float, rng: np.random.Generator) -> Array:
    """Return what a channel records, shape (n,)."""
    noise = rng.standard_normal(exact.size)
    if corner_hz > 0.0:
        keep = np.exp(-2.0 * np.pi * corner_hz / rate_hz)
        start = np.array([keep * rng.standard_normal()])
        noise = signal.lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], noise, zi=start)[0]
    time = np.arange(exact.size) / rate_hz
    mains = np.sin(2.0 * np.pi * 50.0 * time + rng.uniform(0.0, 2.0 * np.pi))
    mains += 0.4 * np.sin(2.0 * np.pi * 150.0 * time + rng.uniform(0.0, 2.0 * np.pi))
    values = exact + channel.offset + channel.deviation * noise + channel.hum * mains
    return np.round(values / channel.step) * channel.step if channel.step > 0.0 else values
