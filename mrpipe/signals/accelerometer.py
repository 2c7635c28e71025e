"""The accelerometer of a bench: its sign, its gain, and the motion from both sensors."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.signals.fusion import SensorAgreement, fused_displacement, on_displacement_clock, sensor_agreement
from mrpipe.signals.options import Motion

Channels = dict[str, FloatArray]


def require_acceleration(tests: Mapping[str, Collection[str]], motion: Motion, source: str) -> None:
    """Refuse tests (name -> channels) without an acceleration where the motion comes from both sensors.

    Raises
    ------
    UserError
        If a test lacks the acceleration; the message names the first such test.
    """
    if motion == "displacement":
        return
    for name, channels in tests.items():
        if "acceleration" not in channels:
            raise UserError(
                source,
                f"test {name}",
                f"has no acceleration, and prepare.motion is {motion}",
                "give the channel, or set prepare.motion to displacement",
            )


def with_accelerometer(
    tests: Mapping[str, Channels], sampling_rate_hz: float, motion: Motion, source: str
) -> list[str]:
    """Correct the sign of the acceleration, and put the motion from both sensors in the place of the displacement.

    Parameters
    ----------
    tests
        Channels of each test; displacement and acceleration are replaced.
    sampling_rate_hz
        Rate of all tests.
    motion
        Sensors that give the motion.
    source
        Campaign, for messages.

    Returns
    -------
    list of str
        Findings, one line each.

    Raises
    ------
    UserError
        If the motion needs an acceleration that a test lacks, or that does not agree with the displacement.
    """
    measured = [channels for channels in tests.values() if "acceleration" in channels]
    findings = _with_right_sign(measured, sampling_rate_hz)
    if motion == "displacement":
        return findings + (_advice(measured, sampling_rate_hz) if measured else [])
    require_acceleration({name: set(channels) for name, channels in tests.items()}, motion, source)
    found = _agreement(measured, sampling_rate_hz)
    for channels in measured:
        acceleration = on_displacement_clock(channels["acceleration"], found, sampling_rate_hz)
        channels["acceleration"] = acceleration
        channels["displacement"] = fused_displacement(
            channels["displacement"], acceleration, sampling_rate_hz, found.crossover_hz
        )
    return [*findings, found.line]


def _with_right_sign(tests: Sequence[Channels], rate: float) -> list[str]:
    """Invert an acceleration whose sign contradicts that of the displacement, and report a doubtful unit."""
    if not tests:
        return []
    gain = float(np.median([acceleration_gain(item["displacement"], item["acceleration"], rate) for item in tests]))
    findings = []
    if gain < -0.2:
        findings.append(
            "acceleration has the opposite sign of the displacement's second derivative: its sign was reversed"
        )
        for channels in tests:
            channels["acceleration"] = -channels["acceleration"]
    if not 0.7 < abs(gain) < 1.4:
        findings.append(
            f"acceleration is {abs(gain):.3g} times the second derivative of displacement: check unit, scale and "
            "place of the accelerometer"
        )
    return findings


def _advice(tests: Sequence[Channels], rate: float) -> list[str]:
    """Return a finding if the acceleration would make the velocity clearly better."""
    try:
        found = _agreement(tests, rate)
    except UserError:
        return []
    return [found.advice] if found.worthwhile else []


def _agreement(tests: Sequence[Channels], rate: float) -> SensorAgreement:
    return sensor_agreement([(item["displacement"], item["acceleration"]) for item in tests], rate)


def acceleration_gain(displacement: FloatArray, acceleration: FloatArray, sampling_rate_hz: float) -> float:
    """Return the ratio of acceleration to second derivative of displacement: 1 if sign and unit are right.

    It is computed from the cross spectrum around the strongest frequency of the motion, where the noise of the
    displacement is negligible.

    Parameters
    ----------
    displacement, acceleration
        Shape (n,).
    sampling_rate_hz
        Sampling rate [Hz].

    Returns
    -------
    float
        Gain with sign; 0 without motion.
    """
    window = np.hanning(displacement.size)
    frequencies = np.fft.rfftfreq(displacement.size, 1.0 / sampling_rate_hz)
    motion = np.fft.rfft(window * (displacement - displacement.mean()))
    measured = np.fft.rfft(window * (acceleration - acceleration.mean()))
    square = (2.0 * np.pi * frequencies) ** 2
    strongest = frequencies[2 + int(np.argmax(np.abs(motion[2:]) * frequencies[2:]))]
    band = (frequencies > 0.7 * strongest) & (frequencies < 1.4 * strongest)
    power = float(np.sum(square[band] * np.abs(motion[band]) ** 2))
    return -float(np.sum(np.real(np.conj(motion[band]) * measured[band]))) / power if power > 0.0 else 0.0
