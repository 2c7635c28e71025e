"""Steady response of the closed loop over the excitation frequency, and its resonance.

A loop with a friction-like damper is not linear: its resonance depends on the law, on the gains and on the amplitude.
A comparison of laws at one frequency therefore favours the law that happens to be detuned there. This module measures
the steady RMS response at many frequencies, at constant amplitude of the base acceleration, and refines the frequency
of the largest response.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import minimize_scalar

from mrpipe.artifacts import FloatArray
from mrpipe.errors import DivergedError
from mrpipe.simulation.excitation import Excitation, harmonic
from mrpipe.simulation.loop import Response
from mrpipe.simulation.settings import ResonanceSettings

QUANTITIES = ("rms_x_top_m", "rms_x1_m", "rms_a1_m_s2", "rms_a_top_m_s2", "rms_stroke_m")
"""The steady quantities of one frequency, in the order of the columns of `ResponseCurve.values`."""

Run = Callable[[Excitation], Response]


_SETTINGS = ResonanceSettings()
"""The defaults that the options share with the settings."""


@dataclass(frozen=True)
class CurveOptions:
    """How a response curve is measured.

    Attributes
    ----------
    points
        Frequencies of the grid, spaced in equal ratios.
    settling_cycles
        Cycles before the first comparison of windows.
    window_cycles
        Cycles over which an RMS value is taken.
    tolerance
        Relative change of the RMS values from one window to the next that counts as steady.
    most_cycles
        Longest run. A response that is not steady by then keeps its last value.
    frequency_tolerance
        Relative accuracy of the refined resonance frequencies.
    refined_share
        Local maxima of the grid above this share of the largest value are refined.
    absolute
        Whether accelerations are absolute; else relative to the ground.
    """

    points: int = _SETTINGS.points
    settling_cycles: int = 10
    window_cycles: int = _SETTINGS.window_cycles
    tolerance: float = _SETTINGS.tolerance
    most_cycles: int = _SETTINGS.most_cycles
    frequency_tolerance: float = 2e-3
    refined_share: float = 0.9
    absolute: bool = False


@dataclass(frozen=True)
class ResponseCurve:
    """Steady response over frequency at one amplitude of the base acceleration.

    Attributes
    ----------
    base_amplitude_m_s2
        Amplitude of the base acceleration [m/s^2], the same at all frequencies.
    frequency_rad_s
        Ascending, shape (m,) [rad/s]: the grid and the refined frequencies.
    values
        RMS values, shape (m, len(QUANTITIES)) [m] and [m/s^2].
    steady
        Whether the response became steady at each frequency, shape (m,).
    """

    base_amplitude_m_s2: float
    frequency_rad_s: FloatArray
    values: FloatArray
    steady: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

    def column(self, quantity: str) -> FloatArray:
        """Return the RMS values of one quantity, shape (m,)."""
        return np.asarray(self.values[:, QUANTITIES.index(quantity)])

    def peak(self, quantity: str) -> float:
        """Return the largest RMS value of a quantity over the band."""
        return float(np.max(self.column(quantity)))

    @property
    def resonance_rad_s(self) -> float:
        """Frequency at which the RMS displacement of the top floor is largest [rad/s]."""
        return float(self.frequency_rad_s[int(np.argmax(self.column("rms_x_top_m")))])

    def as_json(self) -> dict[str, object]:
        """Return the peaks, the resonance and the curve with the names that the command line prints."""
        curve: dict[str, object] = {"frequency_rad_s": self.frequency_rad_s.tolist()}
        curve.update({name: self.column(name).tolist() for name in QUANTITIES})
        return {**self.peaks_as_json(), "response_curve": curve}

    def peaks_as_json(self) -> dict[str, object]:
        """Return amplitude, resonance and the largest values over the band."""
        result: dict[str, object] = {"base_amplitude_m_s2": self.base_amplitude_m_s2}
        result["resonance_rad_s"] = self.resonance_rad_s
        result.update({f"peak_{name}": self.peak(name) for name in QUANTITIES})
        return result


@dataclass
class _Measured:
    """RMS values by frequency, so that no frequency is run twice."""

    measure: Callable[[float], tuple[FloatArray, bool]]
    known: dict[float, tuple[FloatArray, bool]] = field(default_factory=dict)

    def __call__(self, omega: float) -> FloatArray:
        if omega not in self.known:
            self.known[omega] = self.measure(omega)
        return self.known[omega][0]


def steady_values(run: Run, amplitude_m_s2: float, omega: float, options: CurveOptions) -> tuple[FloatArray, bool]:
    """Return the steady RMS values at one frequency, shape (len(QUANTITIES),), and whether they are steady.

    The run is repeated with twice the settling time until the RMS values of the last two windows agree. A response
    that grows without bound has infinite values, because an optimiser must be able to compare it.

    Parameters
    ----------
    run
        Runs the loop under an excitation, from rest.
    amplitude_m_s2, omega
        Of the base acceleration [m/s^2], [rad/s].
    options
        Lengths and tolerance.
    """
    window = options.window_cycles
    cycles = options.settling_cycles + 2 * window
    values = np.full(len(QUANTITIES), math.inf)
    while True:
        excitation = harmonic(amplitude_m_s2, omega, cycles=cycles, settling_cycles=cycles - window)
        try:
            response = run(excitation)
        except DivergedError:
            return np.full(len(QUANTITIES), math.inf), False
        period = 2.0 * math.pi / omega
        end = cycles * period
        before = rms_between(response, end - 2 * window * period, end - window * period, options.absolute)
        values = rms_between(response, end - window * period, end, options.absolute)
        if np.all(np.abs(values - before) <= options.tolerance * np.abs(values)):
            return values, True
        if cycles >= options.most_cycles:
            return values, False
        cycles = min(2 * cycles, options.most_cycles)


def response_curve(
    run: Run, amplitude_m_s2: float, band_rad_s: tuple[float, float], options: CurveOptions | None = None
) -> ResponseCurve:
    """Return the steady response over a frequency band, with refined resonances.

    The grid finds the local maxima of the top displacement and of both accelerations. Each of them is then refined by
    a bounded search between its neighbours, so that the peaks do not depend on the grid.

    Parameters
    ----------
    run
        Runs the loop under an excitation, from rest.
    amplitude_m_s2
        Amplitude of the base acceleration [m/s^2].
    band_rad_s
        Lowest and highest frequency [rad/s].
    options
        How it is measured.
    """
    options = options or CurveOptions()
    first, last = band_rad_s
    grid = [float(value) for value in np.geomspace(first, last, options.points)]
    measured = _Measured(lambda omega: steady_values(run, amplitude_m_s2, omega, options))
    table = np.array([measured(omega) for omega in grid])
    for quantity in ("rms_x_top_m", "rms_a_top_m_s2", "rms_a1_m_s2"):
        column = QUANTITIES.index(quantity)
        for place in _maxima(table[:, column], options.refined_share):
            _refine(measured, column, grid, place, options.frequency_tolerance)
    omegas = np.array(sorted(measured.known))
    values = np.array([measured.known[float(omega)][0] for omega in omegas])
    steady = np.array([measured.known[float(omega)][1] for omega in omegas])
    return ResponseCurve(amplitude_m_s2, omegas, values, steady)


def rms_between(response: Response, start_s: float, end_s: float, absolute: bool) -> FloatArray:
    """Return the RMS values between two times, in the order of QUANTITIES.

    The integral of the square is interpolated at both ends, because a period is not a whole number of samples.
    """
    t = response.time_s
    accelerations = response.absolute_acceleration if absolute else response.acceleration
    histories = (
        response.displacement[:, -1],
        response.displacement[:, 0],
        accelerations[:, 0],
        accelerations[:, -1],
        response.damper_displacement,
    )
    first = max(int(np.searchsorted(t, start_s)) - 1, 0)
    clock = t[first:]
    values = []
    for history in histories:
        integral = cumulative_trapezoid(history[first:] ** 2, clock, initial=0.0)
        start, end = np.interp([start_s, min(end_s, float(t[-1]))], clock, integral)
        values.append(math.sqrt(max(float(end - start), 0.0) / (min(end_s, float(t[-1])) - start_s)))
    return np.array(values)


def _maxima(values: FloatArray, share: float) -> list[int]:
    """Return the places of local maxima above a share of the largest value; infinite values are not refined."""
    if not np.all(np.isfinite(values)):
        return []
    padded = np.concatenate([[-math.inf], values, [-math.inf]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
    return [int(place) for place in peaks if values[place] >= share * np.max(values)]


def _refine(measured: _Measured, column: int, grid: Sequence[float], place: int, tolerance: float) -> None:
    """Search the maximum between the neighbours of a grid point; the values stay in `measured`."""
    low, high = grid[max(place - 1, 0)], grid[min(place + 1, len(grid) - 1)]
    minimize_scalar(
        lambda omega: -float(measured(float(omega))[column]),
        bounds=(low, high),
        method="bounded",
        options={"xatol": tolerance * grid[place], "maxiter": 12},
    )
