"""The tests of a structure that are proposed: kind, control law, mode and role of each file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from mrpipe.campaigns.proposal.columns import Guess
from mrpipe.campaigns.proposal.found import FoundFile, ProposedTests
from mrpipe.campaigns.proposal.kinds import GAINS, GUESSED_BY_FORCE, kind_of, kind_of_record, law_of, mode_of
from mrpipe.campaigns.proposal.roles import propose_frame_roles
from mrpipe.campaigns.proposal.text import TestText
from mrpipe.words import counted, some

BENCH_TEST = "looks like a bench test of a damper"
"""Doubt about a test that has a damper force and a single motion."""

_BENCH_TESTS = (
    "look like bench tests of a damper, because they hold a force and one displacement, and no other motion. If they "
    "are, propose them again in a new directory with --rig bench, or with --rig both if other files are tests of a "
    "structure"
)


def frame_tests(files: Sequence[FoundFile], folder: Path, shared: Mapping[str, Guess]) -> ProposedTests:
    """Return the tests of a structure.

    Parameters
    ----------
    files
        Files with their channels.
    folder
        Folder that all of them lie in.
    shared
        Channels of the campaign.
    """
    kinds = [
        kind_of_record(item.samples_of_channels())
        if item.file.accelerations
        else kind_of(item.path, item.samples_of_channels(), item.rate)
        for item in files
    ]
    roles = propose_frame_roles([item.path for item in files], [kind for kind, _ in kinds])
    tests, notes = [], _Notes()
    of_a_bench = []
    for item, (kind, guessed), role in zip(files, kinds, roles, strict=True):
        name, law, missing = item.test_name(folder), "", ""
        doubt = f"kind {kind}, {guessed}" if guessed else ""
        if guessed == GUESSED_BY_FORCE and _looks_like_bench(item):
            of_a_bench.append(name)
            guessed = BENCH_TEST
        else:
            law = law_of(item.path) if kind == "closed-loop" else ""
            missing = _missing(kind, law)
            notes.add(name, doubt)
            notes.add(name, missing)
        tests.append(
            TestText(
                name=name,
                file=item.path.relative_to(folder).as_posix(),
                channels=item.own(shared),
                role="validation" if role == "validation" else "",
                kind=kind,
                law=law,
                mode=mode_of(item.path) if kind == "free-decay" else None,
                doubt="; ".join(text for text in (guessed, missing) if text),
            )
        )
    lines = [f"{counted(len(of_a_bench), 'test')} ({some(of_a_bench)}) {_BENCH_TESTS}"] if of_a_bench else []
    lines += [*notes.lines(), "frame: floor_masses_kg is not known; write the masses where they are known"]
    unvalidated = "no test repeats another, so none validates; close-loop needs a test with role validation"
    why = "kinds from the names of the files where they state them"
    return ProposedTests(tests, why, lines, "" if "validation" in roles else unvalidated)


def _looks_like_bench(item: FoundFile) -> bool:
    """Return whether the only motion is one displacement: a structure has a ground, or several floors."""
    motion = [key for key in item.layout.channels if key.startswith(("floor_", "ground_", "input_force"))]
    return len(motion) == 1 and motion[0].startswith("floor_displacement")


def _missing(kind: str, law: str) -> str:
    """Return what a closed-loop test does not state; empty for other kinds."""
    if kind == "closed-loop" and not law:
        return "the control law is not known; write law: vd, or another one"
    if law and GAINS[law]:
        gains = ", ".join(f"{gain}: ..." for gain in GAINS[law])
        return f"the gains of law {law} are not known; write gains: {{{gains}}}"
    return ""


class _Notes:
    """Open questions; tests with the same question share a line."""

    def __init__(self) -> None:
        self._names: dict[str, list[str]] = {}

    def add(self, test: str, question: str) -> None:
        """Add a question about a test, unless it is empty."""
        if question:
            self._names.setdefault(question, []).append(test)

    def lines(self) -> list[str]:
        """Return a line for each question."""
        return [
            f"test {names[0]}: {question}"
            if len(names) == 1
            else f"{counted(len(names), 'test')} ({some(names)}): {question}"
            for question, names in self._names.items()
        ]
