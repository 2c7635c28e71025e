"""Summary and report of the 76-storey tower in wind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.case_studies import report as figures
from mrpipe.case_studies.device_report import describe_device, inverse_errors
from mrpipe.case_studies.indices import WIND_FLOORS
from mrpipe.case_studies.inverse import ValidatedInverse
from mrpipe.case_studies.wind.study import REASON, WindCase, WindStudy, wind_response
from mrpipe.reporting.sink import Sink


@dataclass(frozen=True)
class WindResult:
    """Results of all runs of the tower.

    Attributes
    ----------
    study, cases
        The tower under the load, and its laws.
    sweep_law, sweep
        Law whose sensitivity was computed; dampers -> indices.
    inverse
        The neural inverse of the damper; None if its formula is used.
    """

    study: WindStudy
    cases: Sequence[WindCase]
    sweep_law: str
    sweep: Mapping[float, Mapping[str, float]]
    inverse: ValidatedInverse | None


def summary(result: WindResult, printed: figures.Table) -> dict[str, Any]:
    """Return what the command prints; `printed` is Table 6.3: law -> index -> value."""
    study = result.study
    model = study.tower.model
    frequencies = study.reference.angular_frequencies / (2.0 * np.pi)
    free = wind_response(study.uncontrolled)
    errors = [case.response.energy_balance_error for case in result.cases]
    return {
        "model": model.origin,
        "source": model.source,
        "frequencies_hz": frequencies,
        "periods_s": 1.0 / frequencies,
        "damping_ratios": study.reference.damping_ratios,
        "total_mass_kg": model.total_mass_kg,
        "states": 2 * study.modal.modes,
        "position": study.tower.position,
        "dampers": study.dampers,
        "motion": f"wind {study.load.name}",
        "load": {
            "duration_s": study.load.duration_s,
            "interval_s": study.load.interval_s,
            "rms_base_shear_n": float(np.std(study.load.forces_n.sum(axis=1))),
        },
        "uncontrolled": {
            "rms_x76_m": float(np.sqrt(np.mean(free.displacement_m[:, -1] ** 2))),
            "peak_x76_m": float(np.abs(free.displacement_m[:, -1]).max()),
            "rms_a75_m_s2": float(np.sqrt(np.mean(free.acceleration_m_s2[:, -2] ** 2))),
            "peak_a75_m_s2": float(np.abs(free.acceleration_m_s2[:, -2]).max()),
        },
        "laws": {case.law: case.indices for case in result.cases},
        "runs": {case.law: case.summary for case in result.cases},
        "gains": asdict(study.gains),
        "optimal_gains": asdict(study.optimum),
        "lqg_force_n": study.lqg_force_n,
        **inverse_errors(result.inverse),
        "thesis": printed,
        "why_different": REASON,
        "sensitivity": {
            "law": result.sweep_law,
            **{f"{number:g}": dict(row) for number, row in result.sweep.items()},
        },
        "energy_balance_error": max([*errors, study.uncontrolled.energy_balance_error]),
    }


def describe(sink: Sink, result: WindResult, printed: figures.Table) -> None:
    """Write the part of the report; `printed` is Table 6.3: law -> index -> value."""
    study = result.study
    origin = study.tower.model.origin
    sink.text(f"Model: **{origin}**. {study.tower.model.source}. {REASON}")
    sink.text(
        f"Device: {study.tower.position}, {study.dampers:g} dampers of 1000 kN; {2 * study.modal.modes} states. Gains "
        f"of vd are {study.gains.capacity_share:.3g} of the optimum, which is what the dampers can give in this wind."
    )
    describe_device(sink, study.device, result.inverse)
    laws = {case.law: case.indices for case in result.cases}
    sink.table("indices", figures.beside_thesis(laws, printed, origin), f"Table 6.3 and our results ({origin} model).")
    sink.figure("indices", figures.index_bars(laws, printed), "Indices (ratios) compared with Table 6.3.")
    free = wind_response(study.uncontrolled)
    histories = {case.law: wind_response(case.response) for case in result.cases}
    time = study.uncontrolled.time_s
    until = min(300.0, study.load.duration_s)
    for name, place, unit in (("displacement_m", 8, "x76 [m]"), ("acceleration_m_s2", 7, "a75 [m/s²]")):
        picture = figures.histories(
            time,
            {law: getattr(item, name)[:, place] for law, item in histories.items()},
            getattr(free, name)[:, place],
            quantity=unit,
            until_s=until,
        )
        word = name.partition("_")[0]
        sink.figure(f"top-{word}", picture, f"Floor {WIND_FLOORS[place]} {word} (Figure 6.11).")
    every = {"uncontrolled": free, **histories}
    picture = figures.floor_profiles(
        WIND_FLOORS,
        {law: np.abs(item.displacement_m).max(axis=0) for law, item in every.items()},
        {law: np.abs(item.acceleration_m_s2).max(axis=0) for law, item in every.items()},
    )
    sink.figure("floors", picture, "Peaks of the floors.")
    picture = figures.loops(
        {law: item.stroke_m for law, item in histories.items()},
        {law: item.device_velocity_m_s for law, item in histories.items()},
        {law: item.device_force_n for law, item in histories.items()},
    )
    sink.figure("loops", picture, "Device force against displacement and velocity.")
    keys = [key for key in next(iter(result.sweep.values())) if key not in ("J6", "J12")]
    picture = figures.sensitivity(
        [number * 1000.0 for number in result.sweep],
        {key: [row[key] for row in result.sweep.values()] for key in keys},
        unit="capacity of the dampers [kN]",
        title=f"law {result.sweep_law}, {study.tower.position}",
    )
    sink.figure("sensitivity", picture, "Each index against damper capacity: where dampers matter at all.")
    rows = [{"dampers": number, "model": origin, **row} for number, row in result.sweep.items()]
    sink.table("sensitivity", pd.DataFrame(rows), f"Indices of {result.sweep_law} against the number of dampers.")
