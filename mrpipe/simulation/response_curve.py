"""Steady response of the closed loop over the excitation frequency, and its resonance.

A loop with a friction-like damper is not linear: its resonance depends on the law, on the gains and on the amplitude. A
comparison of laws at one frequency therefore favours a law that moves the resonance away from this frequency. This
module measures the steady RMS response at many frequencies, at constant amplitude of the base acceleration, and refines
the frequency of the largest response.

The values of an irregular response have a standard error, and the largest of several such values is on average too
large. With `CurveOptions.standard_error` all values that may be the largest are therefore measured again, over further
runs, until they are accurate or are smaller than the largest by more than their errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.simulation.steady_state import CurveOptions, Run, Steady, SteadyResponses
from mrpipe.simulation.windows import DISPLAYED, QUANTITIES

NARROW, INTO = 10.0, 0.3
"""A maximum is found once its interval is narrower than this number of frequency tolerances; and share of the wider
side of the interval at which the search continues if the parabola repeats the maximum.
"""

SEARCHING = (8.0, 4.0, 2.0)
"""Errors with which two values are compared in a search, relative to the standard error of the maximum. They are used
one after the other until the difference exceeds its error.
"""

RIVAL = 2.0
"""A value may be the largest if it is smaller than the largest one by less than this number of standard errors of their
difference.
"""

SEARCHING_CYCLES = 0.25
"""Largest number of cycles over which a value of the search is averaged, relative to that of a largest value."""


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
        Values of QUANTITIES, shape (m, len(QUANTITIES)), SI.
    errors
        Standard errors of the values, shape (m, len(QUANTITIES)).
    steady
        Whether the response became steady at each frequency, shape (m,).
    """

    base_amplitude_m_s2: float
    frequency_rad_s: FloatArray
    values: FloatArray
    errors: FloatArray
    steady: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

    def column(self, quantity: str) -> FloatArray:
        """Return the RMS values of one quantity, shape (m,)."""
        return np.asarray(self.values[:, QUANTITIES.index(quantity)])

    def peak(self, quantity: str) -> float:
        """Return the largest RMS value of a quantity over the band."""
        return float(np.max(self.column(quantity)))

    def peak_error(self, quantity: str) -> float:
        """Return the standard error of :meth:`peak`."""
        column = QUANTITIES.index(quantity)
        return float(self.errors[int(np.argmax(self.values[:, column])), column])

    @property
    def resonance_rad_s(self) -> float:
        """Frequency at which the RMS displacement of the top floor is largest [rad/s]."""
        return float(self.frequency_rad_s[int(np.argmax(self.column("rms_x_top_m")))])

    def as_json(self) -> dict[str, object]:
        """Return the peaks, the resonance and the curve with the names that the command line prints."""
        curve: dict[str, object] = {"frequency_rad_s": self.frequency_rad_s.tolist()}
        curve.update({name: self.column(name).tolist() for name in DISPLAYED})
        return {**self.peaks_as_json(), "response_curve": curve}

    def peaks_as_json(self) -> dict[str, object]:
        """Return amplitude, resonance and the largest values over the band."""
        result: dict[str, object] = {"base_amplitude_m_s2": self.base_amplitude_m_s2}
        result["resonance_rad_s"] = self.resonance_rad_s
        result.update({f"peak_{name}": self.peak(name) for name in DISPLAYED})
        result.update({f"standard_error_{name}": self.peak_error(name) for name in CurveOptions().refined})
        return result


def response_curve(
    run: Run,
    amplitude_m_s2: float,
    band_rad_s: tuple[float, float],
    options: CurveOptions | None = None,
    known: dict[float, Steady] | None = None,
    jobs: int = 1,
) -> ResponseCurve:
    """Return the steady response over a frequency band, with refined resonances.

    The grid finds the local maxima of the top displacement and of both accelerations. Each of them is then refined by
    a bounded search between its neighbours, so that the peaks do not depend on the grid.

    Parameters
    ----------
    run
        Function that runs the loop under an excitation, from rest.
    amplitude_m_s2
        Amplitude of the base acceleration [m/s^2].
    band_rad_s
        Lowest and highest frequency [rad/s].
    options
        Options of the measurement.
    known
        Frequency [rad/s] -> response that was measured under the same conditions; new responses are added.
    jobs
        Threads for the further runs of an irregular response; the result does not depend on their number.
    """
    options = options or CurveOptions()
    first, last = band_rad_s
    grid = [float(value) for value in np.geomspace(first, last, options.points)]
    measured = SteadyResponses(run, amplitude_m_s2, options, {} if known is None else known, jobs)
    for omega in grid:
        measured(omega)
    for quantity in options.refined:
        column = QUANTITIES.index(quantity)
        for place in _maxima(_searched(measured, column, grid), options.refined_share):
            _refine(measured, column, grid, place)
    for quantity in dict.fromkeys((*options.refined, *DISPLAYED)):
        _measure_largest(measured, QUANTITIES.index(quantity))
    omegas = sorted(measured.known)
    found = [measured.known[omega] for omega in omegas]
    return ResponseCurve(
        amplitude_m_s2,
        np.array(omegas),
        np.array([item.values for item in found]),
        np.array([measured.errors(omega) for omega in omegas]),
        np.array([item.steady for item in found]),
    )


