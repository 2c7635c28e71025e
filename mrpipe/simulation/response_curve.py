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

from mrpipe.artifacts import FloatArray
from mrpipe.errors import DivergedError
from mrpipe.simulation.excitation import Excitation, harmonic
from mrpipe.simulation.loop import Response
from mrpipe.simulation.settings import ResonanceSettings

DISPLAYED = ("rms_x_top_m", "rms_x1_m", "rms_a1_m_s2", "rms_a_top_m_s2", "rms_stroke_m")
"""RMS values that decide whether a response is steady, and that every response curve shows."""

QUANTITIES = (
    *DISPLAYED,
    "rms_drift_m", "rms_base_shear_n", "rms_drive",
    "max_x_top_m", "max_x1_m", "max_a1_m_s2", "max_a_top_m_s2", "max_stroke_m",
    "max_drift_m", "max_base_shear_n", "max_force_n",
)  # fmt: skip
"""The steady quantities of one frequency, in the order of the columns of `ResponseCurve.values`.

`rms_` is the RMS value and `max_` the largest absolute value. The stroke is the displacement across the damper. The
drift is the difference of displacement between successive floors, of the storey where it is largest. The base shear is
the sum of the floors' masses times absolute accelerations. The drive is in the unit of the damper, A or V.
"""

SMALLEST_GROUP = 3
"""Fewest windows whose scatter says how far sensor noise reaches."""

NARROW, INTO = 10.0, 0.3
"""A maximum is found once its interval is narrower than so many frequency tolerances; share of the wider side of the
interval that a search enters where the parabola repeats the maximum."""

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
    refinements
        Most runs that refine one maximum.
    refined
        Quantities whose maxima are refined.
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
    refinements: int = 8
    refined: tuple[str, ...] = ("rms_x_top_m", "rms_a_top_m_s2", "rms_a1_m_s2")
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
        Of QUANTITIES, shape (m, len(QUANTITIES)), SI units.
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
        curve.update({name: self.column(name).tolist() for name in DISPLAYED})
        return {**self.peaks_as_json(), "response_curve": curve}

    def peaks_as_json(self) -> dict[str, object]:
        """Return amplitude, resonance and the largest values over the band."""
        result: dict[str, object] = {"base_amplitude_m_s2": self.base_amplitude_m_s2}
        result["resonance_rad_s"] = self.resonance_rad_s
        result.update({f"peak_{name}": self.peak(name) for name in DISPLAYED})
        return result


@dataclass
class _Measured:
    """RMS values by frequency, so that no frequency is run twice.

    A run starts with the length that the frequency before needed, because neighbouring frequencies need about the same.
    """

    run: Run
    amplitude_m_s2: float
    options: CurveOptions
    known: dict[float, Steady] = field(default_factory=dict)
    cycles: int = 0

    def __call__(self, omega: float) -> FloatArray:
        if omega not in self.known:
            self.known[omega] = steady_values(self.run, self.amplitude_m_s2, omega, self.options, self.cycles)
            self.cycles = self.known[omega].cycles
        return self.known[omega].values


@dataclass(frozen=True)
class Steady:
    """The steady response at one frequency.

    Attributes
    ----------
    values
        In the order of QUANTITIES.
    steady
        Whether they are steady.
    cycles
        Cycles of the shortest run that would have given steady values.
    """

    values: FloatArray
    steady: bool
    cycles: int


