"""Settings of the virtual rig (`record`)."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from mrpipe.control.laws import known_law
from mrpipe.laboratory.options import BenchRig, CustomTest, FrameRig, LoopRig
from mrpipe.options import Section


class PlantedEffect(Section):
    """An effect of the true damper."""

    name: str = Field(
        description="Name of the effect, as in docs/effects.md; `unfamiliar` for shapes that belong to no effect of "
        "the library."
    )
    form: str = Field("", description="Form of the effect; empty: the first one.")
    strength_share: float | None = Field(
        None,
        gt=0.0,
        lt=2.0,
        description="RMS of the effect over RMS of the force; it scales the first parameter of the form.",
    )
    parameters: dict[str, float] = Field(
        default_factory=dict,
        description="Parameters of the form in SI; parameters that are left out have the values of the form.",
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
        0,
        ge=0,
        le=12,
        description="Number of floors of a shear frame that is drawn at random from the seed; 0: the parameter set is "
        "used.",
    )
    declared_effects: tuple[PlantedEffect, ...] = Field(
        (), description="Effects of the true structure that campaign.yaml names."
    )
    hidden_effects: tuple[PlantedEffect, ...] = Field(
        (),
        description="Effects of the true structure (joint-friction, cubic-stiffness, ...) that campaign.yaml does not "
        "declare.",
    )


class ClosedLoopSettings(LoopRig):
    """The closed-loop campaign on the shaking table."""

    laws: tuple[str, ...] = Field(
        ("vd", "vdps", "vdns", "fdns", "passive-off", "passive-on"),
        min_length=1,
        description="Control laws that are recorded.",
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
        None,
        gt=0.0,
        lt=1.0,
        description="Share of the RMS force of one more hidden effect, which is drawn at random from the seed; 0: "
        "none.",
    )
    vary_damper: float = Field(
        0.0,
        ge=0.0,
        le=0.5,
        description="Log-normal spread of the parameters of the damper around its parameter set (0: no spread).",
    )
    bench: BenchSettings = Field(BenchSettings(), description="The bench campaign.")
    frame: FrameSettings = Field(FrameSettings(), description="The frame campaign.")
    closed_loop: ClosedLoopSettings = Field(ClosedLoopSettings(), description="The closed-loop campaign.")