def _accurate(measured: SteadyResponses, omega: float, column: int, times: float = SEARCHING[0]) -> float:
    """Return a value whose error is at most `times` the required one, within the limit of cycles of a search."""
    options = measured.options
    most = round(SEARCHING_CYCLES * options.most_averaged_cycles)
    return measured.accurate(omega, column, times * options.standard_error, most)


def _is_larger(measured: SteadyResponses, column: int, first: float, second: float) -> bool:
    """Return whether the value at the first frequency is larger than that at the second.

    Both are averaged only until they differ by more than their errors explain.
    """
    for times in SEARCHING:
        difference = _accurate(measured, first, column, times) - _accurate(measured, second, column, times)
        if not abs(difference) <= RIVAL * math.hypot(*(measured.errors(omega)[column] for omega in (first, second))):
            break
    return difference > 0.0


def _searched(measured: SteadyResponses, column: int, grid: Sequence[float]) -> FloatArray:
    """Return one quantity on the grid; values that may be maxima have the accuracy of the beginning of a search."""
    values = np.array([measured(omega)[column] for omega in grid])
    if np.all(np.isfinite(values)):
        for place in np.flatnonzero(values >= measured.options.refined_share * np.max(values)).tolist():
            values[place] = _accurate(measured, grid[place], column)
    return values


def _measure_largest(measured: SteadyResponses, column: int) -> None:
    """Measure the values of a quantity that may be the largest, until they are as accurate as demanded.

    A value may be the largest while it is smaller than the largest one by no more than :data:`RIVAL` standard errors of
    their difference. The least accurate of these values is averaged over further runs, in steps of half its error,
    because most of them are dropped before they are accurate.
    """
    options = measured.options
    done: set[float] = set()
    while True:
        rivals = [omega for omega in _rivals(measured, column) if omega not in done]
        if not rivals:
            return
        relative = {omega: _relative_error(measured, omega, column) for omega in rivals}
        least = max(rivals, key=lambda omega: relative[omega])
        known = measured.known[least]
        error = max(options.standard_error, 0.5 * relative[least])
        measured.accurate(least, column, error, options.most_averaged_cycles)
        if measured.known[least] is known or error == options.standard_error:
            done.add(least)


def _rivals(measured: SteadyResponses, column: int) -> list[float]:
    """Return the frequencies of the values that may be the largest, the largest first."""
    values = {omega: float(item.values[column]) for omega, item in measured.known.items()}
    errors = {omega: float(measured.errors(omega)[column]) for omega in values}
    ordered = sorted(values, key=lambda omega: -values[omega])
    largest = ordered[0]
    if not math.isfinite(values[largest]):
        return [largest]
    return [
        omega
        for omega in ordered
        if values[largest] - values[omega] <= RIVAL * math.hypot(errors[largest], errors[omega])
    ]


def _relative_error(measured: SteadyResponses, omega: float, column: int) -> float:
    value = float(measured.known[omega].values[column])
    return float(measured.errors(omega)[column]) / value if value > 0.0 else 0.0


def _maxima(values: FloatArray, share: float) -> list[int]:
    """Return the indices of local maxima above a share of the largest value; infinite values are not refined."""
    if not np.all(np.isfinite(values)):
        return []
    padded = np.concatenate([[-math.inf], values, [-math.inf]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
    return [int(place) for place in peaks if values[place] >= share * np.max(values)]


def _refine(measured: SteadyResponses, column: int, grid: Sequence[float], place: int) -> None:
    """Search the maximum between the neighbours of a grid point; the values stay in `measured`.

    A parabola through the three points about the maximum gives the next frequency (in logarithms, because the grid has
    equal ratios). Where it repeats the maximum of an interval that is still wide, the search enters the wider side.
    """
    options = measured.options
    omegas = [grid[k] for k in (place - 1, place, place + 1) if 0 <= k < len(grid)]
    points = [math.log(omega) for omega in omegas]
    frequencies = dict(zip(points, omegas, strict=True))

    def value(point: float) -> float:
        return _accurate(measured, frequencies.setdefault(point, math.exp(point)), column)

    if len(points) == 2:
        # the largest response is at the edge of the band: look between the edge and its neighbour
        points.insert(1, 0.5 * (points[0] + points[1]))
        if value(points[1]) < max(value(points[0]), value(points[2])):
            return
    low, top, high = points
    for _ in range(options.refinements):
        values = value(low), value(top), value(high)
        new = _vertex((low, top, high), values)
        if abs(new - top) < options.frequency_tolerance:
            flat = min(values) >= (1.0 - options.flatness) * values[1]
            if flat and high - low < NARROW * options.frequency_tolerance:
                return
            new = top + INTO * (high - top) if high - top > top - low else top - INTO * (top - low)
        value(new)
        if _is_larger(measured, column, frequencies[new], frequencies[top]):
            low, top, high = (top, new, high) if new > top else (low, new, top)
        else:
            low, high = (new, high) if new < top else (low, new)


def _vertex(x: tuple[float, float, float], y: tuple[float, float, float]) -> float:
    """Return the abscissa of the maximum of the parabola through three points; the middle point if there is none."""
    left, right = (x[1] - x[0]) * (y[1] - y[2]), (x[1] - x[2]) * (y[1] - y[0])
    bottom = left - right
    if bottom == 0.0:
        return x[1]
    found = x[1] - 0.5 * ((x[1] - x[0]) * left - (x[1] - x[2]) * right) / bottom
    return found if x[0] < found < x[2] else x[1]
