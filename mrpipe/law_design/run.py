"""A whole design: from settings, rig and uncertainties to the study and its ranking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray, Progress
from mrpipe.control.law import Plant
from mrpipe.errors import UserError
from mrpipe.law_design.objective import Evaluation, Limits, Load, Motion, Objective
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.problem import LoopOf, laws_in_the_race
from mrpipe.law_design.search import SearchOptions
from mrpipe.law_design.study import COARSE, Designed, Study, StudyOptions, design_law, pareto_front, study
from mrpipe.law_design.uncertainty import DamperUncertainty, Draw, FrameUncertainty, Ranking, draw, rank
from mrpipe.simulation.excitation import recorded
from mrpipe.simulation.ground_record import read_ground_record
from mrpipe.simulation.response_curve import QUANTITIES, CurveOptions, steady_values
from mrpipe.simulation.rig import Rig
from mrpipe.structures import Frame, natural_modes

AROUND = (0.97, 1.0, 1.03)
"""Frequencies over the resonance at which a drawn loop is run: a draw moves the resonance by a few percent."""

LAW_OF_REFERENCE = "vd"


@dataclass(frozen=True)
class Result:
    """Everything that a design found.

    Attributes
    ----------
    study
        The laws in the race.
    free
        Law -> the same with all gains free, where some are fixed in the race.
    front
        Designs that no other beats in both top displacement and top acceleration.
    ranking
        Under uncertainty; None without draws.
    left_out
        Law -> why it is not in the race.
    load
        What the design was exposed to.
    """

    study: Study
    free: Mapping[str, Designed]
    front: tuple[Evaluation, ...]
    ranking: Ranking | None
    left_out: Mapping[str, str]
    load: Load


def load_of(settings: DesignSettings, amplitude_m_s2: float, band_rad_s: tuple[float, float]) -> Load:
    """Return what the structure is exposed to.

    Raises
    ------
    UserError
        If the band is empty or a record cannot be read.
    """
    if not 0.0 < band_rad_s[0] < band_rad_s[1]:
        raise UserError(
            "design", "band_rad_s", f"{band_rad_s[0]:g} to {band_rad_s[1]:g}", "give a positive rising band"
        )
    motions = []
    for item in settings.motions:
        time_s, acceleration = read_ground_record(Path(item.file), item.unit)
        motions.append(Motion(Path(item.file).stem, recorded(time_s, acceleration, scale=item.scale)))
    amplitudes = tuple(factor * amplitude_m_s2 for factor in sorted(settings.amplitude_factors))
    return Load(band_rad_s, amplitudes, tuple(motions))


def run_design(
    rig: Rig,
    plant: Plant,
    settings: DesignSettings,
    load: Load,
    uncertainty: tuple[FrameUncertainty, DamperUncertainty],
    *,
    absolute: bool,
    rng: np.random.Generator,
    jobs: int,
    progress: Progress,
) -> Result:
    """Search all laws and rank them under uncertainty.

    Parameters
    ----------
    rig, plant
        The loop, and what gives the bounds of the gains.
    settings, load
        Of the design.
    uncertainty
        Of structure and damper.
    absolute
        Whether accelerations are absolute.
    rng
        For sensor noise and draws.
    jobs
        Processes.
    progress
        Receives the share that is done.
    """
    calibrated = rig.controllers.calibrated.gains
    entries, free_entries, left_out = laws_in_the_race(settings, plant, calibrated)
    run_of = LoopOf(rig, int(rng.integers(2**32)))
    limits = Limits() if settings.stroke_limit_m is None else Limits(settings.stroke_limit_m)
    options = StudyOptions(
        SearchOptions(settings.grid, settings.evaluations),
        CurveOptions(points=15, tolerance=5e-3, most_cycles=80, absolute=absolute),
        jobs,
    )
    reference = (LAW_OF_REFERENCE, calibrated[LAW_OF_REFERENCE])

    def part(start: float, share: float) -> Progress:
        return lambda done, text="": progress(start + share * done, text)

    found = study(
        run_of, entries, load, settings.weights, limits, reference, options, part(0.0, 0.7 if settings.draws else 0.9)
    )
    objective = Objective(settings.weights, found.reference.peaks, limits)
    free = {
        entry.law: design_law(run_of, entry, load, objective, options.search, options.final) for entry in free_entries
    }
    progress(0.8, "uncertainty")
    ranking = None
    if settings.draws and len(found.designed) > 1:
        draws = [draw(rig.frame, rig.damper, *uncertainty, rng) for _ in range(settings.draws)]
        ranking = _rank(run_of, found, draws, load, objective, absolute)
    front = pareto_front(
        replace(found, designed={**found.designed, **{f"{law}, free": item for law, item in free.items()}})
    )
    return Result(found, free, tuple(front), ranking, left_out, load)


def _rank(run_of: LoopOf, found: Study, draws: list[Draw], load: Load, objective: Objective, absolute: bool) -> Ranking:
    """Run every law at its best gains in every draw, near its resonance at the largest amplitude."""
    amplitude = max(load.amplitudes_m_s2)
    options = replace(COARSE, absolute=absolute)

    def value(label: str, item: Draw) -> float:
        best = found.designed[label].best
        run = run_of.drawn(item)(best.law, best.gains)
        table = np.array([steady_values(run, amplitude, f * best.resonance_rad_s, options)[0] for f in AROUND])
        return objective.value(dict(zip(QUANTITIES, table.max(axis=0).tolist(), strict=True)))

    return rank(list(found.designed), found.best, draws, value)


def frame_uncertainty(artifact: Artifact, frame: Frame) -> FrameUncertainty:
    """Return the standard deviations of the modes from their 95 % intervals in frame.h5; zero where there are none."""
    n = frame.floors
    members = set(artifact.members("modes")) if "modes" in artifact.members() else set()

    def deviations(name: str) -> FloatArray:
        if f"{name}_interval" not in members:
            return np.zeros(n)
        bounds = artifact.array(f"modes/{name}_interval")
        if bounds.shape != (n, 2):
            return np.zeros(n)
        return np.asarray(np.nan_to_num(np.abs(bounds[:, 1] - bounds[:, 0])) / (2.0 * 1.96))

    omega = natural_modes(frame).angular_frequencies
    return FrameUncertainty(deviations("angular_frequency") / omega, deviations("damping_ratio"))


def damper_uncertainty(artifact: Artifact) -> DamperUncertainty:
    """Return the covariance of the parameters in damper.h5, and the model error on tests that no fit has seen."""
    members = set(artifact.members())
    error = 0.0
    if "comparison" in members:
        form = str(artifact.attributes("damper").get("form", ""))
        rows = [row for row in artifact.json("comparison") if row.get("form") == form]
        error = float((rows[0].get("validation_nrmse") if rows else None) or 0.0)
    if not {"covariance", "parameter_names"} <= members:
        return DamperUncertainty((), np.zeros((0, 0)), error)
    names = tuple(str(name) for name in artifact.json("parameter_names"))
    return DamperUncertainty(names, np.nan_to_num(artifact.array("covariance")), error)
