"""All claims of the requested chapters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mrpipe.artifacts import Progress, no_progress
from mrpipe.structures import Frame
from mrpipe.thesis.bench import Bench, bench_of_sets
from mrpipe.thesis.chapter2 import chapter_2
from mrpipe.thesis.chapter3 import chapter_3
from mrpipe.thesis.chapter4 import chapter_4
from mrpipe.thesis.chapter5 import chapter_5
from mrpipe.thesis.chapter6 import CaseOptions, chapter_6
from mrpipe.thesis.claim import Claim, Missing, Outcomes, judge
from mrpipe.thesis.entries import all_entries
from mrpipe.thesis.table51 import Case

CHAPTERS = (2, 3, 4, 5, 6)
_SHARES = {2: 0.0, 3: 0.08, 4: 0.1, 5: 0.15, 6: 0.75}
"""Share of the work that is done when a chapter begins."""


@dataclass(frozen=True)
class Ledger:
    """Every claim, and what explains Table 5.1.

    Attributes
    ----------
    claims
        Claims in the order of the entries.
    cases
        Cases of Table 5.1 by name; empty without chapter 5.
    """

    claims: tuple[Claim, ...]
    cases: Mapping[str, Case] = field(default_factory=dict)

    def claim(self, id: str) -> Claim:
        """Return the claim of an entry."""
        return next(claim for claim in self.claims if claim.id == id)


def _part_of(progress: Progress, start: float, stop: float) -> Progress:
    """Return a progress that runs from `start` to `stop` of another one."""

    def part(fraction: float, text: str = "") -> None:
        progress(start + fraction * (stop - start), text)

    return part


def build_ledger(
    bench: Bench,
    printed_frame: Frame,
    options: CaseOptions | None = None,
    chapters: tuple[int, ...] = CHAPTERS,
    progress: Progress = no_progress,
) -> Ledger:
    """Return the ledger.

    Parameters
    ----------
    bench
        A run, or parameter sets, that are compared with the thesis.
    printed_frame
        The printed frame with the signs of its mode matrix corrected: what the printed inputs give.
    options
        Options of the benchmark structures.
    chapters
        Chapters of the thesis, 2 to 6.
    progress
        Receives the share that is done.

    Raises
    ------
    ValueError
        If a chapter computes no outcome for an entry, or one for an entry that does not exist.
    """
    wanted = tuple(sorted(set(chapters)))
    outcomes: Outcomes = {}
    cases: Mapping[str, Case] = {}
    for place, chapter in enumerate(wanted):
        start = _SHARES[chapter]
        stop = _SHARES[wanted[place + 1]] if place + 1 < len(wanted) else 1.0

        part = _part_of(progress, start, stop)
        part(0.0, f"chapter {chapter}")
        if chapter == 2:
            outcomes |= chapter_2(bench)
        elif chapter == 3:
            outcomes |= chapter_3(bench, printed_frame)
        elif chapter == 4:
            outcomes |= chapter_4(bench, printed_frame)
        elif chapter == 5:
            found, cases = chapter_5(bench, bench_of_sets(printed_frame), part)
            outcomes |= found
        else:
            outcomes |= chapter_6(printed_frame, options or CaseOptions(), part)
    entries = [entry for entry in all_entries() if entry.chapter in wanted]
    # the delay of P5's filter belongs to chapter 2 and needs the closed loop of chapter 5
    if 5 not in wanted:
        outcomes.setdefault("F2-delay", Missing("it needs chapter 5 (reproduce.chapters)"))
    known = {entry.id for entry in all_entries()}
    if unknown := sorted(set(outcomes) - known):
        raise ValueError(f"no entry is named {', '.join(unknown)}")
    if lacking := [entry.id for entry in entries if entry.id not in outcomes]:
        raise ValueError(f"no module computes {', '.join(lacking)}")
    return Ledger(tuple(judge(entry, outcomes[entry.id]) for entry in entries), cases)
