"""The class of a verdict, which fixed rules derive from errors on the validation tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mrpipe.tracing.gain import recovered_share
from mrpipe.tracing.rules import ValidationRules
from mrpipe.tracing.verdict import VerdictClass


@dataclass(frozen=True)
class Condition:
    """Errors on one validation test; all are NRMSE.

    Attributes
    ----------
    name
        Name of the test.
    before, after
        NRMSE of the model without and with the effects that were found.
    floor
        NRMSE of noise alone.
    ceiling, ceiling_upper
        NRMSE of a flexible model that was trained on a part of this test, and the upper end of its 95 % interval.
    """

    name: str
    before: float
    after: float
    floor: float
    ceiling: float
    ceiling_upper: float

    def explained(self, rules: ValidationRules) -> bool:
        """Return whether the error on this test does not exceed that of noise or that of a flexible model."""
        if self.after <= max(rules.within_floors * self.floor, self.ceiling_upper):
            return True
        return recovered_share(self.before, self.after, self.ceiling) >= rules.ceiling_share


@dataclass(frozen=True)
class Evidence:
    """Data that decide the class; errors are NRMSE pooled over the comparable part of the validation tests.

    Attributes
    ----------
    before, after, floor, ceiling
        See :class:`Condition`.
    conditions
        The validation tests one by one.
    structured
        Whether the residual of the training tests contains more than noise.
    effects
        Whether effects are named.
    base_changed
        Whether another base form than the declared one is taken.
    events, disturbance
        NRMSE of single events, and of a force that grows with the speed; neither repeats when motion and drive repeat.
    """

    before: float
    after: float
    floor: float
    ceiling: float
    conditions: tuple[Condition, ...]
    structured: bool
    effects: bool
    base_changed: bool = False
    events: float = 0.0
    disturbance: float = 0.0

    def unrepeatable(self, rules: ValidationRules) -> bool:
        """Return whether most of the error beyond noise is due to forces that do not repeat.

        No model of motion and drive can predict such forces, so a ceiling does not show that nothing is missing.
        """
        excess = self.after**2 - self.floor**2
        unrepeated = self.events**2 + self.disturbance**2
        return self.after > rules.noise_floors * self.floor and unrepeated >= rules.accounts * excess

    @property
    def share(self) -> float:
        """Share of the recoverable squared error that the named effects remove, 0 to 1."""
        return recovered_share(self.before, self.after, self.ceiling)


def lowest_error(ceiling: float, interval: tuple[float, float], after: float) -> tuple[float, tuple[float, float]]:
    """Return the lowest error that any model has reached, and its 95 % interval.

    Parameters
    ----------
    ceiling, interval
        NRMSE of a flexible model, and its 95 % interval.
    after
        NRMSE of the final model. Where it is lower than that of the flexible model, it is the lowest error.
    """
    lowest = min(ceiling, after)
    return lowest, (min(interval[0], lowest), max(interval[1], lowest))


def classify(evidence: Evidence, rules: ValidationRules) -> VerdictClass:
    """Return the class of the comparable part of the validation tests."""
    better = evidence.after < evidence.before
    if not evidence.effects and not evidence.base_changed:
        quiet = evidence.after <= rules.noise_floors * evidence.floor and all(
            item.after <= rules.noise_floors * max(item.floor, evidence.floor) for item in evidence.conditions
        )
        return "noise" if quiet and not evidence.structured else "unknown"
    if not better:
        return "unknown"
    explained = reaches_floor_or_ceiling(evidence, rules)
    if evidence.base_changed and not evidence.effects:
        accounts = evidence.share >= rules.accounts and not evidence.unrepeatable(rules)
        # a ceiling far above the noise only shows the limit of flexible models of motion and drive
        beyond = evidence.structured and evidence.after > rules.noise_floors * evidence.floor
        return "base form" if (explained or accounts) and not beyond else "unknown"
    return "explained" if explained else "partly explained"


def reaches_floor_or_ceiling(evidence: Evidence, rules: ValidationRules) -> bool:
    """Return whether the error is at the noise floor, or at the ceiling on every validation test."""
    if evidence.after <= rules.within_floors * evidence.floor:
        return True
    if evidence.unrepeatable(rules):
        return False
    return bool(evidence.conditions) and all(item.explained(rules) for item in evidence.conditions)


def unexplained_tests(conditions: Sequence[Condition], rules: ValidationRules) -> tuple[str, ...]:
    """Return the names of the tests on which the error is not explained, the worst first."""
    open_ = [item for item in conditions if not item.explained(rules)]
    return tuple(item.name for item in sorted(open_, key=lambda item: -item.after))
