"""Agreement of the identified frame with the measurements, in time and in frequency (section 3.3.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.modal.doubts import Doubt
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import ComplexArray
from mrpipe.structures import Frame, frequency_response
from mrpipe.structures.response import band_limited_response, linear_response

_FILTER_ORDER = 3

POOR_FIT_PERCENT = 30.0
"""Where the fit of a test (median of the sensors) is smaller, its excitation may have the wrong sign, unit or place."""

EXPLAINED_FIT_PERCENT = 70.0
"""A correction that gives at least this fit explains a poor one."""


@dataclass(frozen=True)
class TimeVerification:
    """Measured and simulated response of one test inside the band.

    Attributes
    ----------
    test
        Name.
    time_s
        Shape (m,).
    measured, simulated
        Shape (m, s), absolute acceleration [m/s2] (displacement [m] for a floor without an accelerometer).
    nrmse
        Shape (s,): RMS error over RMS of the measured response.
    fit_percent
        Shape (s,): 100 (1 - |y - y_hat|/|y - mean y|).
    floors
        Floor of each column.
    """

    test: str
    time_s: FloatArray
    measured: FloatArray
    simulated: FloatArray
    nrmse: FloatArray
    fit_percent: FloatArray
    floors: tuple[int, ...] = ()


def verify_in_time(frame: Frame, test: FrameTest, band_hz: tuple[float, float]) -> TimeVerification:
    """Simulate a forced test with its measured excitation; compare inside the band (order 3, zero phase).

    The simulation begins at rest, except for a part of a recording: its first motion is estimated from the responses.
    """
    if test.excitation is None:
        raise ValueError("a simulation needs the excitation")
    rate = test.sampling_rate_hz
    rows = [sensor.floor - 1 for sensor in test.sensors]
    flags = np.asarray(test.is_displacement)
    simulated = np.zeros(test.responses.shape)
    for place, values in test.inputs.items():
        values = values - values.mean()
        response = band_limited_response(frame, values, 1.0 / rate, band_hz[1], shaker_floor=place.floor)
        simulated += np.where(flags, response.displacement[:, rows], response.absolute_acceleration[:, rows])
    if test.is_part:
        simulated = simulated + _first_motion(frame, test, simulated, _band_pass(band_hz, rate))
    return compare_in_time(simulated, test, band_hz)


def _first_motion(frame: Frame, test: FrameTest, simulated: FloatArray, sections: FloatArray) -> FloatArray:
    """Return the free response, shape (m, s), that explains the difference from a simulation from rest best."""
    rows = [sensor.floor - 1 for sensor in test.sensors]
    flags = np.asarray(test.is_displacement)
    still, dt = np.zeros(simulated.shape[0]), 1.0 / test.sampling_rate_hz
    columns = []
    for state in np.eye(2 * frame.floors):
        response = linear_response(frame, still, dt, initial_state=state)
        columns.append(np.where(flags, response.displacement[:, rows], response.absolute_acceleration[:, rows]))
    free = np.stack(columns, axis=-1)
    wanted = signal.sosfiltfilt(sections, test.responses - test.responses.mean(axis=0) - simulated, axis=0)
    basis = signal.sosfiltfilt(sections, free, axis=0).reshape(-1, free.shape[-1])
    size = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
    values = np.linalg.lstsq(basis / size, wanted.ravel(), rcond=1e-10)[0] / size
    return np.asarray(free @ values)


def _band_pass(band_hz: tuple[float, float], rate: float) -> FloatArray:
    top = min(band_hz[1], 0.9 * 0.5 * rate)
    return np.asarray(signal.butter(_FILTER_ORDER, [band_hz[0], top], btype="bandpass", fs=rate, output="sos"))


def compare_in_time(simulated: FloatArray, test: FrameTest, band_hz: tuple[float, float]) -> TimeVerification:
    """Compare a simulated response, shape (m, s), with that of a test inside the band (order 3, zero phase)."""
    rate = test.sampling_rate_hz
    sections = _band_pass(band_hz, rate)
    measured = test.responses - test.responses.mean(axis=0)
    measured = np.asarray(signal.sosfiltfilt(sections, measured, axis=0))
    simulated = np.asarray(signal.sosfiltfilt(sections, simulated, axis=0))
    error = measured - simulated
    size = np.maximum(np.sqrt(np.mean(measured**2, axis=0)), 1e-300)
    spread = np.maximum(np.linalg.norm(measured - measured.mean(axis=0), axis=0), 1e-300)
    return TimeVerification(
        test=test.name,
        time_s=np.arange(measured.shape[0]) / rate,
        measured=measured,
        simulated=simulated,
        nrmse=np.sqrt(np.mean(error**2, axis=0)) / size,
        fit_percent=100.0 * (1.0 - np.linalg.norm(error, axis=0) / spread),
        floors=tuple(sensor.floor for sensor in test.sensors),
    )


@dataclass(frozen=True)
class FrequencyVerification:
    """Frequency responses of the first forced test and of the frame.

    Attributes
    ----------
    frequency_hz
        Shape (m,).
    measured, synthesised
        Measured without leakage, and from M, C, K, shape (m, s).
    error
        Shape (s,): |measured - synthesised|/|measured| over the band, lines weighted by the excitation.
    floors
        Floor of each column.
    """

    frequency_hz: FloatArray
    measured: ComplexArray
    synthesised: ComplexArray
    error: FloatArray
    floors: tuple[int, ...] = ()


def verify_in_frequency(frame: Frame, fit: MultiModeFit, band_hz: tuple[float, float]) -> FrequencyVerification:
    """Compare the measured response of the first test, without its transients, with that of M, C and K.

    The frequency response is that to the first input. The contribution of further inputs is computed with the model.
    """
    spectrum = fit.spectra[0]
    inside = (fit.omega[0] >= 2.0 * np.pi * band_hz[0]) & (fit.omega[0] <= 2.0 * np.pi * band_hz[1])
    omega, excitations, measured = fit.omega[0][inside], spectrum.excitations[inside], fit.measured[0][inside]
    rows = [sensor.floor - 1 for sensor in spectrum.sensors]
    flags = np.asarray([sensor.is_displacement for sensor in spectrum.sensors])
    steady = np.zeros_like(measured)
    synthesised = np.zeros_like(measured)
    for index, place in enumerate(spectrum.inputs):
        accelerations = frequency_response(frame, omega, shaker_floor=place.floor)[:, rows]
        displacements = frequency_response(frame, omega, shaker_floor=place.floor, absolute_acceleration=False)[:, rows]
        response = np.where(flags, displacements, accelerations)
        synthesised = response if index == 0 else synthesised
        steady += response * excitations[:, index : index + 1]
    excitation = excitations[:, 0]
    error = np.linalg.norm(measured - steady, axis=0) / np.linalg.norm(measured, axis=0)
    # lines without excitation have no frequency response
    useful = np.abs(excitation) > 0.05 * np.median(np.abs(excitation))
    others = steady - synthesised * excitation[:, None]
    return FrequencyVerification(
        frequency_hz=omega[useful] / (2.0 * np.pi),
        measured=(measured - others)[useful] / excitation[useful, None],
        synthesised=synthesised[useful],
        error=error,
        floors=tuple(sensor.floor for sensor in spectrum.sensors),
    )


def misfit_findings(
    frame: Frame, tests: Sequence[FrameTest], found: Sequence[TimeVerification], band_hz: tuple[float, float]
) -> list[str]:
    """Return what explains forced tests that the frame does not reproduce, a sentence for each.

    Modes do not depend on sign, unit and place of the excitation, so that a mistake there shows only now.

    Parameters
    ----------
    frame
        The identified structure.
    tests, found
        Tests with measured excitation, and their verification.
    band_hz
        Band of the verification.
    """
    lines = (_misfit(frame, test, item, band_hz) for test, item in zip(tests, found, strict=True))
    return [Doubt(line) for line in lines if line]


def _misfit(frame: Frame, test: FrameTest, found: TimeVerification, band_hz: tuple[float, float]) -> str:
    usual = float(np.median(found.fit_percent))
    if usual > POOR_FIT_PERCENT:
        return ""
    factor, fit = _scaled_fit(found)
    if fit > EXPLAINED_FIT_PERCENT and factor < 0.0:
        said = "opposite to the simulated one: the sign of the excitation, or of all sensors, is wrong"
        return f"test {test.name}: the measured response is {said}"
    if fit > EXPLAINED_FIT_PERCENT:
        said = f"{factor:.3g} times the simulated one: the unit of the excitation or of the sensors is wrong"
        return f"test {test.name}: the measured response is {said}"
    floor = test.shaker_floor
    if floor > 0 and len(test.inputs) == 1:
        others = [other for other in range(1, frame.floors + 1) if other != floor]
        fits = [_scaled_fit(verify_in_time(frame, replace(test, shaker_floor=other), band_hz)) for other in others]
        best = int(np.argmax([fit if factor > 0.0 else -np.inf for factor, fit in fits]))
        if fits[best][1] > EXPLAINED_FIT_PERCENT:
            said = f"that to a force on floor {others[best]}, and the campaign says floor {floor}"
            return f"test {test.name}: the measured response is {said}: correct the floor of the shaker"
    if usual > 0.0:
        return ""
    return (
        f"test {test.name}: the structure does not reproduce the response to the measured excitation (fit {usual:.0f} "
        "%): channel, place or sign of the excitation, or the sign of a sensor, may be wrong"
    )


def _scaled_fit(found: TimeVerification) -> tuple[float, float]:
    """Return the factor on the simulated response that fits best, and the fit with it [%]."""
    measured, simulated = found.measured, found.simulated
    factor = float(np.sum(measured * simulated) / max(float(np.sum(simulated**2)), 1e-300))
    error = float(np.linalg.norm(measured - factor * simulated)) / max(float(np.linalg.norm(measured)), 1e-300)
    return factor, 100.0 * (1.0 - error)
