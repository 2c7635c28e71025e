"""Options that the benchmark structures share with their settings."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section


class MotionSettings(Section):
    """A ground motion."""

    file: str = Field(
        "synthetic",
        description="Record: `synthetic` (spectrum-compatible, seeded), a path (AT2, text, csv, mat), or the name of a "
        "public record if the public data are present: elcentro, erzikan, jiji, kobe, newhall, rinaldi, sylmar, "
        "elcentro-ns.",
    )
    second_file: str | None = Field(
        None, description="Record of the second horizontal component, if each component has a separate file (AT2)."
    )
    unit: str | None = Field(
        None, description="Unit of the samples (g, cm/s^2, m/s^2); null: from the header, or from the size of the peak."
    )
    interval_s: float | None = Field(
        None, gt=0.0, description="Sampling interval [s] of a record with neither clock nor DT; null: that of the file."
    )
    resampled_interval_s: float | None = Field(
        None, gt=0.0, description="Interval to which the record is resampled without aliasing [s]; null: not resampled."
    )
    peak_ground_g: float = Field(
        0.3, gt=0.0, description="Design ground acceleration on rock of the synthetic motion [g]."
    )
    duration_s: float = Field(30.0, gt=5.0, description="Length of the synthetic motion [s].")


class LqgWeights(Section):
    """Weights of an LQG design (appendix E)."""

    displacement: float = Field(100.0, ge=0.0, description="Weight of regulated displacements [1/m^2].")
    acceleration: float = Field(1.0, ge=0.0, description="Weight of regulated absolute accelerations [s^4/m^2].")
    force_n: float = Field(
        1e6, gt=0.0, description="Unit of force in the weight R, which is the identity matrix in this unit [N]."
    )
    interval_s: float = Field(0.001, gt=0.0, le=0.05, description="Sampling interval of the controller [s].")


class WindClimate(Section):
    """The wind, and how the building takes it (Davenport's decay of the lateral turbulence)."""

    top_speed_m_s: float = Field(47.25, gt=0.0, description="Mean wind at the top [m/s].")
    profile_exponent: float = Field(0.365, ge=0.0, le=1.0, description="Exponent of the power law of the mean wind.")
    lift_coefficient: float = Field(0.27, ge=0.0, description="RMS lift coefficient of vortex shedding.")
    strouhal_number: float = Field(0.1, gt=0.0, description="Shedding frequency times width over wind speed.")
    bandwidth: float = Field(0.25, gt=0.0, description="Relative width of the shedding peak.")
    lateral_intensity: float = Field(0.1, ge=0.0, description="RMS lateral turbulence at the top over the mean wind.")
    lateral_coefficient: float = Field(
        1.0, ge=0.0, description="Side force coefficient per angle of the wind, dC_L/da + C_D."
    )
    decay: float = Field(10.0, ge=0.0, description="Decay constant of lateral turbulence with height.")
