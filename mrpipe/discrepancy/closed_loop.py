"""The augmented damper in the closed loop: predicted against measured response, ranking of the laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns import Campaign
from mrpipe.control.controller import Controller
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.plant import Chain, build_chain
from mrpipe.discrepancy.engine import Fit
from mrpipe.errors import DivergedError
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import LoopOptions, simulate_law
from mrpipe.structures import Frame

STEADY_FROM = 0.5
"""Share of a record after which the response is taken as steady."""


@dataclass(frozen=True)
class MeasuredRun:
    """A closed-loop recording.

    Attributes
    ----------
    name, law
        Test and control law.
    gains
        What campaign.yaml says of them; empty where nothing.
    time_s
        Shape (m,).
    ground_acceleration
        Shape (m,) [m/s^2].
    displacement
        Of the floors that were measured, relative to the ground, lowest first, shape (m, p) [m].
    absolute_acceleration
        Of the floors that were measured, lowest first, shape (m, q) [m/s^2]; empty where not recorded.
    damper_force
        Shape (m,) [N]; empty where not recorded.
    """

    name: str
    law: str
    gains: Mapping[str, float]
    time_s: FloatArray
    ground_acceleration: FloatArray
    displacement: FloatArray
    absolute_acceleration: FloatArray
    damper_force: FloatArray


def measured_runs(campaign: Campaign) -> list[MeasuredRun]:
    """Return the closed-loop recordings of a frame campaign that name their law."""
    runs = []
    for item in campaign.recordings:
        law = str(item.details.get("law", ""))
        if item.kind != "closed-loop" or not law or "ground_acceleration" not in item.channels:
            continue
        displacement = _floors(item.channels, "floor_displacement_")
        if not displacement.size:
            continue
        given = item.details.get("gains") or {}
        runs.append(
            MeasuredRun(
                item.name,
                law,
                {str(name): float(value) for name, value in given.items()},
                item.time_s - item.time_s[0],
                item.channels["ground_acceleration"],
                displacement,
                _floors(item.channels, "floor_acceleration_"),
                item.channels.get("damper_force", np.zeros(0)),
            )
        )
    return runs


def _floors(channels: Mapping[str, FloatArray], stem: str) -> FloatArray:
    """Return the channels of the floors that were measured, lowest first, shape (m, p); empty where there is none."""
    names = sorted((name for name in channels if name.startswith(stem)), key=lambda name: int(name.removeprefix(stem)))
    return np.column_stack([channels[name] for name in names]) if names else np.zeros((0, 0))


def damper_of(found: Fit, drive_unit: str) -> DamperModel:
    """Return the base of a fit as a damper model, as controllers and their inverse want it."""
    values = found.base_values
    base = found.problem.base
    yield_force, viscosity = found.polynomials
    numbers = {
        "yield_displacement": values["yield_displacement"],
        "gamma_share": values.get("gamma_share", base.gamma_share),
        "exponent": values.get("exponent", base.exponent),
        "eta": values.get("eta", 100.0),
    }
    numbers |= {f"yield_force_{letter}": float(v) for letter, v in zip("abcd", yield_force, strict=False)}
    numbers |= {f"c0_{letter}": float(v) for letter, v in zip("abcd", viscosity, strict=False)}
    return DamperModel(base.name, numbers, drive_unit, found.problem.scales.drive)


def plant_chain(found: Fit) -> Chain:
    """Return the chain for the closed loop; faults of sensors stay out of the plant, a lag unknown is left out."""
    problem = found.problem
    steps = problem.base.steps(found.base_values, *found.polynomials)
    for term, values in zip(problem.terms, found.term_values, strict=True):
        if not term.effect.sensor:
            steps.extend(term.form.steps(values))
    return build_chain(steps)


def predicted(
    run: MeasuredRun, frame: Frame, chain: Chain, control: Controller, position: FloatArray, options: LoopOptions
) -> dict[str, float]:
    """Return the indices of a run simulated with the measured ground acceleration, and its error of the top floor.

    Raises
    ------
    DivergedError
        If the response grows without bound.
    """
    time, ground = run.time_s, run.ground_acceleration - np.mean(run.ground_acceleration)

    def at(moments: FloatArray) -> FloatArray:
        return np.asarray(np.interp(moments, time, ground), dtype=np.float64)

    duration = float(time[-1])
    response = simulate_law(
        frame,
        chain,
        control,
        Excitation(duration, at, (STEADY_FROM * duration, duration)),
        options,
        position=position,
    )
    found = run_indices(response.time_s, response.displacement, response.absolute_acceleration, response.force)
    top = np.interp(time, response.time_s, response.displacement[:, -1])
    measured = run.displacement[:, -1] - np.mean(run.displacement[:, -1])
    found["nrmse_x_top"] = float(np.sqrt(np.mean((top - measured) ** 2) / max(np.mean(measured**2), 1e-30)))
    return found


def run_indices(
    time: FloatArray, displacement: FloatArray, acceleration: FloatArray, force: FloatArray
) -> dict[str, float]:
    """Return RMS of first and top floor over the steady part, SI."""
    steady = time >= STEADY_FROM * time[-1]
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
    runs: Sequence[MeasuredRun],
    frame: Frame,
    chains: Mapping[str, Chain],
    controllers: Mapping[str, Callable[[MeasuredRun], Controller]],
    position: FloatArray,
    options: LoopOptions,
) -> dict[str, Any]:
    """Return measured and predicted indices of every run before and after, errors, and the ranking of the laws.

    Parameters
    ----------
    chains, controllers
        Dampers and what makes a controller for a run, by `before` and `after`.
    """
    rows = []
    for run in runs:
        row: dict[str, Any] = {
            "test": run.name,
            "law": run.law,
            "measured": run_indices(run.time_s, run.displacement, run.absolute_acceleration, run.damper_force),
        }
        for when, chain in chains.items():
            try:
                row[when] = predicted(run, frame, chain, controllers[when](run), position, options)
            except DivergedError as error:
                row[when] = {"diverged": str(error)}
        rows.append(row)
    rankings = {when: _ranking(rows, when) for when in ("measured", *chains)}
    errors = {when: _error(rows, when) for when in chains}
    return {
        "status": f"{len(rows)} recordings replayed",
        "tests": rows,
        "ranking": rankings,
        "ranking_changes": rankings.get("before") != rankings.get("after"),
        "nrmse_x_top": errors,
        "rms_x_top_error": {when: _index_error(rows, when) for when in chains},
    }


def _ranking(rows: Sequence[Mapping[str, Any]], when: str) -> list[str]:
    by_law: dict[str, list[float]] = {}
    for row in rows:
        if "rms_x_top_m" in row[when]:
            by_law.setdefault(row["law"], []).append(row[when]["rms_x_top_m"])
    return sorted(by_law, key=lambda law: float(np.mean(by_law[law])))


def _error(rows: Sequence[Mapping[str, Any]], when: str) -> float:
    values = [row[when]["nrmse_x_top"] for row in rows if "nrmse_x_top" in row[when]]
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("nan")


def _index_error(rows: Sequence[Mapping[str, Any]], when: str) -> float:
    """Return the RMS over runs of the relative error of the top floor's RMS."""
    values = [
        row[when]["rms_x_top_m"] / row["measured"]["rms_x_top_m"] - 1.0 for row in rows if "rms_x_top_m" in row[when]
    ]
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("nan")
