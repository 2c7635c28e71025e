"""The verdict of a tracing as typed values, and the one place that turns them into JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

VerdictClass = Literal["noise", "explained", "partly explained", "unknown", "base form", "validation differs"]
"""What a verdict says of the validation tests.

`noise`: nothing is missing. `explained`: the named effects leave no more than noise, or than an honest ceiling.
`partly explained`: they lower the error, but less. `unknown`: something is missing and no effect explains it.
`base form`: another base form explains what is missing. `validation differs`: the validation tests differ from the
training tests by something that a model of the damper cannot learn from the training tests.
"""


@dataclass(frozen=True)
class Difference:
    """One way in which validation tests differ from the training tests.

    Attributes
    ----------
    kind
        `gain`, `lag`, `offset`, `drive`, `amplitude`, `speed`, `session`, or the name of a fault of a recording.
    tests
        Names of the validation tests.
    value, unit
        By how much: gain [1], lag [s], offset [N], share of the samples outside what training covers [1].
    sentence
        The same in words.
    """

    kind: str
    tests: tuple[str, ...]
    value: float
    unit: str
    sentence: str

    def as_json(self) -> dict[str, Any]:
        """Return the difference as JSON."""
        return {
            "kind": self.kind,
            "tests": list(self.tests),
            "value": self.value,
            "unit": self.unit,
            "sentence": self.sentence,
        }


@dataclass(frozen=True)
class Comparable:
    """Errors on the part of the validation tests that the training tests cover.

    Attributes
    ----------
    tests
        Names of the tests that have samples in this part.
    share
        Share of the compared samples [1].
    before, after
        NRMSE of the model without and with the named effects.
    corrected
        NRMSE with the model on all validation tests after gain, lag and offset of the odd tests are corrected; they
        are estimated from the first part of each record and judged on the rest. None if there is nothing to correct.
    """

    tests: tuple[str, ...]
    share: float
    before: float | None
    after: float | None
    corrected: float | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the errors as JSON."""
        return {
            "tests": list(self.tests),
            "share_of_samples": self.share,
            "nrmse_before": self.before,
            "nrmse_after": self.after,
            "nrmse_corrected": self.corrected,
        }


@dataclass(frozen=True)
class Verdict:
    """Class and sentence of a verdict.

    Attributes
    ----------
    kind
        The class.
    sentence
        The verdict in words.
    share
        Share of the recoverable squared error that the named effects or the base form remove on validation tests.
    differences
        How validation tests differ from training tests.
    comparable
        Errors on the comparable part, where validation tests differ.
    notes
        Further keys of `validation` in the JSON.
    """

    kind: VerdictClass
    sentence: str
    share: float = 0.0
    differences: tuple[Difference, ...] = ()
    comparable: Comparable | None = None
    notes: Mapping[str, Any] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the keys of the summary that hold the verdict."""
        found: dict[str, Any] = {"verdict": self.sentence, "verdict_class": self.kind, "share_explained": self.share}
        found["validation"] = {
            "differences": [item.as_json() for item in self.differences],
            "comparable": self.comparable.as_json() if self.comparable is not None else None,
            **self.notes,
        }
        return found
