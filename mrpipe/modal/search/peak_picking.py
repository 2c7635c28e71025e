"""Peak picking: frequencies and shapes from the largest values of the frequency responses (section 3.2.1).

The thesis finds the modes by this method: the resonance is the maximum of the magnitude of the transfer function (3.4),
the magnitudes of the floors there are the shape, and the phases give the signs. The multi-mode fit is more accurate,
because a peak lies between two lines of the spectrum and the other modes contribute to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import ComplexArray, record_spectrum

SEARCHED = 0.1
"""Half of the width in which a peak is searched, relative to the frequency of the fitted mode; less if another mode is
near.
"""

AVERAGED_LINES = 3
"""Lines of the spectrum over which cross and auto spectral density are averaged."""

_NORMAL_95 = 1.959964


def transfer_functions(test: FrameTest, band_hz: tuple[float, float]) -> tuple[FloatArray, ComplexArray]:
    """Return lines [rad/s], shape (m,), and P_gi/P_gg (3.4) of acceleration over excitation, shape (m, s).

    The densities are averaged over neighbouring lines of the whole record, because segments of it would be too short
    for the narrow peaks of a lightly damped frame.
    """
    spectrum = record_spectrum(test, band_hz)
    kernel = np.full(AVERAGED_LINES, 1.0 / AVERAGED_LINES)
    excitation = spectrum.excitation
    auto = np.convolve(np.abs(excitation) ** 2, kernel, mode="same")
    # a displacement gives the acceleration by -omega^2
    factors = np.where(np.asarray(test.is_displacement)[None, :], -(spectrum.omega[:, None] ** 2), 1.0)
    cross = np.conj(excitation)[:, None] * spectrum.responses * factors
    averaged = np.apply_along_axis(lambda column: np.convolve(column, kernel, mode="same"), 0, cross)
    response = averaged / np.maximum(auto, np.finfo(float).tiny)[:, None]
    return spectrum.omega, np.asarray(response, dtype=np.complex128)


def pick_peaks(tests: Sequence[FrameTest], fit: MultiModeFit, band_hz: tuple[float, float]) -> MultiModeFit:
    """Return the fit with frequencies and shapes by peak picking near its modes.

    Parameters
    ----------
    tests
        Forced tests with a measured excitation; each mode is taken from the test in which its peak is highest.
    fit
        Fit that gives the number of modes and the frequencies at which to search. Its damping ratios and errors are
        kept; the interval of each frequency covers the lines that are averaged.
    band_hz
        Band of the fit.
    """
    measured = [(test, *transfer_functions(test, band_hz)) for test in tests]
    omegas = fit.angular_frequencies.copy()
    residues = fit.residues.copy()
    covariance, freedom = fit.covariance.copy(), fit.freedom.copy()
    freedom[: omegas.size] = np.inf
    for mode, omega in enumerate(fit.angular_frequencies):
        others = np.delete(fit.angular_frequencies, mode)
        reach = min(SEARCHED * omega, *(0.5 * np.abs(others - omega)))
        best = 0.0
        for test, lines, response in measured:
            near = np.flatnonzero(np.abs(lines - omega) <= reach)
            if not near.size:
                continue
            height = np.linalg.norm(response[near], axis=1)
            if height.max() <= best:
                continue
            best = float(height.max())
            place = near[int(np.argmax(height))]
            omegas[mode] = lines[place]
            half_width = 0.5 * AVERAGED_LINES * (lines[1] - lines[0])
            covariance[mode, mode] = (half_width / _NORMAL_95 / lines[place]) ** 2
            residues[:, mode] = _shape(response[place], test, fit, mode)
    return replace(fit, angular_frequencies=omegas, residues=residues, covariance=covariance, freedom=freedom)


def _shape(response: ComplexArray, test: FrameTest, fit: MultiModeFit, mode: int) -> ComplexArray:
    """Return the magnitudes with the signs of the phases, scaled to the fitted residues; other sensors are kept."""
    strongest = response[int(np.argmax(np.abs(response)))]
    signed = np.abs(response) * np.sign(np.real(response * np.conj(strongest)))
    result = fit.residues[:, mode].copy()
    columns = [(row, test.sensors.index(sensor)) for row, sensor in enumerate(fit.sensors) if sensor in test.sensors]
    rows = np.array([row for row, _ in columns])
    picked = signed[[column for _, column in columns]]
    # the scale of a shape is arbitrary; with that of the fit, residues and their errors are comparable
    fitted = result[rows].real
    scale = float(picked @ fitted) / float(picked @ picked)
    result[rows] = scale * picked
    return result
