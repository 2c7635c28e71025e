"""A printed figure or statement, what it comes to here, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from mrpipe.thesis.entries import Entry
from mrpipe.words import in_percent

Number = float | Sequence[float] | str
Verdict = Literal["holds", "differs", "cannot-be-recomputed"]


@dataclass(frozen=True)
class Value:
    """A recomputed value.

    Attributes
    ----------
    value
        A number, a list of numbers, or words.
    by
        A clause that says how it was computed: from which part of the run or from which parameter sets.
    why
        Reason for a deviation, if the computation knows more than the entry says.
    """

    value: Any
    by: str
    why: str = ""


@dataclass(frozen=True)
class Missing:
    """Why a value was not recomputed."""

    reason: str


Outcome = Value | Missing
Outcomes = dict[str, Outcome]


@dataclass(frozen=True)
class Claim:
    """An entry and the recomputed value.

    Attributes
    ----------
    entry
        The number that is compared, and how.
    recomputed
        Number, list of numbers or words; None where there is none.
    verdict
        `holds`, `differs` or `cannot-be-recomputed`.
    why
        Why it differs, or why it cannot be recomputed; empty where it holds.
    by
        A clause that says how it was recomputed.
    """

    entry: Entry
    recomputed: Any
    verdict: Verdict
    why: str
    by: str

    @property
    def id(self) -> str:
        """Id of the entry."""
        return self.entry.id

    @property
    def printed(self) -> Any:
        """Printed value; for a statement the rule in words."""
        return rule_text(self.entry.rule) if self.entry.rule else _plain(self.entry.printed)

    def as_dict(self) -> dict[str, Any]:
        """Return the claim as `mrpipe reproduce --json` prints it."""
        entry = self.entry
        return {
            "id": entry.id,
            "chapter": entry.chapter,
            "kind": entry.kind,
            "what": entry.what,
            "place": entry.place,
            "printed": self.printed,
            "recomputed": self.recomputed,
            "tolerance": entry.tolerance,
            "verdict": self.verdict,
            "why": self.why,
            "by": self.by,
        }


def rule_text(rule: Mapping[str, Any]) -> str:
    """Return a rule in words."""
    ((name, bound),) = rule.items()
    if name == "between":
        return f"between {bound[0]:g} and {bound[1]:g}"
    if name == "one_of":
        return " or ".join(str(item) for item in bound)
    return f"{name} {bound:g}"


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, str):
        return value
    array = np.asarray(value, dtype=np.float64)
    return float(array) if array.ndim == 0 else [float(item) for item in array.ravel()]


def deviation(printed: Any, recomputed: Any) -> float:
    """Return the largest relative deviation of recomputed from printed numbers (infinite for unequal sizes).

    A printed zero is compared absolutely.
    """
    first = np.atleast_1d(np.asarray(printed, dtype=np.float64)).ravel()
    second = np.atleast_1d(np.asarray(recomputed, dtype=np.float64)).ravel()
    if first.size != second.size or not np.all(np.isfinite(second)):
        return float("inf")
    return float(np.max(np.abs(second - first) / np.where(first == 0.0, 1.0, np.abs(first))))


def keeps(rule: Mapping[str, Any], value: Any) -> bool:
    """Return whether a recomputed value keeps a rule: every number of it, and no value keeps it if it is not finite."""
    ((name, bound),) = rule.items()
    if name == "one_of":
        return value in bound
    numbers = np.atleast_1d(np.asarray(value, dtype=np.float64))
    if not np.all(np.isfinite(numbers)):
        return False
    if name == "between":
        return bool(np.all((numbers >= bound[0]) & (numbers <= bound[1])))
    return bool(np.all(numbers < bound) if name == "below" else np.all(numbers > bound))


def judge(entry: Entry, outcome: Outcome) -> Claim:
    """Return the claim of an entry with its verdict.

    Parameters
    ----------
    entry
        The printed number, with tolerance or rule.
    outcome
        The recomputed value, or why there is none.
    """
    if entry.given:
        why = "it sets the amplitude of the excitation, so that a recomputed value could not disagree"
        return Claim(entry, None, "cannot-be-recomputed", why, "")
    if isinstance(outcome, Missing):
        return Claim(entry, None, "cannot-be-recomputed", outcome.reason, "")
    value = _plain(outcome.value)
    said = ""
    if entry.rule:
        agrees = keeps(entry.rule, value)
        said = f"not {rule_text(entry.rule)}"
    elif entry.tolerance is None:
        agrees = value == _plain(entry.printed)
        said = "other words"
    else:
        apart = deviation(entry.printed, value)
        agrees = apart <= entry.tolerance
        said = f"deviates by {in_percent(apart, digits=3)}"
    why = "" if agrees else "; ".join(part for part in (said, outcome.why, entry.reason) if part)
    return Claim(entry, value, "holds" if agrees else "differs", why, outcome.by)
