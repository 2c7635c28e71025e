"""Settings of `calibrate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field, create_model

from mrpipe.config.section import Section
from mrpipe.control.laws import law_names


class NeuralReferenceSettings(Section):
    """The neural reference controller (thesis 4.3.4)."""

    hidden: tuple[int, ...] = Field((6, 6), min_length=1, description="Neurons of the hidden layers.")
    past_values: int = Field(5, ge=0, le=20, description="Past values of displacement and velocity.")
    rate_hz: float = Field(200.0, gt=0.0, description="Rate at which the past values lie.")
    amplitudes: int = Field(
        7, ge=2, description="Loops of how many amplitudes, from a fifth to twice the expected one."
    )
    frequencies: int = Field(7, ge=2, description="Of how many frequencies, 0.625 to 1.6 times the free frequency.")
    starts: int = Field(4, ge=1, description="Random starts of the training.")
    iterations: int = Field(150, ge=1, description="Most Levenberg-Marquardt iterations of a start.")
    disturbance_share: float = Field(
        0.2, ge=0.0, description="Speed of the frame's other modes, put on the loops, over that of the loop."
    )


class RegulatorSettings(Section):
    """Weights of clipped LQG (thesis appendix E)."""

    energy_weight: float = Field(1.0, ge=0.0, description="Weight of kinetic and strain energy [1/J].")
    top_displacement_weight: float = Field(0.0, ge=0.0, description="Weight of the top displacement squared [1/m2].")
    force_weight: float | None = Field(
        None,
        gt=0.0,
        description="Weight of the damper force squared [1/N2]; null: such that the regulator damps the target mode as "
        "viscous damping can at best.",
    )
    ground_noise_m_s2: float = Field(0.1, gt=0.0, description="Noise of the ground's accelerometer, with model error.")
    force_noise_n: float | None = Field(
        None,
        ge=0.0,
        description="Difference of the damper's force from the desired one, as a noise; null: its residual force.",
    )


class _Fixed(Section):
    """For which mode and damper the laws are calibrated, and the gains they run with."""

    target_mode: int = Field(1, ge=1, description="Mode to be damped.")
    damper: str = Field(
        "identified",
        description="Damper whose forces the gains are checked against: `identified`, a damper artifact (.h5) such as "
        "damper-traced.h5 of another run, or a set of configs/dampers or its YAML file.",
    )
    damper_floor: int = Field(1, ge=1, description="Floor that the damper acts on.")
    damper_across_storey: bool = Field(
        False, description="The damper spans the storey below its floor; else it sits between floor and ground."
    )
    gains: Literal["exact", "closed-form", "published"] = Field(
        "exact",
        description="Gains the laws run with: the exact optimum, the closed forms of P2, or those of `published`; laws "
        "without published gains take the exact optimum.",
    )
    published: dict[str, dict[str, float]] = Field({}, description="Gains of a publication: law -> gain -> value.")
    positive_stiffness_n_m: float | None = Field(
        None, gt=0.0, description="k for which vdps is calibrated; null: half the static stiffness at the damper."
    )
    negative_stiffness_n_m: float | None = Field(
        None,
        lt=0.0,
        description="k for which vdns is calibrated; null: 0.8 of the static stiffness at the damper, because at 1 the "
        "structure would become unstable.",
    )
    expected_amplitude_m: float | None = Field(
        None,
        gt=0.0,
        description="Damper amplitude at which forces are judged and around which nnc learns; null: half the largest "
        "displacement of the bench tests.",
    )
    friction_rounding_share: float = Field(
        1.0 / 6.0,
        ge=0.0,
        description="Speed over which the friction of fdns and nnc changes its sign, over the damper's peak speed at "
        "the expected amplitude; 0: the jump of (4.18).",
    )
    map_points: int = Field(25, ge=5, le=200, description="Points along each axis of the damping maps.")
    neural: NeuralReferenceSettings = Field(NeuralReferenceSettings(), description="The neural reference controller.")
    regulator: RegulatorSettings = Field(RegulatorSettings(), description="Clipped LQG.")

    def given(self, law: str) -> dict[str, float]:
        """Return the gains that the user gives for a law, by name."""
        return dict(getattr(self, law.replace("-", "_"), {}))


if TYPE_CHECKING:

    class CalibrateSettings(_Fixed):
        """For which mode and damper the laws are calibrated, and the gains they run with."""

else:
    CalibrateSettings = create_model(
        "CalibrateSettings",
        __base__=_Fixed,
        __doc__=_Fixed.__doc__,
        **{
            name.replace("-", "_"): (
                dict[str, float],
                Field({}, description=f"Your own gains for {name}, by name; gains that are left out are calibrated."),
            )
            for name in law_names()
            if not name.startswith("passive-")
        },
    )
