"""The design study: search the gains of every law, compare the laws, and say how sure the choice is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from joblib import Parallel, delayed

from mrpipe.artifacts import Progress
from mrpipe.control.gains import Gains
from mrpipe.errors import DivergedError
from mrpipe.law_design.objective import Evaluation, Limits, Load, Objective, RunOf, evaluate
from mrpipe.law_design.search import FreeGain, SearchOptions, search
from mrpipe.simulation.response_curve import CurveOptions

COARSE = CurveOptions(
    points=9, settling_cycles=8, window_cycles=6, tolerance=2e-2, most_cycles=40, frequency_tolerance=1e-2
)
"""Response curves during the search: accurate to about a percent, at a tenth of the cost of the final ones."""


@dataclass(frozen=True)
class LawUnderDesign:
    """A law with the gains that may change.

    Attributes
    ----------
    law
        Its name.
    start
        Calibrated gains; the fixed ones keep their values.
    free
        Gains to search; none: the law is only evaluated.
    label
        Key of the result, such as `vdns` or `vdns (free stiffness)`.
    """

    law: str
    start: Gains
    free: tuple[FreeGain, ...]
    label: str


@dataclass(frozen=True)
class Designed:
    """What the study found for one law.

    Attributes
    ----------
    entry
        The law under design.
    best, calibrated
        Evaluation at the best gains and at the calibrated ones, with accurate response curves.
    tried
        All gains that the search evaluated, with coarse response curves.
    """

    entry: LawUnderDesign
    best: Evaluation
    calibrated: Evaluation
    tried: tuple[Evaluation, ...]


@dataclass(frozen=True)
class Study:
    """Result of a design.

    Attributes
    ----------
    designed
        Label -> what was found.
    best
        Label of the law with the smallest objective.
    reference
        The reference evaluation that scales the objective.
    """

    designed: Mapping[str, Designed]
    best: str
    reference: Evaluation


@dataclass
class _Archive:
    """Evaluations of one law during the search."""

    items: list[Evaluation] = field(default_factory=list)

    def add(self, item: Evaluation) -> float:
        """Keep an evaluation and return its value."""
        self.items.append(item)
        return item.value


def design_law(
    run_of: RunOf,
    entry: LawUnderDesign,
    load: Load,
    objective: Objective,
    options: SearchOptions,
    final: CurveOptions,
) -> Designed:
    """Search the gains of one law and evaluate the best ones accurately.

    Parameters
    ----------
    run_of
        Gives the loop of a law.
    entry
        The law and its free gains.
    load, objective
        Of the design.
    options
        Of the search.
    final
        Of the accurate response curves.
    """
    archive = _Archive()
    coarse = replace(COARSE, absolute=final.absolute)
    fixed = {name: value for name, value in entry.start.items() if name not in {gain.name for gain in entry.free}}

    # the largest response is that at the largest amplitude; the other amplitudes are checked with the best gains
    searched = replace(load, amplitudes_m_s2=(max(load.amplitudes_m_s2),))

    def value(gains: Gains) -> float:
        return archive.add(evaluate(run_of, entry.law, gains, searched, objective, coarse))

    calibrated = evaluate(run_of, entry.law, entry.start, load, objective, final)
    if not entry.free:
        return Designed(entry, calibrated, calibrated, ())
    found = search(value, entry.free, fixed, options)
    best = evaluate(run_of, entry.law, found, load, objective, final)
    if calibrated.value < best.value:
        # the accurate curves decide; the search saw the coarse ones
        best = calibrated
    return Designed(entry, best, calibrated, tuple(archive.items))


def reference_evaluation(run_of: RunOf, law: str, gains: Gains, load: Load, final: CurveOptions) -> Evaluation:
    """Return the evaluation that scales the objective.

    Raises
    ------
    DivergedError
        If the reference loop itself is unstable.
    """
    found = evaluate(run_of, law, gains, load, Objective({}), final)
    if not all(map(_finite, found.peaks.values())):
        raise DivergedError(f"the reference loop under law {law} is unstable")
    return found


def _finite(value: float) -> bool:
    return value == value and abs(value) < float("inf")


@dataclass(frozen=True)
class StudyOptions:
    """How a study is made.

    Attributes
    ----------
    search
        Size of the search of the gains.
    final
        Accurate response curves of the best gains.
    jobs
        Processes; the result does not depend on it.
    """

    search: SearchOptions
    final: CurveOptions
    jobs: int = 1


def study(
    run_of: RunOf,
    entries: Sequence[LawUnderDesign],
    load: Load,
    weights: Mapping[str, float],
    limits: Limits,
    reference: tuple[str, Gains],
    options: StudyOptions,
    progress: Progress,
) -> Study:
    """Design every law and name the best one.

    Parameters
    ----------
    run_of
        Gives the loop of a law; must be picklable where several processes are used.
    entries
        Laws under design.
    load
        Of the design.
    weights, limits
        Of the objective.
    reference
        Law and gains whose largest responses are the unit of the objective.
    options
        Of the study.
    progress
        Receives the share that is done.

    Raises
    ------
    DivergedError
        If the reference loop is unstable.
    """
    base = reference_evaluation(run_of, *reference, load, options.final)
    objective = Objective(weights, base.peaks, limits)
    parallel = Parallel(n_jobs=options.jobs, return_as="generator")
    tasks = (delayed(design_law)(run_of, entry, load, objective, options.search, options.final) for entry in entries)
    designed: dict[str, Designed] = {}
    for entry, found in zip(entries, parallel(tasks), strict=True):
        designed[entry.label] = found
        progress(len(designed) / len(entries), entry.label)
    best = min(designed, key=lambda label: designed[label].best.value)
    return Study(designed, best, base)


def pareto_front(study_: Study, first: str = "rms_x_top_m", second: str = "rms_a_top_m_s2") -> list[Evaluation]:
    """Return the designs that no other design beats in both quantities, ascending in the first.

    Parameters
    ----------
    study_
        Result of a design.
    first, second
        Quantities to compare.
    """
    items = [item for found in study_.designed.values() for item in (*found.tried, found.best, found.calibrated)]
    items.sort(key=lambda item: (item.peaks[first], item.peaks[second]))
    front: list[Evaluation] = []
    lowest = float("inf")
    for item in items:
        height = item.peaks[second]
        if _finite(item.peaks[first]) and height < lowest:
            front.append(item)
            lowest = height
    return front
