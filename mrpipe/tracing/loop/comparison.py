"""The damper with its effects in the closed loop: predicted and measured response, and ranking of the laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns import Campaign
from mrpipe.control.controller import Controller
from mrpipe.dampers.plant import Chain
from mrpipe.errors import DivergedError
from mrpipe.signals.error_size import nrmse
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import LoopOptions, simulate_law
from mrpipe.structures import Frame
from mrpipe.tracing.rules import LoopRules

ENERGY = (0.005, 0.05, 0.5, 0.98)
"""Numerical technique: shares of the energy of the base motion at which a transient motion starts, from which its
growth is compared, at which a steady motion has settled, and at which the motion ends.
"""


@dataclass(frozen=True)
class LoopRun:
    """A closed-loop test: recorded, or the same base motion under a law that was not recorded.

    Attributes
    ----------
    name, law
        Test and control law.
    gains
        Gains that campaign.yaml states; empty if there are none.
    time_s
        Shape (m,).
    ground_acceleration
        Shape (m,) [m/s^2].
    displacement
        Displacement of the measured floors relative to the ground, lowest first, shape (m, p) [m]; empty if the run was
        not recorded.
    absolute_acceleration
        Acceleration of the measured floors, lowest first, shape (m, q) [m/s^2]; empty if not recorded.
    damper_force
        Shape (m,) [N]; empty if not recorded.
    displacement_of, acceleration_of
        Degrees of freedom of the frame for the columns of displacement and acceleration, length p and q.
    """

    name: str
    law: str
    gains: Mapping[str, float]
    time_s: FloatArray
    ground_acceleration: FloatArray
    displacement: FloatArray
    absolute_acceleration: FloatArray
    damper_force: FloatArray
    displacement_of: tuple[int, ...] = ()
    acceleration_of: tuple[int, ...] = ()

    @property
    def relative_acceleration(self) -> FloatArray:
        """Accelerations of the floors relative to the ground, shape (m, q) [m/s^2]; empty if not recorded."""
        absolute = self.absolute_acceleration
        return absolute - self.ground_acceleration[:, None] if absolute.size else absolute

    @property
    def recorded(self) -> bool:
        """Whether a measured response exists."""
        return bool(self.displacement.size)


@dataclass(frozen=True)
class Arrangement:
    """One way in which the loop runs: the damper, and the function that returns the controller of a run."""

    chain: Chain
    controller: Callable[[LoopRun], Controller]


def measured_runs(campaign: Campaign, frame: Frame) -> list[LoopRun]:
    """Return the closed-loop recordings of a frame campaign that state their law and record a floor of the frame."""
    runs = []
    for item in campaign.recordings:
        law = str(item.details.get("law", ""))
        if item.kind != "closed-loop" or not law or "ground_acceleration" not in item.channels:
            continue
        displacement, displacement_of = _floors(item.channels, "floor_displacement_", frame)
        if not displacement_of:
            continue
        acceleration, acceleration_of = _floors(item.channels, "floor_acceleration_", frame)
        given = item.details.get("gains") or {}
        runs.append(
            LoopRun(
                item.name,
                law,
                {str(name): float(value) for name, value in given.items()},
                item.time_s - item.time_s[0],
                item.channels["ground_acceleration"] - np.mean(item.channels["ground_acceleration"]),
                displacement,
                acceleration,
                item.channels.get("damper_force", np.zeros(0)),
                displacement_of,
                acceleration_of,
            )
        )
    return runs


def _floors(channels: Mapping[str, FloatArray], stem: str, frame: Frame) -> tuple[FloatArray, tuple[int, ...]]:
    """Return the channels that moved floors of the frame, lowest first, shape (m, p), and their degrees of freedom.

    Rotations and other directions than that of the ground motion are left out, because the results are in metres and
    name a first and a top floor.
    """
    places = {
        place: values
        for name, values in channels.items()
        if name.startswith(stem) and (place := frame.place_of(name.removeprefix(stem))) in frame.moved_by_ground
    }
    order = tuple(sorted(place for place in places if place is not None))
    return (np.column_stack([places[place] for place in order]) if order else np.zeros((0, 0))), order


def with_unrecorded(runs: Sequence[LoopRun], laws: Sequence[str]) -> list[LoopRun]:
    """Return the recordings; a law without recordings gets the base motions of the first law with recordings."""
    there = {run.law for run in runs}
    first = [run for run in runs if run.law == runs[0].law]
    empty = np.zeros((0, 0))
    added = [
        replace(
            run, name=f"{law}, as {run.name}", law=law, gains={}, displacement=empty, absolute_acceleration=empty,
            damper_force=np.zeros(0),
        )
        for law in laws
        if law not in there
        for run in first
    ]  # fmt: skip
    return [*runs, *added]


def simulated_runs(excitation: Excitation, laws: Sequence[str], rate_hz: float = 1000.0) -> list[LoopRun]:
    """Return runs of every law under one excitation, none of them recorded."""
    time = np.arange(round(excitation.duration_s * rate_hz) + 1) / rate_hz
    ground, empty = excitation.at(time), np.zeros((0, 0))
    return [LoopRun(law, law, {}, time, ground, empty, empty, np.zeros(0)) for law in laws]


def judged_span(time: FloatArray, ground: FloatArray, steady: float = LoopRules().steady) -> tuple[float, float]:
    """Return start and end [s] of the time that is judged: the second half of a steady motion, else the whole motion.

    Parameters
    ----------
    time, ground
        Time [s] and ground acceleration [m/s^2], shape (m,).
    steady
        Largest deviation of the energy from linear growth, as a share, with which a motion counts as steady.
    """
    energy = np.cumsum(ground**2)
    if energy[-1] <= 0.0:
        return float(time[0]), float(time[-1])
    share = energy / energy[-1]
    first, half, last = (float(time[np.searchsorted(share, level)]) for level in ENERGY[1:])
    inside = (time >= first) & (time <= last)
    straight = np.interp(time[inside], [first, last], [ENERGY[1], ENERGY[3]])
    if float(np.max(np.abs(share[inside] - straight))) < steady:
        return half, last
    return float(time[np.searchsorted(share, ENERGY[0])]), last


@dataclass(frozen=True)
class Bench:
    """Structure, sensors and rules of the simulations.

    Attributes
    ----------
    frame, position
        Structure and connectivity vector w, shape (n,).
    options
        Options of the simulation of the loop.
    seed
        Seed of the sensors' noise, the same for every arrangement and law.
    tested_stroke_m
        Largest displacement at which the damper was tested [m].
    rules
        Decision thresholds.
    """

    frame: Frame
    position: FloatArray
    options: LoopOptions
    seed: int
    tested_stroke_m: float
    rules: LoopRules = field(default_factory=LoopRules)


def predicted(run: LoopRun, way: Arrangement, bench: Bench) -> dict[str, float]:
    """Return the indices of a simulated run with its recorded ground acceleration, and the error at the top floor.

    Raises
    ------
    DivergedError
        If the response grows without bound, or far beyond the tested stroke.
    """
    time, ground = run.time_s, run.ground_acceleration

    def at(moments: FloatArray) -> FloatArray:
        return np.asarray(np.interp(moments, time, ground), dtype=np.float64)

    span = judged_span(time, ground, bench.rules.steady)
    response = simulate_law(
        bench.frame,
        way.chain,
        way.controller(run),
        Excitation(float(time[-1]), at, span),
        bench.options,
        position=bench.position,
        rng=np.random.default_rng(bench.seed),
    )
    beyond = float(np.max(np.abs(response.damper_displacement))) / bench.tested_stroke_m
    if beyond > bench.rules.diverged:
        raise DivergedError(f"law {run.law}: the damper would move {beyond:.0f} times the tested stroke")
    moved, felt = (list(of or bench.frame.moved_by_ground) for of in (run.displacement_of, run.acceleration_of))
    displacement, acceleration = response.displacement[:, moved], response.acceleration[:, felt]
    found = run_indices(response.time_s, span, displacement, acceleration, response.force)
    found["peak_over_tested_stroke"] = beyond
    if run.recorded:
        top = np.interp(time, response.time_s, displacement[:, -1])
        measured = run.displacement[:, -1] - np.mean(run.displacement[:, -1])
        found["nrmse_x_top"] = nrmse(top - measured, measured)
    return found


def run_indices(
    time: FloatArray, span: tuple[float, float], displacement: FloatArray, acceleration: FloatArray, force: FloatArray
) -> dict[str, float]:
    """Return the RMS of first and last column and of the damper force over the time that is judged, in SI."""
    steady = (time >= span[0]) & (time <= span[1])
    found = {}
    for label, values in (("x", displacement), ("a", acceleration)):
        if values.size:
            unit = "m" if label == "x" else "m_s2"
            part = values[steady] - np.mean(values[steady], axis=0)
            rms = np.sqrt(np.mean(part**2, axis=0))
            found[f"rms_{label}1_{unit}"] = float(rms[0])
            found[f"rms_{label}_top_{unit}"] = float(rms[-1])
    if force.size:
        found["rms_force_n"] = float(np.sqrt(np.mean(force[steady] ** 2)))
    return found


def compare_laws(
    runs: Sequence[LoopRun], ways: Mapping[str, Arrangement], bench: Bench, jobs: int = 1
) -> dict[str, Any]:
    """Return measured and predicted indices of every run and law, errors, and the measured ranking of the laws.

    Parameters
    ----------
    runs
        Laws under their motion.
    ways
        `before`: controller as it ran, damper without the effect; `after`: the same with the effect; `recalibrated`:
        controller made for the damper with the effect. The last may be missing.
    bench
        Structure and sensors.
    jobs
        Threads; the result does not depend on their number.
    """
    rules = bench.rules
    runner = Parallel(n_jobs=max(1, jobs), backend="threading")
    rows = runner(delayed(_row)(run, ways, bench) for run in runs)
    recorded = [row for row in rows if row["recorded"]]
    found: dict[str, Any] = {"tests": rows, "laws": law_rows(rows, ("measured", *ways), rules.tested)}
    if recorded:
        compared = [when for when in ways if when != "recalibrated"]
        found["recorded_ranking"] = {when: ranking(recorded, when) for when in ("measured", *compared)}
        found["ranking_agrees_with_measured"] = {
            when: not reversed_pairs(recorded, "measured", when, rules.alike) for when in compared
        }
        found["nrmse_x_top"] = {when: _error(recorded, when) for when in compared}
        for key, name in (("rms_x_top_m", "rms_x_top_error"), ("rms_a1_m_s2", "rms_a1_error")):
            found[name] = {when: _index_error(recorded, when, key) for when in compared}
        within = [row for row in recorded if all(_peak(row[when]) <= rules.tested for when in compared)]
        found["rms_x_top_error_within_tested_stroke"] = {
            when: _index_error(within, when, "rms_x_top_m") for when in compared
        }
    return found


def _row(run: LoopRun, ways: Mapping[str, Arrangement], bench: Bench) -> dict[str, Any]:
    """Return measured and predicted indices of one run."""
    row: dict[str, Any] = {"test": run.name, "law": run.law, "recorded": run.recorded}
    if run.recorded:
        row["measured"] = run_indices(
            run.time_s,
            judged_span(run.time_s, run.ground_acceleration, bench.rules.steady),
            run.displacement,
            run.relative_acceleration,
            run.damper_force,
        )
    done: dict[int, dict[str, Any]] = {}
    for when, way in ways.items():
        # a way that has two names is run once
        if id(way) not in done:
            try:
                done[id(way)] = predicted(run, way, bench)
            except DivergedError as error:
                done[id(way)] = {"diverged": str(error)}
        row[when] = dict(done[id(way)])
    return row


def law_rows(
    rows: Sequence[Mapping[str, Any]], columns: Sequence[str], tested: float = LoopRules().tested
) -> list[dict[str, Any]]:
    """Return one row per law: the mean of each index over the runs of the law, for each column.

    Parameters
    ----------
    rows
        Rows of the runs.
    columns
        Keys of the rows that hold indices.
    tested
        Ratio of damper motion to tested stroke above which a prediction is an extrapolation.
    """
    found = []
    for law in dict.fromkeys(row["law"] for row in rows):
        own = [row for row in rows if row["law"] == law]
        entry: dict[str, Any] = {"law": law, "recorded": own[0]["recorded"], "runs": len(own)}
        for when in columns:
            given = [row[when] for row in own if when in row and "diverged" not in row[when]]
            if given:
                entry[when] = {key: float(np.mean([item[key] for item in given])) for key in given[0]}
            elif any("diverged" in row.get(when, {}) for row in own):
                entry[when] = {"diverged": own[0][when]["diverged"]}
        entry["extrapolated"] = any(_peak(row["after"], 0.0) > tested for row in own if "after" in row)
        found.append(entry)
    return found


def _means(rows: Sequence[Mapping[str, Any]], when: str) -> dict[str, float]:
    by_law: dict[str, list[float]] = {}
    for row in rows:
        if "rms_x_top_m" in row.get(when, {}):
            by_law.setdefault(row["law"], []).append(row[when]["rms_x_top_m"])
    return {law: float(np.mean(values)) for law, values in by_law.items()}


def ranking(rows: Sequence[Mapping[str, Any]], when: str) -> list[str]:
    """Return the laws by RMS of the top displacement, the best first."""
    means = _means(rows, when)
    return sorted(means, key=lambda law: means[law])


def reversed_pairs(
    rows: Sequence[Mapping[str, Any]], first: str, second: str, alike: float = LoopRules().alike
) -> list[list[str]]:
    """Return the pairs of laws whose order differs between two columns; the law that `second` ranks higher is first.

    Parameters
    ----------
    rows
        Rows of the runs.
    first, second
        Columns that are compared.
    alike
        Laws whose responses differ by less than this share are not ranked.
    """
    one, other = _means(rows, first), _means(rows, second)
    found = []
    for a, b in combinations([law for law in one if law in other], 2):
        changes = (np.log(one[a] / one[b]), np.log(other[a] / other[b]))
        if changes[0] * changes[1] < 0.0 and min(abs(float(change)) for change in changes) > alike:
            found.append([a, b] if changes[1] < 0.0 else [b, a])
    return found


def _error(rows: Sequence[Mapping[str, Any]], when: str) -> float | None:
    values = [row[when]["nrmse_x_top"] for row in rows if "nrmse_x_top" in row[when]]
    return float(np.sqrt(np.mean(np.square(values)))) if values else None


def _peak(values: Mapping[str, Any], default: float = float("inf")) -> float:
    return float(values.get("peak_over_tested_stroke", default))


def _index_error(rows: Sequence[Mapping[str, Any]], when: str, key: str) -> float | None:
    """Return the RMS over runs of the relative error of an index."""
    values = [
        row[when][key] / row["measured"][key] - 1.0 for row in rows if key in row[when] and row["measured"].get(key)
    ]
    return float(np.sqrt(np.mean(np.square(values)))) if values else None
