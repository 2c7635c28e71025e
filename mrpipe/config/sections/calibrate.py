"""Settings of `calibrate`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.config.section import Section


class GivenGains(Section):
    """Gains of the user's own for one law: f = c v + k x, or f = sign(v) alpha X - alpha x."""

    c_n_s_m: float | None = Field(None, description="Viscous gain c; not given: calibrated.")
    k_n_m: float | None = Field(None, description="Stiffness gain k; not given: calibrated.")
    alpha_n_m: float | None = Field(None, description="Friction gain alpha of fdns and nnc; not given: calibrated.")


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
    force_weight: float = Field(1e-4, gt=0.0, description="Weight of the damper force squared [1/N2].")
    ground_noise_m_s2: float = Field(0.1, gt=0.0, description="Noise of the ground's accelerometer, with model error.")
    force_noise_n: float = Field(
        20.0, ge=0.0, description="By how much the damper's force differs from the desired one, as a noise."
    )


class CalibrateSettings(Section):
    """For which mode and damper the laws are calibrated, and whose gains they run with."""

    target_mode: int = Field(1, ge=1, description="Mode to be damped.")
    damper_floor: int = Field(1, ge=1, description="Floor that the damper acts on.")
    damper_across_storey: bool = Field(
        False, description="The damper spans the storey below its floor; else it sits between floor and ground."
    )
    gains: Literal["thesis", "closed-form", "exact"] = Field(
        "thesis", description="Gains the laws run with: the thesis' own, P2's closed forms, or the exact optimum."
    )
    positive_stiffness_n_m: float = Field(2500.0, gt=0.0, description="k for which vdps is calibrated.")
    negative_stiffness_n_m: float = Field(-4500.0, lt=0.0, description="k for which vdns is calibrated.")
    vd: GivenGains = Field(GivenGains(), description="Gains of your own for vd.")
    vdps: GivenGains = Field(GivenGains(), description="Gains of your own for vdps.")
    vdns: GivenGains = Field(GivenGains(), description="Gains of your own for vdns.")
    fdns: GivenGains = Field(GivenGains(), description="Gains of your own for fdns, and for nnc which imitates it.")
    expected_amplitude_m: float = Field(
        0.0093, gt=0.0, description="Damper amplitude at which forces are judged and around which nnc learns."
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
