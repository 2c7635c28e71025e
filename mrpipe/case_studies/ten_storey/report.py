"""Summary and report of the ten-storey frame of paper P4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.case_studies import report as figures
from mrpipe.case_studies.ten_storey.study import REASON, VARIANTS, TenStoreyCase, TenStoreyStudy
from mrpipe.reporting.sink import Sink

Studies = Mapping[str, tuple[TenStoreyStudy, Sequence[TenStoreyCase]]]


def index_tables(studies: Studies) -> dict[str, dict[str, dict[str, dict[str, float]]]]:
    """Return structure -> variant -> law -> index -> value."""
    tables: dict[str, dict[str, dict[str, dict[str, float]]]] = {}
    for name, (_, cases) in studies.items():
        tables[name] = {variant: {} for variant in VARIANTS}
        for case in cases:
            tables[name][case.variant][case.law] = case.indices
    return tables


def _gains(study: TenStoreyStudy, laws: Sequence[str]) -> dict[str, dict[str, float]]:
    result = {}
    for law in laws:
        viscous, stiffness = study.gains.of(law)
        exact, ratio = study.gains.exact(law)
        result[law] = {
            "c_n_s_m": viscous,
            "k_n_m": stiffness,
            "exact_c_n_s_m": exact,
            "exact_damping_ratio": ratio,
        }
    return result


def summary(studies: Studies, sweep: Mapping[float, Mapping[str, float]], printed: figures.Table) -> dict[str, Any]:
    """Return what the command prints: the first structure's indices, and all variants of all structures.

    Parameters
    ----------
    studies
        Structure -> study and its runs.
    sweep
        Number of dampers -> indices.
    printed
        Table 2 of P4: law -> index -> value.
    """
    study, cases = next(iter(studies.values()))
    tables = index_tables(studies)
    shown = [case for case in cases if case.variant == "filtered"]
    frequencies = study.modal.angular_frequencies / (2.0 * np.pi)
    return {
        "model": study.model.origin,
        "source": study.model.source,
        "frequencies_hz": frequencies,
        "periods_s": 1.0 / frequencies,
        "total_mass_kg": study.model.total_mass_kg,
        "motion": study.motion.name,
        "laws": next(iter(tables.values()))["filtered"],
        "ideal": next(iter(tables.values()))["ideal"],
        "unfiltered": next(iter(tables.values()))["unfiltered"],
        "variants": tables,
        "absolute_acceleration": {f"{case.variant}/{case.law}": case.absolute for case in cases},
        "gains": _gains(study, [case.law for case in shown if not case.law.startswith("passive")]),
        "peak_force_n": {case.law: case.peak_force_n for case in shown},
        "peak_stroke_m": {case.law: case.peak_stroke_m for case in shown},
        "thesis": printed,
        "why_different": REASON,
        "sensitivity": {f"{number:g}": dict(row) for number, row in sweep.items()},
        "energy_balance_error": max(
            case.response.energy_balance_error for _, group in studies.values() for case in group
        ),
    }


def describe(sink: Sink, studies: Studies, sweep: Mapping[float, Mapping[str, float]], printed: figures.Table) -> None:
    """Write the part of the report; the arguments are those of :func:`summary`."""
    study, cases = next(iter(studies.values()))
    origin, motion = study.model.origin, study.motion
    sink.text(f"Model: **{origin}**. {study.model.source}. {REASON}")
    for name, variants in index_tables(studies).items():
        for variant, table in variants.items():
            frame = figures.beside_thesis(table, printed, origin)
            sink.table(f"{name}-{variant}", frame, f"P4 Table 2 and our results: {name}, {variant}, {motion.name}.")
    shown = [case for case in cases if case.variant == "filtered"]
    picture = figures.histories(
        study.uncontrolled.time_s,
        {case.law: case.response.displacement()[:, -1] for case in shown},
        study.uncontrolled.displacement()[:, -1],
        quantity="top floor displacement [m]",
        until_s=min(30.0, motion.duration_s),
    )
    sink.figure("top-floor", picture, "Top floor displacement (P4 Figures 3 to 6), MR damper with the voltage filter.")
    peaks = {
        law: (np.abs(item.displacement()).max(axis=0), np.abs(item.acceleration() + item.loads).max(axis=0))
        for law, item in (("uncontrolled", study.uncontrolled), *((case.law, case.response) for case in shown))
    }
    picture = figures.floor_profiles(
        range(1, study.model.degrees_of_freedom + 1),
        {law: pair[0] for law, pair in peaks.items()},
        {law: pair[1] for law, pair in peaks.items()},
    )
    sink.figure("floors", picture, "Peaks of the floors: displacement to the ground, absolute acceleration.")
    picture = figures.loops(
        {case.law: case.response.stroke()[:, 0] for case in shown},
        {case.law: case.response.rod_velocity()[:, 0] for case in shown},
        {case.law: case.response.forces[:, 0] for case in shown},
    )
    sink.figure("loops", picture, "Damper force against displacement and velocity.")
    laws = {case.law: case.indices for case in shown}
    sink.figure("indices", figures.index_bars(laws, printed), "Indices compared with P4 Table 2.")
    keys = list(next(iter(sweep.values())))
    picture = figures.sensitivity(
        [number * 1000.0 for number in sweep],
        {key: [row[key] for row in sweep.values()] for key in keys},
        unit="capacity of the dampers [kN]",
        title="the first law, MR damper with the voltage filter",
    )
    sink.figure("sensitivity", picture, "Each index against damper capacity: where a damper of that size matters.")
    rows = [{"dampers": number, "model": origin, **row} for number, row in sweep.items()]
    sink.table("sensitivity", pd.DataFrame(rows), "Indices against the number of 1000 kN dampers.")
