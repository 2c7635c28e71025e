"""Summary and report of the base-isolated building."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies import report as figures
from mrpipe.case_studies.base_isolated.study import REASON, IsolationCase, IsolationStudy, isolated_response
from mrpipe.case_studies.device_report import describe_device, inverse_errors
from mrpipe.case_studies.inverse import ValidatedInverse
from mrpipe.case_studies.model import natural_periods
from mrpipe.case_studies.run import Response
from mrpipe.reporting.sink import Sink
from mrpipe.structures.records import GroundMotion


@dataclass(frozen=True)
class IsolationResult:
    """Results of all runs of the base-isolated building.

    Attributes
    ----------
    study, motion, uncontrolled, cases
        The study, the main motion, and the runs under it without dampers and under each law.
    motions
        Motion -> law -> indices, for those of the seven motions that were requested.
    sweep_law, sweep
        Law whose sensitivity was computed; dampers at a position -> indices.
    inverse
        The neural inverse of the damper; None if its formula is used.
    """

    study: IsolationStudy
    motion: GroundMotion
    uncontrolled: Response
    cases: Sequence[IsolationCase]
    motions: Mapping[str, Mapping[str, Mapping[str, float]]]
    sweep_law: str
    sweep: Mapping[float, Mapping[str, float]]
    inverse: ValidatedInverse | None


def summary(result: IsolationResult, printed: figures.Table) -> dict[str, Any]:
    """Return what the command prints; `printed` is Table 6.2: law -> index -> value."""
    building, gains = result.study.building, result.study.gains
    periods = natural_periods(building.model)
    errors = [case.response.energy_balance_error for case in result.cases]
    errors += [values["energy_balance_error"] for laws in result.motions.values() for values in laws.values()]
    return {
        "model": building.model.origin,
        "source": building.model.source,
        "frequencies_hz": 1.0 / periods,
        "periods_s": periods,
        "fixed_base_periods_s": building.fixed_base_periods_s,
        "isolated_period_s": building.isolation_period_s,
        "isolated_damping_ratio": building.isolation_damping_ratio,
        "rigid_isolated_periods_s": building.rigid_isolation_periods_s,
        "total_mass_kg": building.model.total_mass_kg,
        "motion": result.motion.name,
        "laws": {case.law: case.indices for case in result.cases},
        "runs": {case.law: case.summary for case in result.cases},
        "motions": result.motions,
        "gains": {
            "vd_c_n_s_m": gains.viscous,
            "vdns_c_n_s_m": gains.negative_viscous,
            "vdns_k_n_m": gains.negative_stiffness,
            "fdns_alpha_n_m": gains.friction,
            "damping_ratio": gains.damping_ratio,
        },
        **inverse_errors(result.inverse),
        "thesis": printed,
        "why_different": REASON,
        "sensitivity": {
            "law": result.sweep_law,
            **{f"{number:g}": dict(row) for number, row in result.sweep.items()},
        },
        "energy_balance_error": max([*errors, result.uncontrolled.energy_balance_error]),
    }


def _listed(periods_s: FloatArray) -> str:
    return ", ".join(f"{period:.3f}" for period in periods_s)


def describe(sink: Sink, result: IsolationResult, printed: figures.Table) -> None:
    """Write the part of the report; `printed` is Table 6.2: law -> index -> value."""
    building = result.study.building
    origin, name = building.model.origin, result.motion.name
    sink.text(f"Model: **{origin}**. {building.model.source}. {REASON}")
    rigid, flexible = building.rigid_isolation_periods_s, natural_periods(building.model)[:3]
    sink.text(
        f"The rigid building swings on its bearings in {building.isolation_period_s:.3f} s, damping ratio "
        f"{building.isolation_damping_ratio:.3f}. The bearings' centre lies off the centre of mass, so that in the "
        f"plane it has {_listed(rigid)} s; with the flexibility of the superstructure the three isolation modes have "
        f"{_listed(flexible)} s."
    )
    describe_device(sink, result.study.device, result.inverse)
    laws = {case.law: case.indices for case in result.cases}
    sink.table(
        "indices",
        figures.beside_thesis(laws, printed, origin),
        f"Table 6.2 (El Centro) compared with ours ({origin}, {name}).",
    )
    sink.figure("indices", figures.index_bars(laws, printed), f"Indices under {name}, compared with Table 6.2.")
    if result.motions:
        rows = [
            {"motion": motion, "law": law, "model": origin, **values}
            for motion, table in result.motions.items()
            for law, values in table.items()
        ]
        sink.table("motions", pd.DataFrame(rows), f"Indices under the seven motions ({origin} model).")
    _histories(sink, result)
    sweep = result.sweep
    keys = [key for key in next(iter(sweep.values())) if key.startswith("J")]
    picture = figures.sensitivity(
        [number * 1000.0 for number in sweep],
        {key: [row[key] for row in sweep.values()] for key in keys},
        unit="capacity at each of the two positions [kN]",
        title=f"law {result.sweep_law}, {name}",
    )
    sink.figure("sensitivity", picture, "Each index against damper capacity: where a damper of that size matters.")
    rows = [{"dampers": number, "model": origin, **row} for number, row in sweep.items()]
    sink.table("sensitivity", pd.DataFrame(rows), f"Indices of {result.sweep_law} against dampers at each position.")


def _top(result: IsolationResult, response: Response, axis: int) -> tuple[FloatArray, FloatArray]:
    """Return absolute acceleration of floor 8 and its displacement relative to the ground along x or y."""
    histories = isolated_response(result.study.building, response)
    x = response.displacement()
    return histories.floor_acceleration_m_s2[:, -1, axis], x[:, 21 + axis] + x[:, 24 + axis]


def _floor_peaks(result: IsolationResult, response: Response) -> tuple[FloatArray, FloatArray]:
    """Return peak displacement to the base and absolute acceleration of the floors along x, shape (8,) each."""
    histories = isolated_response(result.study.building, response)
    displacement = np.cumsum(histories.drift[:, :, 0], axis=1)
    acceleration = histories.floor_acceleration_m_s2[:, :, 0]
    return np.asarray(np.abs(displacement).max(axis=0)), np.asarray(np.abs(acceleration).max(axis=0))


def _histories(sink: Sink, result: IsolationResult) -> None:
    time = result.uncontrolled.time_s
    for axis, letter in enumerate("xy"):
        curves = {case.law: _top(result, case.response, axis) for case in result.cases}
        free = _top(result, result.uncontrolled, axis)
        for place, (quantity, word) in enumerate(
            (("top floor acceleration [m/s²]", "acceleration"), ("top floor displacement [m]", "displacement"))
        ):
            picture = figures.histories(
                time, {law: values[place] for law, values in curves.items()}, free[place], quantity=quantity
            )
            sink.figure(f"top-{word}-{letter}", picture, f"Top floor {word} along {letter} (Figures 6.7, 6.8).")
    response = {case.law: case.response for case in result.cases}
    peaks = {law: _floor_peaks(result, item) for law, item in {"uncontrolled": result.uncontrolled, **response}.items()}
    picture = figures.floor_profiles(
        range(1, 9), {law: pair[0] for law, pair in peaks.items()}, {law: pair[1] for law, pair in peaks.items()}
    )
    sink.figure("floors", picture, "Peaks of the floors along x: displacement to the base, absolute acceleration.")
    picture = figures.loops(
        {law: item.stroke()[:, 0] for law, item in response.items()},
        {law: item.rod_velocity()[:, 0] for law, item in response.items()},
        {law: item.forces[:, 0] for law, item in response.items()},
    )
    sink.figure("loops", picture, "Force of the device along x against displacement and velocity.")
    components = result.motion.acceleration_m_s2
    clock: FloatArray = np.arange(len(components), dtype=np.float64) * result.motion.interval_s
    picture = figures.histories(
        clock,
        {"y": components[:, 1]},
        components[:, 0],
        quantity="ground acceleration [m/s²]",
        title=result.motion.name,
        reference_name="x",
    )
    sink.figure("motion", picture, "The two components of the ground motion (Figure 6.3).")
