"""Settings of `mrpipe design`: the section `design` of the configuration."""

from __future__ import annotations

from pydantic import Field, PositiveFloat, field_validator

from mrpipe.control.laws import known_law
from mrpipe.options import Section


class MotionSettings(Section):
    """A recorded base motion, or recorded forces such as wind, that the design must withstand."""

    file: str = Field(
        ...,
        description="Text or CSV of time [s] and acceleration, or a record as downloaded. Two components act in both "
        "directions of a structure with `influence_y`; else the first one acts. With `force_at`: text of time [s] and "
        "forces.",
    )
    unit: str = Field("m/s^2", description="Unit of the histories in a text file, for forces such as kN.")
    force_at: dict[str | int, float] = Field(
        {},
        description="Degrees of freedom on which forces act instead of ground motion (wind, shaker), each with a "
        "factor, as in `simulate.excitation`.",
    )
    file_channels: tuple[str | int, ...] = Field(
        (), description="Channels of a record that are used, by name or number, as in `simulate.excitation`."
    )
    scale: float = Field(1.0, gt=0.0, description="Factor on the record.")


class DesignSettings(Section):
    """Search of the law and gains whose largest response in the real loop is smallest."""

    laws: tuple[str, ...] = Field(
        (), description="Laws that are compared; empty: all calibrated laws, and the passive ones."
    )
    weights: dict[str, float] = Field(
        {"rms_x_top_m": 1.0},
        min_length=1,
        description="Quantity -> weight of its largest value over band, amplitudes and motions, relative to law vd at "
        "its calibrated gains. Quantities: x_top_m, x1_m, drift_m (largest storey drift), stroke_m, a1_m_s2, "
        "a_top_m_s2 and base_shear_n, each with rms_ or max_ in front.",
    )
    amplitude_factors: tuple[PositiveFloat, ...] = Field(
        (0.75, 1.0),
        min_length=1,
        description="Amplitudes of the base acceleration in multiples of that of `simulate.excitation`.",
    )
    band_rad_s: tuple[float, float] | None = Field(
        None, description="Lowest and highest frequency; null: that of `resonance`, by default around the target mode."
    )
    motions: tuple[MotionSettings, ...] = Field(
        (), description="Recorded base motions or forces, in addition to the harmonic motion."
    )
    stroke_limit_m: float | None = Field(
        None, gt=0.0, description="Limit of the largest displacement across the damper; null: not limited."
    )
    force_limit_n: float | None = Field(
        None, gt=0.0, description="Limit of the largest damper force; null: not limited."
    )
    rms_drive_limit: float | None = Field(
        None,
        gt=0.0,
        description="Limit of the RMS drive, A or V, such as the continuous rating of the coil; null: not limited. The "
        "largest drive is limited by `simulate.controller.drive_limit`.",
    )
    fixed_gains: dict[str, dict[str, float]] = Field(
        {}, description="Gains that are not searched: law -> gain -> value, such as {vdns: {k_n_m: -4500}}."
    )
    also_free: bool = Field(
        False,
        description="Whether laws with fixed gains are searched a second time with all gains free; the result is "
        "`unrestricted`.",
    )
    grid: int = Field(7, ge=3, description="Number of values of a single gain before the local search.")
    evaluations: int = Field(14, ge=3, description="Largest number of evaluations of the local search per free gain.")
    draws: int = Field(
        24,
        ge=0,
        description="Number of structures and dampers that are drawn from their uncertainty, for the probability of "
        "each law.",
    )

    @field_validator("laws")
    @classmethod
    def _laws_are_known(cls, laws: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(known_law(law) for law in laws)
