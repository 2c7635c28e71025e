"""When forward selection adds an effect, names it, and takes a richer form of it."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section
from mrpipe.tracing.rules.validation import ValidationRules


class SelectionRules(Section):
    """When forward selection adds an effect, and when it is named. All numbers are dimensionless."""

    nothing_missing: float = Field(
        0.2,
        ge=0.0,
        description="Nothing is missing if the chi-square exceeds that of the noise by less than this share of it; the "
        "noise is known to about a fifth.",
    )
    gain: float = Field(
        0.05, ge=0.0, description="A further effect must recover this share of what the base model lacks."
    )
    clear_floors: float = Field(
        2.0,
        ge=1.0,
        description="A smaller share than `gain` is sufficient if it alone would raise the error from one noise floor "
        "to this multiple of it.",
    )
    term_share: float = Field(
        0.25,
        ge=0.0,
        description="A term that recovers this share of the remaining residual is kept, because it improves the model.",
    )
    named_share: float = Field(
        0.5,
        ge=0.0,
        description="A further term is named as an effect if it recovers this share of the remaining residual.",
    )
    lead: float = Field(
        1.25,
        ge=1.0,
        description="It is named only if the residual of every other family is at least this multiple of the "
        "residual of the named one.",
    )
    contender_share: float = Field(
        0.3,
        ge=0.0,
        description="Forms that leave more than the best draft by this share of its gain are not fitted to all tests.",
    )
    further: float = Field(
        0.15,
        ge=0.0,
        description="If less than this share remains, and the error is below `near_floors` noise floors, a further "
        "effect must promise its share in screening.",
    )
    near_floors: float = Field(
        ValidationRules().within_floors,
        ge=1.0,
        description="From this multiple of the noise floor on, further effects are always fitted, because the error "
        "is larger than that of a model that explains the tests. Screening is linear and sees too little of an effect "
        "whose shape is not among its starts.",
    )
    better_optimum: float = Field(
        0.03,
        ge=0.0,
        description="A fit that leaves less than another fit of the same terms by this share shows that the other had "
        "not converged.",
    )
    main_part: float = Field(
        0.2,
        ge=0.0,
        description="The main part of a form with corrections of either sign must be this share of the largest one.",
    )
    per_parameter: float = Field(
        0.01,
        ge=0.0,
        description="Penalty on the chi-square for each parameter of a form, relative, so that the simpler of two "
        "forms that fit alike is taken.",
    )
    same: float = Field(
        0.05,
        ge=0.0,
        description="Differences below this share of the noise do not separate the families of one round.",
    )


BY_FORCE = SelectionRules(gain=0.02, term_share=0.06, named_share=0.25, lead=1.0)
"""Numerical technique: defaults for weights relative to the RMS force: no model reaches the noise."""


class RefinementRules(Section):
    """When a richer form of a named effect is taken. All numbers are dimensionless."""

    worth_a_try: float = Field(
        0.1,
        ge=0.0,
        description="The plain form is sufficient if the chi-square exceeds that of the noise by less than this share.",
    )
    least_gain: float = Field(
        0.05,
        ge=0.0,
        description="A richer form must lower the squared error on left-out tests by this share.",
    )
