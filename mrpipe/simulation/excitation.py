"""Excitations: harmonic motion that may stop, sweep, random motion, or recorded acceleration."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.simulation.settings import ExcitationSettings
from mrpipe.structures import Frame, frequency_response


@dataclass(frozen=True)
class Place:
    """Place of an input other than the base acceleration along the influence vector.

    Attributes
    ----------
    name
        Name of the place in tables, such as `ground y`.
    shape
        Shape (n,): displacement of each degree of freedom per metre of the ground, or share of the force at each.
    force
        Whether the input is a force [N]; else it is an acceleration of the ground [m/s^2].
    """

    name: str
    shape: FloatArray
    force: bool


@dataclass(frozen=True)
class Excitation:
    """Excitation of the structure over time: the base acceleration, and the inputs of `places`.

    Attributes
    ----------
    duration_s
        Length of the run.
    at
        Function from times (m,) [s] to base accelerations (m,) [m/s^2]. With `places` the result has shape (m, k): a
        column for the base acceleration, if there is one, then one for each place.
    steady_s
        Start and end [s] of the steady response, over which the indices are computed.
    decay_from_s
        Start of a free decay [s]; NaN if there is none.
    frequency_rad_s
        Frequency of harmonic motion [rad/s]; else NaN.
    details
        Description for tables and JSON.
    places
        Places of inputs in addition to, or instead of, the base acceleration.
    shakes_ground
        Whether the first column of `at` is the base acceleration along the influence vector.
    """

    duration_s: float
    at: Callable[[FloatArray], FloatArray]
    steady_s: tuple[float, float]
    decay_from_s: float = math.nan
    frequency_rad_s: float = math.nan
    details: dict[str, Any] = field(default_factory=dict)
    places: tuple[Place, ...] = ()
    shakes_ground: bool = True


_SETTINGS = ExcitationSettings()
"""The defaults that the functions share with the settings."""


def harmonic(
    amplitude_m_s2: float,
    omega: float,
    *,
    cycles: int = _SETTINGS.cycles,
    settling_cycles: int = _SETTINGS.settling_cycles,
    ramp_cycles: float = _SETTINGS.ramp_cycles,
    decay_s: float = 0.0,
    phase_rad: float = 0.0,
) -> Excitation:
    """Return a_g = -A sin(omega t + phase) with a ramp at the start, stopped after whole cycles for a free decay.

    Parameters
    ----------
    amplitude_m_s2, omega
        Amplitude and angular frequency of the base acceleration [m/s^2], [rad/s].
    cycles, settling_cycles
        Number of all cycles, and of the first ones, during which the structure settles; the indices are taken over
        the others.
    ramp_cycles
        Length of the raised-cosine start.
    decay_s
        Duration of the free decay after the base has stopped [s].
    phase_rad
        Phase at the start [rad].
    """
    period = 2.0 * math.pi / omega
    stop = cycles * period
    ramp = max(ramp_cycles * period, 1e-12)

    def at(t: FloatArray) -> FloatArray:
        rise = 0.5 - 0.5 * np.cos(np.pi * np.clip(t / ramp, 0.0, 1.0))
        return np.where(t < stop, -amplitude_m_s2 * rise * np.sin(omega * t + phase_rad), 0.0)

    return Excitation(
        stop + decay_s,
        at,
        (settling_cycles * period, stop),
        stop if decay_s > 0.0 else math.nan,
        omega,
        {
            "kind": "harmonic",
            "base_amplitude_m_s2": amplitude_m_s2,
            "frequency_rad_s": omega,
            "steady_s": [settling_cycles * period, stop],
        },
    )


def sweep(amplitude_m_s2: float, first_hz: float, last_hz: float, duration_s: float) -> Excitation:
    """Return a linear sine sweep of the base acceleration."""

    def at(t: FloatArray) -> FloatArray:
        phase = 2.0 * np.pi * (first_hz * t + 0.5 * (last_hz - first_hz) * t**2 / duration_s)
        return np.asarray(amplitude_m_s2 * np.sin(phase))

    return Excitation(
        duration_s, at, (0.0, duration_s), details={"kind": "sweep", "base_amplitude_m_s2": amplitude_m_s2}
    )


RANDOM_RATE = 40.0
"""Samples of random motion per period of its centre frequency, with linear interpolation between them."""


def narrow_band(
    rms_m_s2: float,
    omega: float,
    bandwidth: float,
    rng: np.random.Generator,
    *,
    duration_s: float,
    settling_s: float = 0.0,
    ramp_s: float = 0.0,
) -> Excitation:
    """Return narrow-band random base acceleration: white noise through a resonant filter (wind, waves, traffic).

    The record is a sum of harmonics with Gaussian amplitudes whose power spectrum is that of a filter of second order,
    (2 zeta omega_0 omega)^2 / ((omega_0^2 - omega^2)^2 + (2 zeta omega_0 omega)^2) with 2 zeta the relative bandwidth.

    Parameters
    ----------
    rms_m_s2
        RMS value of the record [m/s^2].
    omega
        Centre frequency [rad/s].
    bandwidth
        Width of the spectrum at half its height, over the centre frequency [1].
    rng
        Generator of the record.
    duration_s, settling_s
        Length of the run, and the first part that is left out of the indices.
    ramp_s
        Length of the raised-cosine start.
    """
    dt = 2.0 * math.pi / (omega * RANDOM_RATE)
    # twice the duration, because the sum of harmonics repeats itself
    count = 2 * (math.ceil(duration_s / dt) + 2)
    frequencies = 2.0 * math.pi * np.fft.rfftfreq(count, dt)
    width = bandwidth * omega * frequencies
    shape = width / np.sqrt(np.maximum((omega**2 - frequencies**2) ** 2 + width**2, 1e-300))
    amplitudes = rng.standard_normal((2, len(frequencies)))
    record = np.fft.irfft(shape * (amplitudes[0] + 1j * amplitudes[1]), count)[: count // 2]
    record *= rms_m_s2 / float(np.sqrt(np.mean(record**2)))
    clock = dt * np.arange(len(record))

    def at(t: FloatArray) -> FloatArray:
        rise = 0.5 - 0.5 * np.cos(np.pi * np.clip(t / max(ramp_s, 1e-12), 0.0, 1.0))
        return np.asarray(rise * np.interp(t, clock, record))

    return Excitation(
        duration_s,
        at,
        (settling_s, duration_s),
        details={
            "kind": "random",
            "base_amplitude_m_s2": math.sqrt(2.0) * rms_m_s2,
            "base_rms_m_s2": rms_m_s2,
            "centre_rad_s": omega,
            "bandwidth": bandwidth,
            "steady_s": [settling_s, duration_s],
        },
    )


def recorded(time_s: FloatArray, acceleration_m_s2: FloatArray, *, scale: float = 1.0) -> Excitation:
    """Return a recorded base acceleration with linear interpolation between samples.

    Parameters
    ----------
    time_s, acceleration_m_s2
        Shape (m,), clock strictly rising; accelerations of several inputs have shape (m, k).
    scale
        Factor on the record.
    """
    t = np.asarray(time_s, dtype=np.float64) - float(time_s[0])
    a = scale * np.asarray(acceleration_m_s2, dtype=np.float64)
    duration = float(t[-1])
    details = {"kind": "recorded", "peak_m_s2": float(np.max(np.abs(a)))}

    def at(times: FloatArray) -> FloatArray:
        if a.ndim == 1:
            return np.asarray(np.interp(times, t, a))
        return np.column_stack([np.interp(times, t, column) for column in a.T])

    return Excitation(duration, at, (0.0, duration), details=details)


def at_rest(duration_s: float) -> Excitation:
    """Return zero excitation, for a free decay from an initial state."""
    return Excitation(duration_s, np.zeros_like, (0.0, duration_s), 0.0, details={"kind": "rest"})


def amplitude_for(frame: Frame, position: FloatArray, c: float, omega: float, rms_top_m: float) -> float:
    """Return the base amplitude [m/s^2] at which a perfect viscous damper c gives that rms displacement on top.

    This is how the thesis chose its excitation: VD with c = 650 N s/m and 24.3 mm.
    """
    device = c * np.outer(position, position)
    damped = replace(frame, damping=frame.damping + device)
    gain = frequency_response(damped, [omega], absolute_acceleration=False)[0, frame.top]
    return float(math.sqrt(2.0) * rms_top_m / abs(gain))
