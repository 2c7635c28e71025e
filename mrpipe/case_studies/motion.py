"""A two-component ground motion made to follow a design spectrum: the embedded default of the benchmarks."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import lfilter

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.options import MotionSettings
from mrpipe.case_studies.public_files import named_file
from mrpipe.structures.records import GRAVITY, GroundMotion, read_motion

SEVEN_MOTIONS = ("elcentro", "erzikan", "jiji", "kobe", "newhall", "rinaldi", "sylmar")
"""The two-component motions of the base-isolated benchmark, 5 ms."""
PUBLIC_MOTIONS = {
    **{name: f"asce_base_isolated/{name}.txt" for name in SEVEN_MOTIONS},
    "elcentro-ns": "ground_motions/elcentro_NS.dat",
}
"""Name -> file in the folder of public data."""
BENCHMARK_INTERVAL_S = 0.005

PERIODS_S = np.geomspace(0.05, 4.0, 60)
"""Periods at which the spectrum is matched [s]."""


def design_spectrum(periods_s: FloatArray, peak_ground_g: float, soil: float = 1.15) -> FloatArray:
    """Return the elastic acceleration spectrum [m/s^2] of EN 1998-1 (3.2) to (3.5), type 1, ground C, 5 %.

    Parameters
    ----------
    periods_s
        Shape (n,).
    peak_ground_g
        Design ground acceleration on rock [g].
    soil
        Soil factor S.
    """
    t_b, t_c, t_d = 0.2, 0.6, 2.0
    T = np.asarray(periods_s, dtype=np.float64)
    shape = np.where(
        t_b > T,
        1.0 + T / t_b * 1.5,
        np.where(t_c >= T, 2.5, np.where(t_d >= T, 2.5 * t_c / T, 2.5 * t_c * t_d / T**2)),
    )
    return np.asarray(peak_ground_g * GRAVITY * soil * shape)


def response_spectrum(
    acceleration: FloatArray, interval_s: float, periods_s: FloatArray, damping_ratio: float = 0.05
) -> FloatArray:
    """Return the pseudo-acceleration spectrum [m/s^2], shape (periods,), by the exact recursion for linear input.

    Parameters
    ----------
    acceleration
        Shape (n,) [m/s^2].
    interval_s
        Sampling interval [s].
    periods_s
        Shape (periods,) [s].
    damping_ratio
        Damping ratio of the oscillators.
    """
    from mrpipe.signals.discretisation import discretise_first_order

    result = np.empty(len(periods_s))
    for index, period in enumerate(periods_s):
        omega = 2.0 * np.pi / period
        A = np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping_ratio * omega]])
        step, now, after = discretise_first_order(A, np.array([[0.0], [-1.0]]), interval_s)
        # the two states' recursion as one filter for the displacement
        trace, determinant = float(np.trace(step)), float(np.linalg.det(step))
        b1 = now[0, 0] + step[0, 1] * after[1, 0] - step[1, 1] * after[0, 0]
        b2 = step[0, 1] * now[1, 0] - step[1, 1] * now[0, 0]
        motion = lfilter([after[0, 0], b1, b2], [1.0, -trace, determinant], acceleration)
        result[index] = omega**2 * np.abs(motion).max()
    return result


def envelope(time_s: FloatArray, rise_s: float = 3.0, strong_s: float = 12.0, decay_rate: float = 0.25) -> FloatArray:
    """Return the build-up (quadratic), strong phase and exponential decay of a record, shape of `time_s`."""
    after = np.maximum(time_s - rise_s - strong_s, 0.0)
    return np.asarray(np.minimum(time_s / rise_s, 1.0) ** 2 * np.exp(-decay_rate * after))


def _matched(
    rng: np.random.Generator, target: FloatArray, time_s: FloatArray, interval_s: float, rounds: int
) -> FloatArray:
    shape = envelope(time_s)
    signal = rng.standard_normal(len(time_s)) * shape
    frequencies = np.fft.rfftfreq(len(time_s), interval_s)
    band = (frequencies > 0.1) & (frequencies < 25.0)
    for _ in range(rounds):
        spectrum = response_spectrum(signal, interval_s, PERIODS_S)
        factor = target / np.maximum(spectrum, 1e-12)
        at = np.interp(np.log(np.maximum(frequencies, 1e-6)), np.log(1.0 / PERIODS_S[::-1]), factor[::-1])
        signal = np.fft.irfft(np.fft.rfft(signal) * np.where(band, at, 0.0), len(time_s)) * np.minimum(
            shape / 0.02, 1.0
        )
    return _brought_to_rest(signal, shape, time_s)


def _brought_to_rest(signal: FloatArray, shape: FloatArray, time_s: FloatArray) -> FloatArray:
    """Return the signal less the little that would leave the ground moving or displaced at the end."""
    remaining = time_s[-1] - time_s
    moments = np.stack([np.ones_like(time_s), remaining])
    shapes = np.stack([shape, shape * time_s / time_s[-1]])
    return np.asarray(signal - np.linalg.solve(moments @ shapes.T, moments @ signal) @ shapes)


def spectrum_compatible_motion(
    rng: np.random.Generator,
    *,
    peak_ground_g: float = 0.3,
    duration_s: float = 30.0,
    interval_s: float = 0.005,
    second_share: float = 0.7,
    rounds: int = 12,
) -> GroundMotion:
    """Return a synthetic motion of two independent components whose 5 % spectra follow :func:`design_spectrum`.

    Noise under an envelope is scaled in the frequency domain until its response spectrum fits; the mean is taken out so
    that the ground comes to rest.

    Parameters
    ----------
    rng
        Source of the phases.
    peak_ground_g
        Design ground acceleration on rock [g].
    duration_s, interval_s
        Length and sampling interval [s].
    second_share
        Strength of the second component over the first.
    rounds
        Iterations of the match.
    """
    samples = round(duration_s / interval_s) + 1
    time: FloatArray = np.arange(samples, dtype=np.float64) * interval_s
    target = design_spectrum(PERIODS_S, peak_ground_g)
    first, second = (_matched(source, target, time, interval_s, rounds) for source in rng.spawn(2))
    values = np.stack([first, second_share * second], axis=1)
    notes = (f"synthetic, spectrum of EN 1998-1 type 1, ground C, {peak_ground_g:g} g on rock",)
    return GroundMotion("synthetic", values, interval_s, "m/s^2", "given", notes)


def load_motion(
    file: str,
    rng: np.random.Generator,
    *,
    second_file: str | None = None,
    unit: str | None = None,
    interval_s: float | None = None,
    resampled_interval_s: float | None = None,
    peak_ground_g: float = 0.3,
    duration_s: float = 30.0,
) -> GroundMotion:
    """Return a ground motion by name (`synthetic` or a public record) or from a file.

    Parameters
    ----------
    file, second_file
        Record, and that of the second component if it is a separate file.
    rng
        Generator of the synthetic motion.
    unit, interval_s
        Unit and sampling interval [s], if the file does not state them; the seven benchmark motions are at 5 ms.
    resampled_interval_s
        Interval to which the record is resampled [s]; None: its own.
    peak_ground_g, duration_s
        Design ground acceleration [g] and duration [s] of the synthetic motion.

    Raises
    ------
    UserError
        If the record is missing or bad.
    """
    if file == "synthetic":
        motion = spectrum_compatible_motion(rng, peak_ground_g=peak_ground_g, duration_s=duration_s)
    else:
        motion = read_motion(
            named_file("--motion", file, PUBLIC_MOTIONS),
            unit=unit,
            interval_s=interval_s,
            fallback_interval_s=BENCHMARK_INTERVAL_S,
        )
    if second_file is not None:
        other = named_file("second_file", second_file, PUBLIC_MOTIONS)
        motion = motion.with_second(read_motion(other, unit=unit, interval_s=interval_s))
    return motion if resampled_interval_s is None else motion.resampled(resampled_interval_s)


def motion_from_settings(settings: MotionSettings, rng: np.random.Generator, components: int) -> GroundMotion:
    """Return the ground motion that the settings name, in one or two components; see :func:`load_motion`."""
    return load_motion(
        settings.file,
        rng,
        second_file=settings.second_file,
        unit=settings.unit,
        interval_s=settings.interval_s,
        resampled_interval_s=settings.resampled_interval_s,
        peak_ground_g=settings.peak_ground_g,
        duration_s=settings.duration_s,
    ).in_components(components)


def motion_facts(motion: GroundMotion) -> dict[str, Any]:
    """Return what a summary says about a motion, in SI."""
    return {
        "name": motion.name,
        "peaks_m_s2": motion.peaks_m_s2,
        "duration_s": motion.duration_s,
        "interval_s": motion.interval_s,
        "unit_in_file": motion.unit,
        "unit_from": motion.unit_from,
        "notes": list(motion.notes),
    }
