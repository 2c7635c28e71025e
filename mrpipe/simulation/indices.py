"""Indices of a response: RMS values, peaks, damping of the decay, tracking, energy, effort (section 5.5)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.control.kernel import COMMAND_CLIPPED, COMMAND_FAULT, COMMAND_SWITCHED
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import Response

SMALLEST_PEAK = 0.02
"""Peaks of a decay below this share of the first are left out."""

FLOWING = 0.05
"""Share of the drive limit above which current counts as flowing."""

QUICK = 0.55
"""If the damping of the extrema after the stop is below this share of that of the first half period, the decay was over
within one period. The later motion is then a vibration about the position at which the damper sticks, and the damping
of the first half period is used.
"""

LEAST_ENERGY = 0.02
"""Below this share of the energy the motion no longer counts as a decay."""

SMALLEST_FITTED_PEAK = 0.15
"""Peaks below this share of the first one are not fitted, because residual force or a locked damper determines them."""


@dataclass(frozen=True)
class Decay:
    """Damping of a free decay from the extrema of the top displacement.

    Attributes
    ----------
    mean
        Damping ratio of the exponential fit over the peaks after the base stopped, as long as current flows before each
        and they are not small (thesis 5.5.1); of the first half period where the decay is quick (QUICK); NaN with fewer
        than two extrema.
    point_to_point
        Damping ratio from each extremum to the next, shape (p - 1,).
    peak_time_s, peak_m
        Extrema, shape (p,).
    """

    mean: float
    point_to_point: FloatArray
    peak_time_s: FloatArray
    peak_m: FloatArray


def decay_damping(response: Response, start_s: float, drive_threshold: float) -> Decay:
    """Return the damping of the decay after `start_s` [s].

    Parameters
    ----------
    response
        Response of a run with a decay.
    start_s
        When the base stops.
    drive_threshold
        Drive above which current counts as flowing; if it never flows (passive-off), all peaks count.
    """
    t, x, v = response.time_s, response.displacement[:, response.top], response.velocity[:, response.top]
    turns = np.flatnonzero(v[:-1] * v[1:] < 0.0)
    # the decay starts from the extremum nearest to the stop, because a quick decay has few others
    if len(turns):
        turns = turns[int(np.argmin(np.abs(t[turns] - start_s))) :]
    drive = response.drive
    if len(turns):
        turns = turns[np.abs(x[turns]) > SMALLEST_PEAK * np.max(np.abs(x[turns]))]
    # a wiggle of a higher mode is not a half period: an extremum counts when the displacement changes sign between
    keep: list[int] = []
    for turn in turns:
        if keep and x[turn] * x[keep[-1]] > 0.0:
            if abs(x[turn]) > abs(x[keep[-1]]):
                keep[-1] = int(turn)
            continue
        keep.append(int(turn))
    peaks = np.array(keep, dtype=np.int64)
    if len(peaks) < 2:
        empty = np.zeros(0)
        return Decay(math.nan, empty, t[peaks], x[peaks])
    flows = np.ones(len(peaks), dtype=bool)
    for index in range(1, len(peaks)):
        flows[index] = np.max(drive[peaks[index - 1] : peaks[index] + 1]) > drive_threshold
    sizes = np.log(np.abs(x[peaks]))
    ratios = _ratio(sizes[:-1] - sizes[1:])
    large = np.abs(x[peaks]) >= SMALLEST_FITTED_PEAK * np.abs(x[peaks[0]])
    ends = np.flatnonzero(~(large & (flows if flows[1:].any() else large)))
    used = np.arange(1, max(int(ends[0]) if len(ends) else len(peaks), 3))
    if len(peaks) > 2:
        slope = np.polyfit(used, sizes[used], 1)[0]
        mean = float(_ratio(np.array([-slope]))[0])
        mean = mean if mean >= QUICK * ratios[0] else float(ratios[0])
    else:
        mean = float(ratios[0])
    return Decay(mean, ratios, t[peaks], x[peaks])


def energy_damping(response: Response, start_s: float, omega: float) -> float:
    """Return the damping ratio from the decrease of the stored energy in the first period after `start_s` [s].

    ln(E0/E1)/(2 omega T) over a whole period, because energy is dissipated twice per period and not uniformly; over
    half a period if less than 2 % of the energy remains then. It is used for decays that are over before there is a
    second extremum.

    Parameters
    ----------
    response
        Response of a run with a decay.
    start_s
        When the base stops.
    omega
        Angular frequency of the mode [rad/s].
    """
    half = math.pi / omega
    at = np.interp(start_s + half * np.arange(3), response.time_s, response.energy)
    for periods in (2, 1):
        if at[0] > 0.0 and (at[periods] > LEAST_ENERGY * at[0] or periods == 1):
            left = max(float(at[periods] / at[0]), 1e-12)
            return float(-math.log(left) / (2.0 * math.pi * periods))
    return math.nan


def _damping(response: Response, excitation: Excitation, drive_threshold: float) -> dict[str, Any]:
    """Return the damping ratio of the decay, from the energy if there is no other, and the interval of estimates."""
    decay = decay_damping(response, excitation.decay_from_s, drive_threshold)
    omega = excitation.frequency_rad_s
    energy = energy_damping(response, excitation.decay_from_s, omega) if math.isfinite(omega) else math.nan
    first = float(decay.point_to_point[0]) if len(decay.point_to_point) else math.nan
    readings = [value for value in (decay.mean, first, energy) if math.isfinite(value)]
    ratio = decay.mean if math.isfinite(decay.mean) else energy
    return {
        "damping_ratio": ratio if math.isfinite(ratio) else None,
        "damping_ratio_by_energy": energy if math.isfinite(energy) else None,
        "damping_ratio_interval": [min(readings), max(readings)] if readings else None,
        "damping_ratio_point_to_point": [float(value) for value in decay.point_to_point[:12]],
    }


def _ratio(decrement: FloatArray) -> FloatArray:
    """Return damping ratios from logarithmic decrements over half a period."""
    return np.asarray(decrement / np.sqrt(np.pi**2 + decrement**2))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan


def _peak(values: FloatArray) -> float:
    return float(np.max(np.abs(values))) if len(values) else math.nan


def _floors(columns: list[int]) -> dict[str, int]:
    """Return label -> column of the listed floors: the first, the fifth if there is one, and the top."""
    return {"1": columns[0], **({"5": columns[4]} if len(columns) >= 5 else {}), "_top": columns[-1]}


def indices(
    response: Response, excitation: Excitation, *, residual_force_n: float, drive_limit: float
) -> dict[str, Any]:
    """Return the indices of a response, with units in the keys; None if an index is not defined.

    Accelerations are relative to the ground unless the key says `absolute`. The fifth floor is left out where there is
    none.

    Parameters
    ----------
    response, excitation
        Response and excitation of the run.
    residual_force_n
        Force of the damper model at zero drive [N], used if the drive is never zero in the run.
    drive_limit
        Largest drive of the damper.
    """
    first, last = excitation.steady_s
    steady = (response.time_s >= first) & (response.time_s < last) if last > first else response.time_s >= 0.0
    result: dict[str, Any] = {}
    for label, floor in _floors(response.columns).items():
        x, a = response.displacement[steady, floor], response.acceleration[steady, floor]
        result |= {
            f"rms_x{label}_m": _rms(x),
            f"rms_a{label}_m_s2": _rms(a),
            f"rms_a{label}_absolute_m_s2": _rms(response.absolute_acceleration[steady, floor]),
            f"peak_x{label}_m": _peak(x),
            f"peak_a{label}_m_s2": _peak(a),
        }
    result |= {
        "rms_damper_displacement_m": _rms(response.damper_displacement[steady]),
        "rms_force_n": _rms(response.force[steady]),
    }
    if math.isfinite(excitation.decay_from_s):
        result |= _damping(response, excitation, FLOWING * drive_limit)
    else:
        result["damping_ratio"] = None
    result |= _tracking(response, steady, residual_force_n, drive_limit)
    result |= _energy(response, steady, excitation)
    samples = (response.command_time_s >= first) & (response.command_time_s < last)
    commands = response.commands[samples] if samples.any() else response.commands
    result |= {
        "clipped_share": float(np.mean(commands[:, COMMAND_CLIPPED])),
        "faulty_share": float(np.mean(commands[:, COMMAND_FAULT] > 0.0)),
        "switched_off_share": float(np.mean(commands[:, COMMAND_SWITCHED])),
        "saturated_share": float(np.mean(response.drive[steady] > 0.99 * drive_limit)),
        "rms_drive": _rms(response.drive[steady]),
        "mean_drive": float(np.mean(response.drive[steady])),
        "energy_balance_error": response.energy_balance_error,
        "real_time_factor": response.real_time_factor,
    }
    return result


def _tracking(response: Response, steady: BoolArray, residual: float, drive_limit: float) -> dict[str, Any]:
    """Return tracking errors, all over the rms desired force, by regime."""
    wanted, force = response.desired_force[steady], response.force[steady]
    drive, velocity = response.drive[steady], response.damper_velocity[steady]
    size = _rms(wanted)
    error = force - wanted
    off = drive < 0.01 * drive_limit
    moving = np.abs(velocity) > 0.3 * np.max(np.abs(velocity)) if len(velocity) else off
    shown = np.abs(force[off & moving])
    result: dict[str, Any] = {
        "force_tracking_nrmse": _rms(error) / size if size > 0.0 else None,
        "residual_force_n": float(np.median(shown)) if len(shown) > 20 else residual,
    }
    if size > 0.0:
        below = np.abs(wanted) < residual
        saturated = drive > 0.99 * drive_limit
        regimes = {
            "clipped": wanted == 0.0,
            "below_residual": below & (wanted != 0.0),
            "tracked": ~below & ~saturated,
            "saturated": saturated,
        }
        result["force_tracking_by_regime"] = {
            name: {"share": float(np.mean(where)), "nrmse": _rms(error[where]) / size if where.any() else None}
            for name, where in regimes.items()
        }
    return result


def _energy(response: Response, steady: BoolArray, excitation: Excitation) -> dict[str, Any]:
    """Return energies over the steady part, a cycle where the excitation is harmonic."""
    places = np.flatnonzero(steady)
    damper = float(response.work_damper[places[-1]] - response.work_damper[places[0]])
    frame = float(response.work_frame[places[-1]] - response.work_frame[places[0]])
    result = {"energy_damper_j": damper, "energy_frame_j": frame}
    if math.isfinite(excitation.frequency_rad_s):
        seconds = response.time_s[places[-1]] - response.time_s[places[0]]
        cycles = seconds * excitation.frequency_rad_s / (2.0 * math.pi)
        result |= {"energy_damper_per_cycle_j": damper / cycles, "energy_frame_per_cycle_j": frame / cycles}
    return result


def places_table(response: Response, names: Sequence[str], excitation: Excitation) -> list[dict[str, Any]]:
    """Return one row of RMS values and peaks for each degree of freedom; for rotations in rad and rad/s^2.

    Parameters
    ----------
    response, excitation
        Response and excitation of the run; RMS values are taken where the response is steady.
    names
        Names of the degrees of freedom.
    """
    first, last = excitation.steady_s
    steady = (response.time_s >= first) & (response.time_s <= last)
    return [
        {
            "name": name,
            "rms_displacement_m": _rms(response.displacement[steady, column]),
            "peak_displacement_m": _peak(response.displacement[steady, column]),
            "rms_absolute_acceleration_m_s2": _rms(response.absolute_acceleration[steady, column]),
            "peak_absolute_acceleration_m_s2": _peak(response.absolute_acceleration[steady, column]),
        }
        for column, name in enumerate(names)
    ]
