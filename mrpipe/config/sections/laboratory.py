"""Settings of the virtual rig (`record`)."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from mrpipe.control.laws import known_law
from mrpipe.laboratory.options import BenchRig, CustomTest, FrameRig, LoopRig
from mrpipe.options import Section


class PlantedEffect(Section):
    """An effect of the true damper."""

    name: str = Field(description="Name of the effect, as in docs/effects.md; `unfamiliar` for shapes of no family.")
    form: str = Field("", description="Which functional form; empty for the first one.")
    strength_share: float | None = Field(
        None, gt=0.0, lt=2.0, description="RMS of the effect over RMS of the force; scales the form's first number."
    )
    parameters: dict[str, float] = Field(
        default_factory=dict, description="Numbers of the form in SI; those left out take the form's own."
    )


class BenchSettings(BenchRig):
    """The bench campaign."""

    plan: str = Field(
        "table-2.1",
        description="`table-2.1`, `compact` (44 short tests with different motions), `discriminating` (tests that "
        "separate similar effects), several joined by +, or `custom` (the tests listed alone).",
    )
    tests: tuple[CustomTest, ...] = Field((), description="Tests in addition to the plan.")
    cycles: int = Field(10, ge=2, description="Steady cycles of each test of Table 2.1.")
    short_test_s: float = Field(5.0, gt=1.0, description="Duration of a test of the compact plan [s].")
    data_format: Literal["h5", "csv"] = Field("h5", description="Format of the data files.")


class FrameSettings(FrameRig):
    """The frame campaign on the shaking table."""

    structure: str = Field("thesis", description="Parameter set of the true frame (configs/frames, or a YAML file).")
    random_floors: int = Field(
        0, ge=0, le=12, description="Draw a shear frame of so many floors from the seed instead; 0 takes the set."
    )
    declared_effects: tuple[PlantedEffect, ...] = Field(
        (), description="Effects of the true structure that campaign.yaml names."
    )
    hidden_effects: tuple[PlantedEffect, ...] = Field(
        (), description="Effects of the true structure (joint-friction, cubic-stiffness, ...) that it keeps back."
    )


class ClosedLoopSettings(LoopRig):
    """The closed-loop campaign on the shaking table."""

    laws: tuple[str, ...] = Field(
        ("vd", "vdps", "vdns", "fdns", "passive-off", "passive-on"), min_length=1, description="Control laws recorded."
    )

    @field_validator("laws")
    @classmethod
    def _known(cls, laws: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(known_law(law) for law in laws)


class LaboratorySettings(Section):
    """The virtual rig: one damper, its bench, the frame, the shaking table."""

    damper: str = Field("set-c", description="Parameter set of the true damper (configs/dampers, or a YAML file).")
    declared_effects: tuple[PlantedEffect, ...] = Field(
        (PlantedEffect(name="backlash", form="held", parameters={"gap": 15e-6}),),
        description="Effects of the true damper that campaign.yaml names.",
    )
    hidden_effects: tuple[PlantedEffect, ...] = Field(
        (
            PlantedEffect(
                name="remanence",
                form="relaxing",
                parameters={"share": 0.9, "saturation": 3.0, "fade_time": 0.4, "fade_slip": 0.04},
            ),
        ),
        description="Effects of the true damper that campaign.yaml does not declare; they are stored in a separate "
        "file that no estimator reads.",
    )
    draw_hidden_share: float | None = Field(
        None, gt=0.0, lt=1.0, description="Draw one more hidden effect from the seed, of this share of the force RMS."
    )
    vary_damper: float = Field(
        0.0, ge=0.0, le=0.5, description="Log-normal spread by which the damper departs from its set (0: as printed)."
    )
    bench: BenchSettings = Field(BenchSettings(), description="The bench campaign.")
    frame: FrameSettings = Field(FrameSettings(), description="The frame campaign.")
    closed_loop: ClosedLoopSettings = Field(ClosedLoopSettings(), description="The closed-loop campaign.")
