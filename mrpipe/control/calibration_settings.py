"""Settings of the calibration: sections of the configuration, and the defaults of :mod:`mrpipe.control`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


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

    def known(self) -> dict[str, float]:
        """Return the weights and noises that are given, with the names of :class:`~mrpipe.control.lqg.Weights`."""
        given = {
            "energy": self.energy_weight,
            "top_displacement": self.top_displacement_weight,
            "force": self.force_weight,
            "ground_noise_m_s2": self.ground_noise_m_s2,
            "force_noise_n": self.force_noise_n,
        }
        return {key: item for key, item in given.items() if item is not None}


class CalibrationSettings(Section):
    """What the laws are calibrated for, and the gains they run with."""

    target_mode: int = Field(1, ge=1, description="Mode to be damped.")
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
