"""Table 5.1 explained: both printed columns, the loop at one frequency, at its resonance, and with other dampers.

The thesis takes its measured values at the "actual resonance frequency of the excited first mode" (end of 5.5.1). The
top acceleration over the top displacement of vd is the frequency squared: 8.1 rad/s in the simulated column and 8.6
rad/s in the measured one. So the simulated column is compared at 8.0 rad/s, and the measured one at the resonance of
each loop.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, load_parameter_set
from mrpipe.control.limits import limiting_modes
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.simulation.resonance import runner
from mrpipe.simulation.response_curve import response_curve
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.steady_state import CurveOptions, steady_values
from mrpipe.simulation.windows import QUANTITIES
from mrpipe.thesis.bench import (
    LAWS,
    OMEGA,
    Bench,
    LoopRun,
    amplitude_of,
    excite,
    perfect,
    reference_rms_top_m,
    run_law,
    with_damper,
)
from mrpipe.thesis.entries import INDICES, printed_columns

CURVE = CurveOptions(
    points=13,
    settling_cycles=8,
    window_cycles=4,
    tolerance=5e-3,
    most_cycles=60,
    frequency_tolerance=2.5e-3,
    refined=("rms_x_top_m",),
)
"""How the response curves of the ledger are measured: half a per cent is enough for numbers of two digits. The
frequency of a resonance is found more accurately, because accelerations depend on it where displacements do not."""

BAND = (0.9, 1.02)
"""Band of the search: over the free frequency, and over the frequency with a locked damper."""

_ROWS = {
    "rms_x5_m": "rms_x_top_m",
    "rms_x1_m": "rms_x1_m",
    "rms_a5_m_s2": "rms_a_top_m_s2",
    "rms_a1_m_s2": "rms_a1_m_s2",
}
_AMPLITUDE_TOLERANCE = 0.01

AT_ONE = f"{OMEGA:g} rad/s"
AT_VD = "resonance of vd"
AT_OWN = "resonance of each loop"


@dataclass(frozen=True)
class Reading:
    """Free-decay damping of one law, three readings.

    Attributes
    ----------
    fit
        Exponential fit over the extrema with current (thesis 5.5.1); None where there is none.
    first_half_period
        Damping ratio from the first extremum after the base stops to the next; None where there is none.
    energy
        Damping ratio by the stored energy over the first period.
    extrema_m
        Extrema of the top displacement.
    """

    fit: float | None
    first_half_period: float | None
    energy: float | None
    extrema_m: tuple[float, ...]


@dataclass(frozen=True)
class Case:
    """All laws under one base amplitude.

    Attributes
    ----------
    damper
        Which damper is in the loop, in words.
    where
        :data:`AT_ONE`, :data:`AT_VD` or :data:`AT_OWN`.
    base_amplitude_m_s2
        Such that vd has the printed top displacement.
    omega
        Law -> frequency of its values [rad/s].
    values
        Law -> index (the rows of Table 5.1 without the damping ratio) -> value.
    damping
        Law -> its readings.
    """

    damper: str
    where: str
    base_amplitude_m_s2: float
    omega: Mapping[str, float]
    values: Mapping[str, Mapping[str, float]]
    damping: Mapping[str, Reading]

    @property
    def name(self) -> str:
        """Name of the case: damper and excitation in words."""
        return f"{self.damper}, {self.where}"


def reading_of(run: LoopRun) -> Reading:
    """Return the damping readings of a run that ends in a free decay."""
    found = run.indices
    series = found["damping_ratio_point_to_point"]
    response, start = run.response, run.excitation.decay_from_s
    after = response.time_s >= start - math.pi / run.excitation.frequency_rad_s
    x, v = response.displacement[after, -1], response.velocity[after, -1]
    turns = np.flatnonzero(v[:-1] * v[1:] < 0.0)
    return Reading(
        found["damping_ratio"],
        float(series[0]) if len(series) else None,
        found["damping_ratio_by_energy"],
        tuple(float(value) for value in x[turns[:6]]),
    )


def at_one_frequency(rig: Rig, damper: str, seed: int) -> Case:
    """Return all laws at 8.0 rad/s, at the amplitude at which vd has the printed top displacement."""
    amplitude = amplitude_of(rig, reference_rms_top_m())
    runs = {law: run_law(rig, law, excite(amplitude), seed) for law in LAWS}
    values = {law: {row: float(run.indices[row]) for row in INDICES} for law, run in runs.items()}
    readings = {law: reading_of(run) for law, run in runs.items()}
    return Case(damper, AT_ONE, amplitude, dict.fromkeys(LAWS, OMEGA), values, readings)


def band_of(rig: Rig) -> tuple[float, float]:
    """Return the band in which resonances are searched [rad/s]."""
    modes = limiting_modes(rig.frame, rig.position)
    return BAND[0] * modes.omega_0, BAND[1] * modes.omega_inf


def _amplitude_at_resonance(rig: Rig, seed: int) -> float:
    """Return the base amplitude at which the largest rms top displacement of vd over frequency is the printed one."""
    run = runner(rig, rig.controller("vd"), np.random.default_rng(seed))
    wanted = reference_rms_top_m()

    def peak(amplitude: float) -> float:
        return response_curve(run, amplitude, band_of(rig), CURVE).peak("rms_x_top_m")

    # the response grows faster than the amplitude, because friction limits it: secant in the logarithms
    levels = [math.log(amplitude_of(rig, 0.8 * wanted))]
    peaks = [math.log(peak(math.exp(levels[0])) / wanted)]
    slope = 1.5
    for _ in range(6):
        if abs(peaks[-1]) < _AMPLITUDE_TOLERANCE:
            break
        levels.append(levels[-1] - peaks[-1] / slope)
        peaks.append(math.log(peak(math.exp(levels[-1])) / wanted))
        step = levels[-1] - levels[-2]
        slope = min(max((peaks[-1] - peaks[-2]) / step, 0.5), 5.0) if step else slope
    return math.exp(levels[int(np.argmin(np.abs(peaks)))])


def at_resonance(rig: Rig, damper: str, seed: int, progress: Progress) -> tuple[Case, Case]:
    """Return all laws at the resonance of vd, and at the resonance of each loop.

    The base amplitude is one: that at which vd has the printed top displacement at its resonance.
    """
    amplitude = _amplitude_at_resonance(rig, seed)
    resonances: dict[str, float] = {}
    own: dict[str, dict[str, float]] = {}
    common: dict[str, dict[str, float]] = {}
    for number, law in enumerate(LAWS):
        progress(number / len(LAWS), f"resonance of {law}, {damper}")
        run = runner(rig, rig.controller(law), np.random.default_rng(seed))
        curve = response_curve(run, amplitude, band_of(rig), CURVE)
        resonances[law] = curve.resonance_rad_s
        own[law] = _row_values(curve.values[int(np.argmax(curve.column("rms_x_top_m")))])
        common[law] = _row_values(steady_values(run, amplitude, resonances["vd"], CURVE).values)

    def readings(omegas: Mapping[str, float]) -> dict[str, Reading]:
        return {law: reading_of(run_law(rig, law, excite(amplitude, omegas[law]), seed)) for law in LAWS}

    at_vd = dict.fromkeys(LAWS, resonances["vd"])
    return (
        Case(damper, AT_VD, amplitude, at_vd, common, readings(at_vd)),
        Case(damper, AT_OWN, amplitude, resonances, own, readings(resonances)),
    )


def _row_values(values: FloatArray) -> dict[str, float]:
    return {row: float(values[QUANTITIES.index(name)]) for row, name in _ROWS.items()}


PLAIN, TRACED, PRINTED_DAMPER, PERFECT = (
    "identified damper",
    "damper with traced effects",
    "damper of Table 2.2 as printed",
    "perfect damper",
)


def explain(bench: Bench, progress: Progress) -> dict[str, Case]:
    """Return the cases by name.

    Parameters
    ----------
    bench
        Structure, damper and controllers of a run, or of the parameter sets. Without a traced damper the cases with
        its effects are missing.
    progress
        Receives the share that is done.
    """
    rig, seed = bench.rig, bench.seed
    printed = damper_from_parameter_set(load_parameter_set("dampers", "thesis-printed"))
    progress(0.0, f"closed loop at {AT_ONE}")
    cases = [
        at_one_frequency(perfect(rig), PERFECT, seed),
        at_one_frequency(with_damper(rig, printed), PRINTED_DAMPER, seed),
        at_one_frequency(rig, PLAIN, seed),
    ]
    share = 0.5 if bench.traced is not None else 1.0
    cases += at_resonance(rig, PLAIN, seed, lambda part, text="": progress(share * part, text))
    if bench.traced is not None:
        cases.append(at_one_frequency(bench.traced, TRACED, seed))
        cases += at_resonance(bench.traced, TRACED, seed, lambda part, text="": progress(0.5 + 0.5 * part, text))
    return {case.name: case for case in cases}


def log_errors(case: Case, part: str) -> dict[str, dict[str, float]]:
    """Return law -> index -> |ln(value / printed)| against a column of Table 5.1, without the number that is given.

    Parameters
    ----------
    case
        Compared with the printed numbers.
    part
        `T5.1s` (simulated) or `T5.1m` (measured).
    """
    printed = printed_columns("Table 5.1", part)
    return {
        law: {
            row: abs(math.log(case.values[law][row] / printed[law][row]))
            for row in INDICES
            if (law, row) != ("vd", "rms_x5_m")
        }
        for law in LAWS
    }


def mean_log_error(case: Case, part: str) -> float:
    """Return the mean of :func:`log_errors` over its 15 numbers."""
    return float(np.mean([value for rows in log_errors(case, part).values() for value in rows.values()]))


def peak_over_frequency(bench: Bench, law: str, gain: str, values: tuple[float, ...], amplitude: float) -> list[float]:
    """Return the largest rms top displacement over frequency [m] for several values of one gain.

    Parameters
    ----------
    bench, law, gain
        Which loop, and which of its gains.
    values
        Values of the gain.
    amplitude
        Amplitude of the base acceleration [m/s^2].
    """
    rig = bench.rig
    column = QUANTITIES.index("rms_x_top_m")
    grid = np.geomspace(*band_of(rig), CURVE.points)
    found = []
    for value in values:
        gains = rig.controllers.calibrated.gains_of(law).changed(**{gain: value})
        run = runner(rig, rig.controller(law, gains), np.random.default_rng(bench.seed))
        found.append(max(float(steady_values(run, amplitude, float(omega), CURVE).values[column]) for omega in grid))
    return found