def steady_values(
    run: Run, amplitude_m_s2: float, omega: float, options: CurveOptions, first_cycles: int = 0
) -> Steady:
    """Return the steady RMS values at one frequency.

    The run is repeated with twice the length until the RMS values are steady (:func:`settled`). A response that grows
    without bound has infinite values, because an optimiser must be able to compare it.

    Parameters
    ----------
    run
        Runs the loop under an excitation, from rest.
    amplitude_m_s2, omega
        Of the base acceleration [m/s^2], [rad/s].
    options
        Lengths and tolerance.
    first_cycles
        Length of the first run in cycles; the shortest possible where it is less than that.
    """
    window, settling = options.window_cycles, options.settling_cycles
    shortest = settling + 2 * window
    cycles = min(max(first_cycles, shortest), max(options.most_cycles, shortest))
    period = 2.0 * math.pi / omega
    while True:
        excitation = harmonic(amplitude_m_s2, omega, cycles=cycles, settling_cycles=cycles - window)
        try:
            response = run(excitation)
        except DivergedError:
            return Steady(np.full(len(QUANTITIES), math.inf), False, shortest)
        count = (cycles - settling) // window
        edges = period * (cycles - window * np.arange(count, -1, -1, dtype=np.float64))
        windows = values_between(response, edges, options.absolute)
        values = settled(windows, options.tolerance)
        if values is not None:
            # the shortest run whose windows would have been enough
            enough = next(k for k in range(2, count + 1) if settled(windows[:k], options.tolerance) is not None)
            return Steady(values, True, cycles - window * (count - enough))
        if cycles >= options.most_cycles:
            return Steady(np.mean(windows[-max(2, count // 2) :], axis=0), False, cycles)
        cycles = min(2 * cycles, options.most_cycles)


def settled(windows: FloatArray, tolerance: float) -> FloatArray | None:
    """Return the steady values of successive windows, shape (q,), or None while they still change.

    The first columns, those of :data:`DISPLAYED`, decide; the others follow them. Two successive windows that agree
    within the tolerance are steady. Sensor noise makes the windows scatter; then the values are steady once the means
    of the last two groups of windows differ by no more than their scatter explains and the mean of both groups is known
    within the tolerance.

    Parameters
    ----------
    windows
        Values of each window, shape (k, q), k at least 2.
    tolerance
        Relative.
    """
    judged = windows[:, : len(DISPLAYED)]
    last = judged[-1]
    if np.all(np.abs(last - judged[-2]) <= tolerance * np.abs(last)):
        return np.asarray(windows[-1])
    size = len(windows) // 2
    if size < SMALLEST_GROUP:
        return None
    first, second = judged[-2 * size : -size], judged[-size:]
    mean = 0.5 * (first.mean(axis=0) + second.mean(axis=0))
    scatter = np.sqrt(0.5 * (first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)))
    error = scatter / math.sqrt(2.0 * size)
    drift = np.abs(second.mean(axis=0) - first.mean(axis=0))
    # the standard error of the difference of the two means is twice that of the mean of both
    if np.all(drift <= np.maximum(4.0 * error, tolerance * np.abs(mean))) and np.all(error <= tolerance * np.abs(mean)):
        return np.asarray(windows[-2 * size :].mean(axis=0))
    return None


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
    measured = _Measured(run, amplitude_m_s2, options)
    table = np.array([measured(omega) for omega in grid])
    for quantity in options.refined:
        column = QUANTITIES.index(quantity)
        for place in _maxima(table[:, column], options.refined_share):
            _refine(measured, column, grid, place, options)
    omegas = np.array(sorted(measured.known))
    values = np.array([measured.known[float(omega)].values for omega in omegas])
    steady = np.array([measured.known[float(omega)].steady for omega in omegas])
    return ResponseCurve(amplitude_m_s2, omegas, values, steady)


def values_between(response: Response, edges_s: FloatArray, absolute: bool) -> FloatArray:
    """Return the QUANTITIES between successive times, shape (len(edges_s) - 1, len(QUANTITIES)).

    The integral of the square is interpolated at the edges, because a period is not a whole number of samples.
    """
    t = response.time_s
    edges = np.minimum(edges_s, float(t[-1]))
    start = max(int(np.searchsorted(t, edges[0])) - 1, 0)
    clock = t[start:]
    places = np.searchsorted(clock, edges[:-1])
    half_steps = 0.5 * np.diff(clock)

    def rms(history: FloatArray) -> FloatArray:
        square = history[start:] ** 2
        integral = np.concatenate([[0.0], np.cumsum(half_steps * (square[1:] + square[:-1]))])
        return np.sqrt(np.maximum(np.diff(np.interp(edges, clock, integral)) / np.diff(edges), 0.0))

    def largest(history: FloatArray) -> FloatArray:
        return np.asarray(np.maximum.reduceat(np.abs(history[start:]), places))

    accelerations = response.absolute_acceleration if absolute else response.acceleration
    x, stroke, shear = response.displacement, response.damper_displacement, response.base_shear
    drifts = [x[:, 0], *(x[:, floor] - x[:, floor - 1] for floor in range(1, x.shape[1]))]
    histories = (x[:, -1], x[:, 0], accelerations[:, 0], accelerations[:, -1], stroke)
    columns = [rms(history) for history in histories]
    columns += [np.max([rms(drift) for drift in drifts], axis=0), rms(shear), rms(response.drive)]
    columns += [largest(history) for history in histories]
    columns += [np.max([largest(drift) for drift in drifts], axis=0), largest(shear), largest(response.force)]
    return np.column_stack(columns)


def _maxima(values: FloatArray, share: float) -> list[int]:
    """Return the places of local maxima above a share of the largest value; infinite values are not refined."""
    if not np.all(np.isfinite(values)):
        return []
    padded = np.concatenate([[-math.inf], values, [-math.inf]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
    return [int(place) for place in peaks if values[place] >= share * np.max(values)]


def _refine(measured: _Measured, column: int, grid: Sequence[float], place: int, options: CurveOptions) -> None:
    """Search the maximum between the neighbours of a grid point; the values stay in `measured`.

    A parabola through the three points about the maximum gives the next frequency (in logarithms, because the grid has
    equal ratios). Where it repeats the maximum of an interval that is still wide, the search enters the wider side.
    """
    points = [math.log(grid[k]) for k in (place - 1, place, place + 1) if 0 <= k < len(grid)]

    def value(point: float) -> float:
        return float(measured(math.exp(point))[column])

    if len(points) == 2:
        # the largest response is at the edge of the band: look between the edge and its neighbour
        points.insert(1, 0.5 * (points[0] + points[1]))
        if value(points[1]) < max(value(points[0]), value(points[2])):
            return
    low, top, high = points
    for _ in range(options.refinements):
        new = _vertex((low, top, high), (value(low), value(top), value(high)))
        if abs(new - top) < options.frequency_tolerance:
            if high - low < NARROW * options.frequency_tolerance:
                return
            new = top + INTO * (high - top) if high - top > top - low else top - INTO * (top - low)
        if value(new) > value(top):
            low, top, high = (top, new, high) if new > top else (low, new, top)
        else:
            low, high = (new, high) if new < top else (low, new)


def _vertex(x: tuple[float, float, float], y: tuple[float, float, float]) -> float:
    """Return where the parabola through three points has its maximum; the middle point where it has none."""
    left, right = (x[1] - x[0]) * (y[1] - y[2]), (x[1] - x[2]) * (y[1] - y[0])
    bottom = left - right
    if bottom == 0.0:
        return x[1]
    found = x[1] - 0.5 * ((x[1] - x[0]) * left - (x[1] - x[2]) * right) / bottom
    return found if x[0] < found < x[2] else x[1]
