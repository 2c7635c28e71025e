"""The design study: search of the gains of every law, and comparison of the laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from joblib import Parallel, delayed

from mrpipe.artifacts import Progress
from mrpipe.control.gains import Gains
from mrpipe.errors import DivergedError
from mrpipe.law_design.kept import Designed, Kept, LawUnderDesign
from mrpipe.law_design.objective import Evaluation, Known, Load, Objective, RunOf, evaluate
from mrpipe.law_design.search import SearchOptions, refine, search
from mrpipe.simulation.steady_state import CurveOptions

COARSE = CurveOptions(
    points=9,
    settling_cycles=8,
    window_cycles=6,
    tolerance=2e-2,
    most_cycles=40,
    frequency_tolerance=1e-2,
    refinements=5,
    refined=("rms_x_top_m",),
)
"""Response curves during the search: peaks are accurate to about 0.5 %, in a tenth of the time of the final ones."""


@dataclass(frozen=True)
class Loops:
    """The loops of a study.

    Attributes
    ----------
    accurate
        Function that returns the loop of a law with the settings.
    searched
        The same with a larger step of the plant, for the search.
    known
        Responses of the accurate loops.
    """

    accurate: RunOf
    searched: RunOf
    known: Known = field(default_factory=Known)


@dataclass
class _Archive:
    """Evaluations of one law during the search."""

    items: list[Evaluation] = field(default_factory=list)

    def add(self, item: Evaluation) -> float:
        """Keep an evaluation and return its value."""
        self.items.append(item)
        return item.value


def design_law(
    loops: Loops,
    entry: LawUnderDesign,
    load: Load,
    objective: Objective,
    options: SearchOptions,
    final: CurveOptions,
) -> Designed:
    """Search the gains of one law and evaluate the best ones accurately.

    Parameters
    ----------
    loops
        Give the loop of a law.
    entry
        The law and its free gains.
    load, objective
        Load and objective of the design.
    options
        Options of the search.
    final
        Options of the accurate response curves.
    """
    archive = _Archive()
    coarse = replace(COARSE, absolute=final.absolute, refined=tuple(objective.weights) or COARSE.refined)
    fixed = {name: value for name, value in entry.start.items() if name not in {gain.name for gain in entry.free}}

    # the largest response is that at the largest amplitude; the other amplitudes are checked with the best gains
    searched = replace(load, amplitudes_m_s2=(max(load.amplitudes_m_s2),))

    def value(gains: Gains) -> float:
        return archive.add(evaluate(loops.searched, entry.law, gains, searched, objective, coarse))

    def accurate(gains: Gains, load: Load, options: CurveOptions) -> Evaluation:
        return evaluate(loops.accurate, entry.law, gains, load, objective, options, loops.known)

    calibrated = accurate(entry.start, load, final)
    if not entry.free:
        return Designed(entry, calibrated, calibrated, ())
    found = search(value, entry.free, fixed, options)
    near = replace(final, refined=coarse.refined)
    # without accurate curves a refinement is not possible
    if final.tolerance < coarse.tolerance:
        found = refine(
            lambda gains: accurate(gains, searched, near).value,
            entry.free,
            found,
            options,
        )
    best = accurate(found, load, final)
    if calibrated.value < best.value:
        # the accurate curves decide; the search used coarse ones
        best = calibrated
    return Designed(entry, best, calibrated, tuple(archive.items))


def reference_evaluation(
    run_of: RunOf, law: str, gains: Gains, load: Load, final: CurveOptions, known: Known | None = None
) -> Evaluation:
    """Return the evaluation that scales the objective.

    Raises
    ------
    DivergedError
        If the reference loop itself is unstable.
    """
    found = evaluate(run_of, law, gains, load, Objective({}), final, known)
    if not all(map(_finite, found.peaks.values())):
        raise DivergedError(f"the reference loop under law {law} is unstable")
    return found


def _finite(value: float) -> bool:
    return value == value and abs(value) < float("inf")


def design_all(
    loops: Loops,
    entries: Sequence[LawUnderDesign],
    load: Load,
    objective: Objective,
    options: tuple[SearchOptions, CurveOptions],
    kept: Kept,
    jobs: int,
    progress: Progress,
) -> dict[str, Designed]:
    """Design every law on some threads and return label -> what was found, in the order of the entries.

    Parameters
    ----------
    loops
        Give the loop of a law.
    entries
        Laws under design.
    load, objective
        Load and objective of the design.
    options
        Options of the search, and of the accurate response curves.
    kept
        Results of an interrupted run, which are not computed again.
    jobs
        Threads; the result does not depend on their number.
    progress
        Receives the share that is done.
    """

    def one(entry: LawUnderDesign) -> tuple[str, Designed]:
        known = kept.read(entry)
        if known is None:
            known = design_law(loops, entry, load, objective, *options)
            kept.write(known)
        return entry.label, known

    # the longest searches start first, so that the threads end at about the same time
    ordered = sorted(entries, key=lambda entry: -len(entry.free))
    total = sum(1 + len(entry.free) ** 2 for entry in entries)
    runner = Parallel(n_jobs=max(1, jobs), backend="threading", return_as="generator_unordered")
    found: dict[str, Designed] = {}
    done = 0
    for label, item in runner(delayed(one)(entry) for entry in ordered):
        found[label] = item
        done += 1 + len(item.entry.free) ** 2
        progress(done / total, label)
    return {entry.label: found[entry.label] for entry in entries}


def pareto_front(
    items: Sequence[Evaluation], first: str = "rms_x_top_m", second: str = "rms_a_top_m_s2"
) -> list[Evaluation]:
    """Return the designs for which no other design is better in both quantities, ascending in the first one.

    Parameters
    ----------
    items
        Designs.
    first, second
        Quantities to compare.
    """
    front: list[Evaluation] = []
    lowest = float("inf")
    for item in sorted(items, key=lambda item: (item.peaks[first], item.peaks[second])):
        height = item.peaks[second]
        if _finite(item.peaks[first]) and height < lowest:
            front.append(item)
            lowest = height
    return front
