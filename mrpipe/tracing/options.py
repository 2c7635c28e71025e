"""Options of a tracing: the section `close_loop` of the settings, and the options of the functions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import Field, ValidationInfo, field_validator

from mrpipe.artifacts.yaml_source import nearest
from mrpipe.dampers.forms import DEFAULT_FORM, form_names
from mrpipe.options import Section
from mrpipe.tracing.rules import TracingRules

IDENTIFIED = "identified"
"""Value of `model` that stands for the base form which `identify-damper` chose."""


class NamingRules(Section):
    """When an effect is named, and its confidence. All numbers are dimensionless."""

    named_share: float = Field(
        0.9,
        gt=0.5,
        le=1.0,
        description="Share of the recoverable residual that an effect must explain to be named as proven.",
    )
    least_share: float = Field(
        0.5, gt=0.0, lt=1.0, description="Share of the recoverable residual below which the cause is unknown."
    )
    lead: float = Field(
        0.3,
        ge=0.0,
        description="Families whose residual exceeds that of the best family by at most this share are tied with it.",
    )
    doubtful: float = Field(
        0.4,
        ge=0.0,
        le=1.0,
        description="Factor on the confidence of an effect whose gain on left-out tests is not significant.",
    )
    most_confidence: float = Field(
        0.99,
        gt=0.0,
        lt=1.0,
        description="Upper limit of the evidence, because a finite number of tests does not prove an effect with "
        "certainty.",
    )
    least_probability: float = Field(
        0.5,
        ge=0.0,
        lt=1.0,
        description="An effect with a smaller probability is not named; it remains in the model as a further term, "
        "whose cause is not proven.",
    )
    calibration: tuple[tuple[float, float], ...] = Field(
        ((0.0, 0.0), (0.5, 0.4), (0.75, 0.75), (0.95, 0.95), (1.0, 0.96)),
        description="Pairs of evidence and probability for an effect that is named alone; linear in between. The "
        "evidence is the share of bootstrap samples that need the effect, times the recovered shares. The probability "
        "that an effect with this evidence is present follows from the planted benchmark by the rule of succession, "
        "see docs/tracing-benchmark.md.",
    )
    calibration_of_several: tuple[tuple[float, float], ...] = Field(
        ((0.0, 0.0), (0.8, 0.17), (0.95, 0.75), (1.0, 0.75)),
        description="The same for each of several named effects, because one of them may only correct the form of "
        "another.",
    )
    calibration_of_part: tuple[tuple[float, float], ...] = Field(
        ((0.0, 0.0), (0.5, 0.4), (0.75, 0.63), (1.0, 0.63)),
        description="The same for an effect that is named alone but explains only part of what is missing: on the "
        "planted benchmark 4 of 6 such effects were there, the others were shapes outside the library.",
    )
    noise_share: float = Field(
        0.1,
        ge=0.0,
        description="Differences below this share of the noise do not separate two families, because the noise is not "
        "known more accurately.",
    )

    @field_validator("calibration", "calibration_of_several", "calibration_of_part")
    @classmethod
    def _calibration_rises(cls, value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        evidence, probability = zip(*value, strict=True) if value else ((), ())
        ordered = list(evidence) == sorted(set(evidence)) and list(probability) == sorted(probability)
        if len(value) < 2 or not ordered or not all(0.0 <= item <= 1.0 for pair in value for item in pair):
            raise ValueError("needs at least two pairs of numbers from 0 to 1; both must rise")
        return value


class TracingSettings(NamingRules):
    """From the residual of a model to the effect that it lacks."""

    form_files: tuple[Path, ...] = Field(
        (), description="Your Python files, each of which defines one more base form as FORM."
    )
    model: str = Field(
        IDENTIFIED,
        description="Declared base form. identified: the form that identify-damper chose. Otherwise the name of a "
        "form of mrpipe/dampers/forms; rate-dependent-yield stands for yielding-part, the form of this family that "
        "suits most recordings. Other base forms are compared with the declared one.",
    )
    yield_order: int = Field(3, ge=0, le=3, description="Degree of the yield force in the drive.")
    viscosity_order: int = Field(1, ge=0, le=3, description="Degree of the viscosity in the drive.")
    most_effects: int = Field(3, ge=0, le=3, description="Largest number of effects that are named together.")
    base_forms: tuple[str, ...] = Field(
        (), description="Base forms that are tried in addition to the declared one; empty: all forms of the library."
    )
    fit_rate_hz: float = Field(
        250.0,
        gt=0.0,
        description="Rate at which candidates are fitted [Hz]; twice or four times "
        "as fast where the chosen model then leaves clearly less.",
    )
    displacement_cutoff_hz: float = Field(
        0.0,
        ge=0.0,
        description="Cut-off frequency of the zero-phase low-pass of the displacement [Hz]; 0: chosen for each test.",
    )
    refits: int = Field(8, ge=1, description="Number of the best families after screening that are refitted jointly.")
    folds: int = Field(3, ge=2, description="Number of folds of the cross-validation over whole training tests.")
    bootstrap_draws: int = Field(400, ge=50, description="Number of draws of the block bootstrap.")
    record_gain: bool = Field(
        False,
        description="Whether a gain of each validation record is fitted, for sessions with another gain of the load "
        "cell.",
    )
    observation_filter: bool = Field(
        True,
        description="Whether a moving average by the recorder is searched, with a length that is a share of the "
        "period.",
    )
    model_error_share: float = Field(
        0.0,
        ge=0.0,
        lt=1.0,
        description="Model error by which samples are weighted, as a share of the RMS force, if it is known to exceed "
        "the noise of the sensors, as for real dampers. 0: it is estimated by a first pass, which doubles the run "
        "time.",
    )
    rules: TracingRules = Field(TracingRules(), description="Thresholds of the decisions.")
    unattributed: bool = Field(
        False, description="Whether a flexible residual model is added as the effect `unattributed`."
    )

    @field_validator("model", "base_forms")
    @classmethod
    def _forms_are_known(cls, value: str | tuple[str, ...], info: ValidationInfo) -> str | tuple[str, ...]:
        # a file of the user may define any name: it is read when the stage is checked
        if info.data.get("form_files"):
            return value
        known = (*form_names(), *(("rate-dependent-yield", IDENTIFIED) if isinstance(value, str) else ()))
        for name in (value,) if isinstance(value, str) else value:
            if name not in known:
                raise ValueError(f"no base form {name!r}; {nearest(name, known)}")
        return value


class TracingOptions(TracingSettings):
    """How a campaign is traced: the settings with the declared base form by name, and the unit of the drive."""

    model: str = Field(DEFAULT_FORM, description="Declared base form.")
    drive_unit: str = Field("", description="Unit of the drive, A or V. A tracing sets it to that of its tests.")


def tracing_options(
    settings: TracingSettings, form_files: Sequence[Path] = (), identified: str = DEFAULT_FORM
) -> TracingOptions:
    """Return the options of a tracing, on a bench or of a structure.

    Parameters
    ----------
    settings
        Section `close_loop` of the settings.
    form_files
        Files of the user that define base forms with which the damper was identified; these forms are tried in the
        tracing too.
    identified
        Base form that `identify-damper` chose.
    """
    values = {name: getattr(settings, name) for name in TracingSettings.model_fields}
    values["form_files"] = tuple(dict.fromkeys([*settings.form_files, *form_files]))
    if settings.model == IDENTIFIED:
        values["model"] = identified
    return TracingOptions(**values)
