"""The small family of exceptions that the program raises on purpose.

Every message is one line that names the file, the key or row, what is wrong and what would be right.
"""

from __future__ import annotations

from pathlib import Path

from mrpipe.words import shortest


class MrpipeError(Exception):
    """Base of everything that mrpipe raises on purpose."""


class UserError(MrpipeError):
    """The user's input is wrong (exit status 2).

    Parameters
    ----------
    source
        The file, directory or command-line option at fault; a path within the working directory is shown relative to
        it.
    where
        Key, row, column or test within it; empty where the whole source is meant.
    problem
        A clause that says what is wrong.
    remedy
        A clause that says what would be right.
    """

    def __init__(self, source: str | Path, where: str, problem: str, remedy: str) -> None:
        self.source = shortest(source)
        self.where = where
        self.problem = problem
        self.remedy = remedy
        place = f"{self.source}: {where}" if where else self.source
        super().__init__(" ".join(f"{place}: {problem}; {remedy}".split()))

    def __reduce__(self) -> tuple[type[UserError], tuple[str, str, str, str]]:
        """Return how a copy is made: a process sends its errors to another one."""
        return type(self), (self.source, self.where, self.problem, self.remedy)


class CheckFailed(MrpipeError):
    """The program ran, but a requested check failed (exit status 1)."""


class StagesRefused(CheckFailed):
    """Stages refused the user's input, after the results of the others were printed (exit status 2)."""


class StageSkipped(MrpipeError):
    """A stage has no data to work on; the message says which (no failure in `mrpipe run`)."""


class StageFailed(MrpipeError):
    """A stage cannot be built because one that it needs has failed in this run."""


class DivergedError(MrpipeError):
    """A fit or a simulation diverged; the message says where and what to try."""


def install_extra(extra: str) -> str:
    """Return how to install an optional extra of mrpipe, for the remedy of an error."""
    return f"pip install 'mrpipe[{extra}]', in a checkout pip install -e '.[{extra}]'"
