"""One printed figure, the recomputed value, and the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

Number = float | Sequence[float] | str
Verdict = Literal["holds", "differs", "cannot-be-recomputed"]


@dataclass(frozen=True)
class Claim:
    """A printed figure and the recomputed one.

    Attributes
    ----------
    id
        `A4b` is the second claim of row 4 in the list of errata, section A; `B…` is of section B.
    chapter
        Of the thesis; papers stand with the chapter that uses them.
    what
        What is compared, with its unit.
    printed, recomputed
        Numbers, lists of numbers or words; None if there is no value.
    tolerance
        Relative, largest over a list; None where words are compared.
    verdict, why
        `holds`, `differs` (why it does), `cannot-be-recomputed` (why not).
    """

    id: str
    chapter: int
    what: str
    printed: Any
    recomputed: Any
    tolerance: float | None
    verdict: Verdict
    why: str

    def as_dict(self) -> dict[str, Any]:
        """Return the claim as `mrpipe reproduce --json` prints it."""
        return {
            "id": self.id,
            "chapter": self.chapter,
            "what": self.what,
            "printed": self.printed,
            "recomputed": self.recomputed,
            "tolerance": self.tolerance,
            "verdict": self.verdict,
            "why": self.why,
        }


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, str):
        return value
    array = np.asarray(value, dtype=np.float64)
    return float(array) if array.ndim == 0 else [float(item) for item in array.ravel()]


def deviation(printed: Any, recomputed: Any) -> float:
    """Return the largest relative deviation of recomputed from printed numbers (infinite for unequal sizes)."""
    first = np.atleast_1d(np.asarray(printed, dtype=np.float64)).ravel()
    second = np.atleast_1d(np.asarray(recomputed, dtype=np.float64)).ravel()
    if first.size != second.size or not np.all(np.isfinite(second)):
        return float("inf")
    return float(np.max(np.abs(second - first) / np.maximum(np.abs(first), 1e-300)))


def compare(
    id: str, chapter: int, what: str, printed: Any, recomputed: Any, tolerance: float | None, why: str = ""
) -> Claim:
    """Return a claim with its verdict: `holds` where the recomputed value is within the tolerance.

    Parameters
    ----------
    id, chapter, what
        See :class:`Claim`.
    printed, recomputed
        A number, a list of numbers, or words (then compared as they are, `tolerance` None).
    tolerance
        Relative.
    why
        Why the two differ; a note where they do not. Where nothing is said the deviation stands for it.
    """
    if tolerance is None:
        agrees = _plain(printed) == _plain(recomputed)
        said = why
    else:
        apart = deviation(printed, recomputed)
        agrees = apart <= tolerance
        said = why or ("" if agrees else f"deviates by {100 * apart:.3g} %")
    verdict: Verdict = "holds" if agrees else "differs"
    return Claim(id, chapter, what, _plain(printed), _plain(recomputed), tolerance, verdict, said)


def cannot(id: str, chapter: int, what: str, printed: Any, why: str) -> Claim:
    """Return a claim that nothing printed or published allows to recompute."""
    return Claim(id, chapter, what, _plain(printed), None, None, "cannot-be-recomputed", why)
