"""A complete design: from settings, rig and uncertainties to the best laws, their ranking and confirmation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import Progress
from mrpipe.control.law import Plant
from mrpipe.errors import UserError
from mrpipe.law_design.confirmation import Confirmation, confirmed
from mrpipe.law_design.kept import Designed, Kept, LawUnderDesign
from mrpipe.law_design.objective import Evaluation, Limits, Load, Motion, Objective, evaluate
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.problem import LoopOf, laws_in_the_race, require_band, require_quantities
from mrpipe.law_design.search import SearchOptions
from mrpipe.law_design.study import COARSE, Loops, design_all, pareto_front, reference_evaluation
from mrpipe.law_design.uncertainty import DamperUncertainty, Draw, FrameUncertainty, Ranking, draw, rank
from mrpipe.simulation.excitation import recorded
from mrpipe.simulation.ground_record import HORIZONTAL, read_histories
from mrpipe.simulation.inputs import acting_as_forces, in_two_directions
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.steady_state import CurveOptions, steady_values
from mrpipe.simulation.windows import QUANTITIES
from mrpipe.structures import Frame

AROUND = (0.97, 1.0, 1.03)
"""Frequencies, relative to the resonance, at which a drawn loop is run, because a draw shifts the resonance by a few
percent.
"""

LAW_OF_REFERENCE = "vd"


STANDARD_ERROR, AVERAGED_CYCLES = 5e-4, 120
"""Relative standard error of the largest values of a result, and most cycles over which one of them is averaged. The
minimum over a gain is so flat that an error of 0.1 % moves it by several per cent of the gain. These cycles are
sufficient to average sensor noise; a response that does not become periodic keeps the error of a single run, 1 to 2 %.
"""

SEARCH_RATE = 0.5
"""Plant rate during the search, relative to the settings; it changes peaks by less than 0.5 %."""

DRAWN_SHARE = 0.9
"""Local maxima of a response curve above this share of the largest are run in every draw: one of them may be the
largest in a drawn structure."""

APART = 0.04
"""Maxima whose frequencies differ by less than this share count as one."""


@dataclass(frozen=True)
class Untraced:
    """The design for the identified damper, before effects were traced, and its result with the traced damper.

    Attributes
    ----------
    design
        The best design with the identified damper in the loop, with the coarse curves of the search.
    with_traced
        The same law and gains with the traced damper in the loop, with accurate response curves.
    regret
        Excess of its objective with the traced damper over that of the best design for the traced damper [1].
    """

    design: Evaluation
    with_traced: Evaluation
    regret: float


@dataclass(frozen=True)
class Result:
    """Result of a design.

    Attributes
    ----------
    designed
        Law -> result.
    free
        Law -> result with all gains free, for laws with fixed gains.
    best
        Law with the smallest objective, of those in `designed`.
    reference
        The evaluation that scales the objective.
    front
        Designs for which no other is better in both top displacement and top acceleration (Pareto front).
    ranking
        Ranking of the designs under uncertainty; None without draws.
    confirmation
        Confirmation of the best design of all, with fixed or free gains.
    left_out
        Law -> why it is not compared.
    load
        Excitations of the design.
    untraced
        The design for the damper before it was traced; None where the damper of the design is not a traced one.
    """

    designed: Mapping[str, Designed]
    free: Mapping[str, Designed]
    best: str
    reference: Evaluation
    front: tuple[Evaluation, ...]
    ranking: Ranking | None
    confirmation: Confirmation
    left_out: Mapping[str, str]
    load: Load
    untraced: Untraced | None = None


def load_of(
    settings: DesignSettings, amplitude_m_s2: float, band_rad_s: tuple[float, float], frame: Frame | None = None
) -> Load:
    """Return the excitations of the design.

    Motions with two components act in both directions of `frame` where it has two; else their first component acts.

    Raises
    ------
    UserError
        If the band is empty, a record cannot be read, or a weight is for a quantity that does not exist.
    """
    require_quantities(settings.weights)
    require_band(band_rad_s)
    motions = []
    for number, item in enumerate(settings.motions):
        setting = f"design.motions[{number}]"
        time_s, histories = read_histories(
            Path(item.file),
            item.unit,
            channels=item.file_channels,
            quantity="force" if item.force_at else "acceleration",
            file_setting=f"{setting}.file",
            unit_setting=f"{setting}.unit",
            channels_setting=f"{setting}.file_channels",
        )
        if item.force_at:
            if frame is None:
                raise UserError(setting, "force_at", "needs a structure", "leave it out")
            excitation = recorded(time_s, histories if histories.shape[1] > 1 else histories[:, 0], scale=item.scale)
            excitation = acting_as_forces(excitation, frame, item.force_at, f"{setting}.force_at")
        elif frame is not None and frame.influence_y is not None and histories.shape[1] == HORIZONTAL:
            both = recorded(time_s, histories, scale=item.scale)
            excitation = in_two_directions(both, frame, f"{setting}.file")
        else:
            excitation = recorded(time_s, histories[:, 0], scale=item.scale)
        motions.append(Motion(Path(item.file).stem, excitation))
    amplitudes = tuple(factor * amplitude_m_s2 for factor in sorted(settings.amplitude_factors))
    return Load(band_rad_s, amplitudes, tuple(motions))


def accurate_curves(settings: DesignSettings, *, absolute: bool) -> CurveOptions:
    """Return the options of accurate curves: the maxima of all quantities of the objective are refined."""
    plain = CurveOptions(
        points=15,
        tolerance=5e-3,
        most_cycles=80,
        absolute=absolute,
        standard_error=STANDARD_ERROR,
        most_averaged_cycles=AVERAGED_CYCLES,
    )
    return replace(plain, refined=tuple(dict.fromkeys((*plain.refined, *settings.weights))))


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
    kept: Kept | None = None,
    identified: Rig | None = None,
) -> Result:
    """Search all laws, rank them under uncertainty, and confirm the best design.

    Parameters
    ----------
    rig, plant
        The loop, and the plant that gives the bounds of the gains.
    settings, load
        Settings and load of the design.
    uncertainty
        Uncertainty of structure and damper.
    absolute
        Whether accelerations are absolute.
    rng
        Generator of the sensor noise and of the draws.
    jobs
        Threads; the result does not depend on their number.
    progress
        Receives the share that is done.
    kept
        Results of an interrupted run; None: none are kept.
    identified
        If `rig` has a traced damper, the same rig with the damper before the tracing, for a design without the effects.
    """
    # the threads use all processors; a second level of threads inside the linear algebra would only slow them down
    with threadpool_limits(1):
        return _run_design(
            rig, plant, settings, load, uncertainty, absolute, rng, jobs, progress, kept or Kept(), identified
        )


def _run_design(
    rig: Rig,
    plant: Plant,
    settings: DesignSettings,
    load: Load,
    uncertainty: tuple[FrameUncertainty, DamperUncertainty],
    absolute: bool,
    rng: np.random.Generator,
    jobs: int,
    progress: Progress,
    kept: Kept,
    identified: Rig | None,
) -> Result:
    calibrated = rig.controllers.calibrated.gains
    entries, free_entries, left_out = laws_in_the_race(settings, plant, calibrated)
    run_of = LoopOf(rig, int(rng.integers(2**32)))
    loops = Loops(run_of, run_of.at_rate(SEARCH_RATE))
    final = accurate_curves(settings, absolute=absolute)
    reference = reference_evaluation(run_of, LAW_OF_REFERENCE, calibrated[LAW_OF_REFERENCE], load, final, loops.known)
    objective = Objective(settings.weights, reference.peaks, Limits.of(settings))

    def part(start: float, share: float) -> Progress:
        return lambda done, text="": progress(start + share * done, text)

    found = design_all(
        loops,
        [*entries, *free_entries],
        load,
        objective,
        (SearchOptions(settings.grid, settings.evaluations), final),
        kept,
        jobs,
        part(0.0, 0.75 if identified is None else 0.5),
    )
    designed = {entry.label: found[entry.label] for entry in entries}
    free = {entry.law: found[entry.label] for entry in free_entries}
    best = min(designed, key=lambda label: designed[label].best.value)
    ranking = None
    if settings.draws and len(designed) > 1:
        # without uncertainty all draws are the same
        count = settings.draws if any(item.exists for item in uncertainty) else 1
        draws = [draw(rig.frame, rig.damper, *uncertainty, rng) for _ in range(count)]
        bests = {label: item.best for label, item in designed.items()}
        coarse = run_of.at_rate(SEARCH_RATE)
        ranking = _rank(coarse, bests, best, draws, load, objective, absolute, jobs, part(0.75, 0.13))
    every = [*designed.values(), *free.values()]
    front = _front(run_of, every, load, objective, final, jobs)
    progress(0.94, "confirmation")
    confirmation = confirmed(run_of, every, load, objective, final, jobs)
    result = Result(designed, free, best, reference, front, ranking, confirmation, left_out, load)
    if identified is None:
        return result
    without = _untraced(
        LoopOf(identified, run_of.seed).at_rate(SEARCH_RATE), [*entries, *free_entries], load, objective, settings,
        replace(kept, problem=f"{kept.problem}|before the tracing"), jobs, part(0.5, 0.25),
    )  # fmt: skip
    with_traced = evaluate(run_of, without.law, without.gains, load, objective, final, loops.known)
    least = min(item.best.value for item in every)
    return replace(result, untraced=Untraced(without, with_traced, with_traced.value / least - 1.0))


def _untraced(
    run_of: LoopOf,
    entries: Sequence[LawUnderDesign],
    load: Load,
    objective: Objective,
    settings: DesignSettings,
    kept: Kept,
    jobs: int,
    progress: Progress,
) -> Evaluation:
    """Return the best design of another loop, all of it with the coarse curves of the search."""
    options = (SearchOptions(settings.grid, settings.evaluations), COARSE)
    found = design_all(Loops(run_of, run_of), entries, load, objective, options, kept, jobs, progress)
    return min((item.best for item in found.values()), key=lambda item: item.value)


def _front(
    run_of: LoopOf, found: Sequence[Designed], load: Load, objective: Objective, final: CurveOptions, jobs: int
) -> tuple[Evaluation, ...]:
    """Return the Pareto front of all gains that were tried; what the search saw coarsely is run again accurately."""
    accurate = [item for each in found for item in (each.best, each.calibrated)]
    coarse = pareto_front([*accurate, *(item for each in found for item in each.tried)])
    known = {(item.law, item.gains): item for item in accurate}
    rough = [item for item in coarse if (item.law, item.gains) not in known]
    runner = Parallel(n_jobs=max(1, jobs), backend="threading")
    again = runner(delayed(evaluate)(run_of, item.law, item.gains, load, objective, final) for item in rough)
    return tuple(pareto_front([*accurate, *again]))


def _rank(
    run_of: LoopOf,
    bests: Mapping[str, Evaluation],
    chosen: str,
    draws: Sequence[Draw],
    load: Load,
    objective: Objective,
    absolute: bool,
    jobs: int,
    progress: Progress,
) -> Ranking:
    """Run every law at its best gains in every draw, near its resonances at the largest amplitude."""
    amplitude = max(load.amplitudes_m_s2)
    options = replace(COARSE, absolute=absolute)
    frequencies = {
        label: [f * omega for omega in resonances(item.curves[-1]) for f in AROUND] for label, item in bests.items()
    }

    def value(label: str, item: Draw) -> float:
        run = run_of.drawn(item)(bests[label].law, bests[label].gains)
        table = np.array([steady_values(run, amplitude, omega, options).values for omega in frequencies[label]])
        return objective.value(dict(zip(QUANTITIES, table.max(axis=0).tolist(), strict=True)))

    runner = Parallel(n_jobs=max(1, jobs), backend="threading", return_as="generator")
    values = []
    for number, found in enumerate(runner(delayed(value)(label, item) for item in draws for label in bests), start=1):
        values.append(found)
        progress(number / (len(draws) * len(bests)), "uncertainty")
    return rank(list(bests), chosen, draws, np.array(values).reshape(len(draws), len(bests)))


def resonances(curve: ResponseCurve) -> list[float]:
    """Return the frequencies [rad/s] of the largest top displacement and of all maxima that come near it.

    Two maxima nearer than :data:`APART` are one, because sensor noise roughens a curve.
    """
    values = curve.column("rms_x_top_m")
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    places = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
    found: list[float] = []
    for place in sorted(places, key=lambda k: -float(values[k])):
        omega = float(curve.frequency_rad_s[place])
        if values[place] >= DRAWN_SHARE * values.max() and all(abs(omega / known - 1.0) > APART for known in found):
            found.append(omega)
    return found
