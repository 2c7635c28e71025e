"""The class of a verdict on a frame, and its sentence, which fixed rules derive from errors and shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mrpipe.tracing.gain import recovered_share
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.rules import ValidationRules
from mrpipe.tracing.structure.drift import StiffnessBetweenTests
from mrpipe.tracing.structure.on_validation import DifferingTest, in_words
from mrpipe.tracing.structure.rounds import FrameSelection
from mrpipe.tracing.structure.sensor_faults import SensorFault
from mrpipe.tracing.structure.ties import Tie, tie_below_noise
from mrpipe.tracing.verdict import NamedEffect, Verdict
from mrpipe.words import listed


@dataclass(frozen=True)
class Errors:
    """NRMSE of the storey forces on the validation tests.

    Attributes
    ----------
    before, after
        Of the linear frame, and of the frame with the named effects.
    floor
        Of noise alone.
    flexible
        Of the linear frame with a flexible model of its residual.
    """

    before: float
    after: float
    floor: float
    flexible: float

    @property
    def ceiling(self) -> float:
        """Lowest NRMSE that any model has reached."""
        return min(self.flexible, self.after)

    @property
    def recovered(self) -> float:
        """Share of the squared error beyond the ceiling that the named effects remove, 0 to 1."""
        return recovered_share(self.before, self.after, self.ceiling)

    def explained(self, rules: ValidationRules) -> bool:
        """Return whether the named effects reach the noise floor, or most of what a flexible model reaches.

        Where the flexible model is worse than the effects, it does not show how much of the error can be explained.
        """
        if self.after >= self.before:
            return False
        if self.after <= rules.within_floors * self.floor:
            return True
        return self.flexible <= self.after and self.recovered >= rules.ceiling_share


def why_unnamed(selection: FrameSelection, rules: NamingRules, fault: SensorFault | None = None) -> str:
    """Return why no effect is named; empty if the chosen effects are named.

    Parameters
    ----------
    selection
        Linear frame and effects, as chosen on the training records.
    rules
        Rules for naming an effect.
    fault
        Fault of a sensor that explains a part of the residual; None if there is none. If it explains more than the
        effects, they may only imitate it.
    """
    if not selection.structured:
        return "the residual is noise: nothing is missing"
    if selection.below_noise is not None and not selection.chosen:
        return _undecided(selection)
    if len(selection.chosen) <= selection.declared:
        return "no effect of the library changes the error"
    if selection.share(selection.residual) < rules.least_share:
        return "no effect of the library recovers enough of what exceeds the noise"
    if fault and fault.explained > selection.share(selection.residual):
        names = listed([item.name for item in selection.chosen[selection.declared :]])
        return f"{fault.sentence()}: this would explain more of the residual than {names}, but not all of it"
    return ""


def _undecided(selection: FrameSelection) -> str:
    """Return why no effect is named for a residual that is smaller than the noise of each line."""
    small = "something smaller than the noise of each spectral line depends on the motion"
    if tie := tie_below_noise(selection):
        return f"{small}; {tie.sentence('it')}"
    alike = selection.below_noise.alike if selection.below_noise else ()
    return f"{small}; {alike[0]} explains only part of it"


@dataclass(frozen=True)
class Judgement:
    """Data that decide the verdict.

    Attributes
    ----------
    selection
        Linear frame and effects, as chosen on the training records.
    named
        The named effects.
    reason
        Why no effect is named; empty if some are.
    errors
        Errors on the validation tests.
    between
        Changes of the stiffness between tests.
    differing
        Validation tests that differ from the training tests.
    naming
        Rules for naming an effect.
    validation
        Rules for the class of the verdict.
    tie
        Effects that explain equally well what the named ones leave; None if these tests separate all effects.
    """

    selection: FrameSelection
    named: Sequence[NamedEffect]
    reason: str
    errors: Errors
    between: StiffnessBetweenTests
    differing: Sequence[DifferingTest]
    naming: NamingRules
    validation: ValidationRules
    tie: Tie | None = None

    @property
    def share(self) -> float:
        """Share of what is missing on the training tests that the named effects explain [1]."""
        return self.selection.share(self.selection.residual) if self.named else 0.0

    @property
    def proven(self) -> bool:
        """Whether the named effects explain what is missing, on the training and on the validation tests."""
        return self.share >= self.naming.named_share and self.errors.explained(self.validation)

    @property
    def open_tie(self) -> Tie | None:
        """Effects that explain equally well what is missing; None if the named effects explain it already."""
        return None if self.proven else self.tie

    def verdict(self) -> Verdict:
        """Return class and sentence."""
        # if the stiffness changed between tests, the residual also contains this change, which no effect explains
        drift = f"; {self.between.sentence()}" if self.between.drifts else ""
        structured = self.selection.structured
        if self.differing and not structured:
            lacks = f"the training tests lack nothing, but {in_words(self.differing)}"
            return Verdict("validation differs", f"{lacks}{drift}")
        if self.reason:
            return Verdict("unknown" if structured else "noise", f"{self.reason}{drift}")
        names = listed([f"{item.name} ({item.place})" for item in self.named])
        if self.open_tie:
            drift = f"; {self.open_tie.sentence('what then remains')}{drift}"
        if self.differing:
            form = f"explains what the training tests lack, but {in_words(self.differing)}"
            return Verdict("partly explained", f"{names}: {form}{drift}", self.share)
        if self.proven:
            below = self.selection.below_noise is not None
            small = ", which is smaller than the noise of each spectral line" if below else ""
            return Verdict("explained", f"{names}: explains what is missing{small}{drift}", self.share)
        return Verdict("partly explained", f"{names}: {self._part()}{drift}", self.share)

    def _part(self) -> str:
        """Return what the named effects leave."""
        errors = self.errors
        if self.share < self.naming.named_share:
            return "explains part of what is missing; its form is not proven"
        if errors.after >= errors.before:
            return "explains what the training tests lack, but does not lower the error of the validation tests"
        ratio = errors.after / max(errors.floor, 1e-300)
        return (
            f"explains most of what is missing; the error on the validation tests is still {ratio:.2g} times the noise"
        )
