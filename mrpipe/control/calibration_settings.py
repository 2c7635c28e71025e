"""Settings of the calibration: sections of the configuration, and the defaults of :mod:`mrpipe.control`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class NeuralReferenceSettings(Section):
    """The neural reference controller (thesis 4.3.4)."""

    hidden: tuple[int, ...] = Field((6, 6), min_length=1, description="Neurons of the hidden layers.")
    past_values: int = Field(5, ge=0, le=20, description="Past values of displacement and velocity.")
    rate_hz: float = Field(200.0, gt=0.0, description="Sampling rate of the past values.")
    amplitudes: int = Field(
        7, ge=2, description="Number of amplitudes of the training loops, from a fifth of to twice the expected one."
    )
    frequencies: int = Field(
        7,
        ge=2,
        description="Number of frequencies of the training loops, 0.625 to 1.6 times the natural frequency without "
        "damper force.",
    )
    starts: int = Field(4, ge=1, description="Number of random starts of the training.")
    iterations: int = Field(150, ge=1, description="Largest number of Levenberg-Marquardt iterations of a start.")
    disturbance_share: float = Field(
        0.2, ge=0.0, description="Speed of superimposed higher modes of the frame, relative to that of the loop."
    )


class RegulatorSettings(Section):
    """Weights of clipped LQG (thesis appendix E)."""

    energy_weight: float = Field(1.0, ge=0.0, description="Weight of kinetic and strain energy [1/J].")
    top_displacement_weight: float = Field(0.0, ge=0.0, description="Weight of the top displacement squared [1/m2].")
    force_weight: float | None = Field(
        None,
        gt=0.0,
        description="Weight of the damper force squared [1/N2]; null: such that the regulator, before the damper clips "
        "it, gives the target mode twice the largest damping ratio that viscous damping can give, at most 0.71.",
    )
    ground_noise_m_s2: float = Field(
        0.1, gt=0.0, description="Noise of the accelerometer of the ground, including model error."
    )
    force_noise_n: float | None = Field(
        None,
        ge=0.0,
        description="Error of the damper force that the observer takes, as noise: the change of a measured force "
        "within a sample, or the difference between a desired force and that of the damper; null: residual force of "
        "the damper.",
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
    """Operating conditions for which the laws are calibrated, and the gains that are used."""

    target_mode: int = Field(1, ge=1, description="Mode to be damped.")
    gains: Literal["exact", "closed-form", "published"] = Field(
        "exact",
        description="Gains that are used: the exact optimum, the closed forms of P2, or those of `published`; laws "
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
