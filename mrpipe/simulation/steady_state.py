"""The steady response of the closed loop at one frequency of harmonic base motion.

Most loops become periodic, and a few windows of whole cycles give their values. A loop that switches its damper can
have a permanently irregular response. Its values are means over a run, whose accuracy depends on the length of the run.
If a value is needed with a given accuracy, :class:`SteadyResponses` averages over further runs until its standard error
is small enough.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from joblib import Parallel, delayed

from mrpipe.artifacts import FloatArray
from mrpipe.errors import DivergedError
from mrpipe.simulation.excitation import Excitation, harmonic
from mrpipe.simulation.loop import Response
from mrpipe.simulation.settings import ResonanceSettings
from mrpipe.simulation.windows import QUANTITIES, mean_values, settled, standard_errors, values_between

Run = Callable[[Excitation], Response]

_SETTINGS = ResonanceSettings()
"""The defaults that the options share with the settings."""

FURTHER_RUN = (4, 54)
"""Fewest and most windows of a further run; the histories of a longer one would need too much memory."""

FEWEST_RUNS = 8
"""Fewest further runs of an irregular response. Such a response can stay near one motion for hundreds of cycles before
it changes to another, so that the scatter within a run can be small although the means of several runs differ.
"""

PHASE_STEP = 2.0 * math.pi * (0.5 * math.sqrt(5.0) - 0.5)
"""Each further run begins at another phase of the base motion, this angle later than the run before, so that irregular
motions are independent. The golden section spreads any number of phases evenly."""


@dataclass(frozen=True)
class CurveOptions:
    """Options of the measurement of a response curve.

    Attributes
    ----------
    points
        Number of frequencies of the grid, which have equal ratios.
    settling_cycles
        Cycles before the first comparison of windows.
    window_cycles
        Cycles over which an RMS value is taken.
    tolerance
        Relative change of the RMS values from one window to the next that counts as steady.
    most_cycles
        Longest run. A response that is not steady by then has the mean over the second half of its windows.
    frequency_tolerance
        Relative accuracy of the refined resonance frequencies.
    refinements
        Largest number of frequencies that refine one maximum.
    flatness
        A maximum is refined until its neighbours are lower by no more than this share, because a maximum can be a kink.
    refined
        Quantities whose maxima are refined.
    refined_share
        Local maxima of the grid above this share of the largest value are refined.
    absolute
        Whether accelerations are absolute; else relative to the ground.
    standard_error
        Relative standard error to which the largest values are measured; infinite: every value comes from one run.
    most_averaged_cycles
        Largest number of cycles over which one value is averaged.
    """

    points: int = _SETTINGS.points
    settling_cycles: int = 10
    window_cycles: int = _SETTINGS.window_cycles
    tolerance: float = _SETTINGS.tolerance
    most_cycles: int = _SETTINGS.most_cycles
    frequency_tolerance: float = 2e-3
    refinements: int = 8
    flatness: float = math.inf
    refined: tuple[str, ...] = ("rms_x_top_m", "rms_a_top_m_s2", "rms_a1_m_s2")
    refined_share: float = 0.9
    absolute: bool = False
    standard_error: float = math.inf
    most_averaged_cycles: int = _SETTINGS.most_averaged_cycles


@dataclass(frozen=True)
class Steady:
    """The steady response at one frequency.

    Attributes
    ----------
    values
        Values in the order of QUANTITIES.
    errors
        Standard errors of the values. For two windows that agree it is half of their difference.
    steady
        Whether the values became steady within the longest run.
    cycles
        Cycles of the shortest run that would have given steady values.
    scatter
        Relative standard deviation from window to window, shape (q,); None where two windows agreed.
    further
        Values of each window of the further runs, shape (k, q) each; if there are any, their mean is the value.
    """

    values: FloatArray
    errors: FloatArray
    steady: bool
    cycles: int
    scatter: FloatArray | None = None
    further: tuple[FloatArray, ...] = ()


def steady_values(
    run: Run,
    amplitude_m_s2: float,
    omega: float,
    options: CurveOptions,
    first_cycles: int = 0,
    *,
    phase_rad: float = 0.0,
) -> Steady:
    """Return the steady RMS values at one frequency.

    The run is repeated with twice the length until the RMS values are steady
    (:func:`~mrpipe.simulation.windows.settled`). A response that grows without bound has infinite values, because an
    optimiser must be able to compare it.

    Parameters
    ----------
    run
        Runs the loop under an excitation, from rest.
    amplitude_m_s2, omega
        Amplitude and angular frequency of the base acceleration [m/s^2], [rad/s].
    options
        Lengths and tolerance.
    first_cycles
        Length of the first run in cycles; the shortest possible where it is less than that.
    phase_rad
        Phase of the base motion at the start [rad].
    """
    window, settling = options.window_cycles, options.settling_cycles
    shortest = settling + 2 * window
    cycles = min(max(first_cycles, shortest), max(options.most_cycles, shortest))
    period = 2.0 * math.pi / omega
    while True:
        excitation = harmonic(
            amplitude_m_s2, omega, cycles=cycles, settling_cycles=cycles - window, phase_rad=phase_rad
        )
        try:
            response = run(excitation)
        except DivergedError:
            return _unbounded(shortest)
        count = (cycles - settling) // window
        edges = period * (cycles - window * np.arange(count, -1, -1, dtype=np.float64))
        windows = values_between(response, edges, options.absolute)
        length = settled(windows, options.tolerance)
        if length:
            # the shortest run with a sufficient number of windows
            enough = next(k for k in range(2, count + 1) if settled(windows[:k], options.tolerance))
            return _steady(windows, length, True, cycles - window * (count - enough))
        if cycles >= options.most_cycles:
            return _steady(windows, max(2, count // 2), False, cycles)
        cycles = min(2 * cycles, options.most_cycles)


def _unbounded(cycles: int) -> Steady:
    values = np.full(len(QUANTITIES), math.inf)
    return Steady(values, np.zeros(len(QUANTITIES)), False, cycles)


def _steady(windows: FloatArray, length: int, steady: bool, cycles: int) -> Steady:
    """Return the values of the last windows."""
    counted = windows[-length:]
    values = mean_values(counted)
    errors = standard_errors(windows[-max(length, 2) :])
    return Steady(values, errors, steady, cycles, None if length == 1 else _scatter(counted, values))


def _scatter(windows: FloatArray, values: FloatArray) -> FloatArray:
    spread = np.std(windows, axis=0, ddof=1)
    return np.asarray(np.divide(spread, values, out=np.zeros_like(spread), where=values > 0.0))


@dataclass
class SteadyResponses:
    """Steady responses by frequency, so that no frequency is run twice.

    A run starts with the length that the frequency before needed, because neighbouring frequencies need about the same.

    Attributes
    ----------
    run
        Runs the loop under an excitation, from rest.
    amplitude_m_s2
        Amplitude of the base acceleration [m/s^2].
    options
        Lengths and accuracy.
    known
        Frequency [rad/s] -> its response.
    jobs
        Threads for further runs.
    """

    run: Run
    amplitude_m_s2: float
    options: CurveOptions
    known: dict[float, Steady] = field(default_factory=dict)
    jobs: int = 1
    _cycles: int = 0

    def __call__(self, omega: float) -> FloatArray:
        """Return the values at a frequency, shape (q,)."""
        if omega not in self.known:
            self.known[omega] = steady_values(self.run, self.amplitude_m_s2, omega, self.options, self._cycles)
            self._cycles = self.known[omega].cycles
        return self.known[omega].values

    def errors(self, omega: float) -> FloatArray:
        """Return the standard errors of the values at a known frequency, shape (q,).

        Two windows of an irregular response can agree by chance. Where windows scatter at other frequencies, a value
        that rests on the agreement of two windows has at least the error of a single window of that scatter.
        """
        found = self.known[omega]
        others = [item.scatter for item in self.known.values() if item.scatter is not None]
        if found.scatter is not None or not others:
            return found.errors
        return np.maximum(found.errors, np.median(others, axis=0) * found.values)

    def accurate(self, omega: float, column: int, error: float, most_cycles: int) -> float:
        """Return the value of one quantity, averaged over further runs until its standard error is small enough.

        The first run does not enter the mean of the further ones. It was used to select the value, and a value that was
        selected because it is large is on average too large.

        Parameters
        ----------
        omega
            Frequency [rad/s].
        column
            Column of the quantity.
        error
            Largest relative standard error.
        most_cycles
            Most cycles of further runs. An irregular response is not averaged where they are too few for the fewest
            runs that it needs.
        """
        value = float(self(omega)[column])
        most = most_cycles // self.options.window_cycles
        while math.isfinite(value) and math.isfinite(error):
            steady, runs = self.known[omega].steady, self.known[omega].further
            share = float(self.errors(omega)[column]) / (error * value) if value > 0.0 else 0.0
            done = sum(map(len, runs))
            fewest = FURTHER_RUN[0] * (1 if steady else FEWEST_RUNS)
            if done >= most or fewest > most or (share <= 1.0 and (steady or len(runs) >= FEWEST_RUNS)):
                break
            self._average(omega, min(max(math.ceil(done * min(max(share**2, 1.0), 2.0)), done + 1, fewest), most))
            value = float(self.known[omega].values[column])
        return value

    def _average(self, omega: float, wanted: int) -> None:
        """Run until there are that many windows of further runs, and put their mean in the place of the value."""
        options, first = self.options, self.known[omega]
        parts = list(first.further)
        settling = first.cycles if first.steady else max(options.settling_cycles, options.most_cycles // 2)
        counts: list[int] = []
        while (missing := wanted - sum(map(len, parts)) - sum(counts)) > 0:
            shared = 1 if first.steady else max(FEWEST_RUNS - len(parts) - len(counts), 1)
            counts.append(min(max(math.ceil(missing / shared), FURTHER_RUN[0]), FURTHER_RUN[1]))
        runs = (self._windows(omega, settling, count, len(parts) + place) for place, count in enumerate(counts))
        runner = Parallel(n_jobs=self.jobs, backend="threading")
        found = runner(delayed(run)() for run in runs) if self.jobs > 1 else [run() for run in runs]
        parts += [windows for windows in found if windows is not None]
        if any(windows is None for windows in found):
            self.known[omega] = _unbounded(first.cycles)
            return
        windows = np.vstack(parts)
        values = mean_values(windows)
        errors = standard_errors(*parts)
        self.known[omega] = Steady(values, errors, first.steady, first.cycles, _scatter(windows, values), tuple(parts))

    def _windows(self, omega: float, settling: int, count: int, number: int) -> Callable[[], FloatArray | None]:
        """Return the further run of that number; it gives the values of its windows, None if it grows without bound."""
        options, cycles = self.options, settling + count * self.options.window_cycles
        phase = PHASE_STEP * (1 + number) % (2.0 * math.pi)

        def run() -> FloatArray | None:
            excitation = harmonic(self.amplitude_m_s2, omega, cycles=cycles, settling_cycles=settling, phase_rad=phase)
            try:
                response = self.run(excitation)
            except DivergedError:
                return None
            edges = 2.0 * math.pi / omega * (settling + options.window_cycles * np.arange(count + 1, dtype=np.float64))
            return values_between(response, edges, options.absolute)

        return run
