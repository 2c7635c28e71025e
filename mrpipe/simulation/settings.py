"""Settings of the closed loop: sections of the configuration, and options of :mod:`mrpipe.simulation.rig`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, PositiveFloat

from mrpipe.control.settings import ControllerSettings
from mrpipe.options import Section


class SingleExcitationSettings(Section):
    """One excitation."""

    kind: Literal["harmonic", "sweep", "random", "recorded", "free-decay"] = Field(
        "harmonic",
        description="Kind of excitation: harmonic motion with a free decay after its stop, sweep, narrow-band random "
        "motion, recorded motion, or free decay from an initial displacement.",
    )
    frequency_rad_s: float | None = Field(
        None,
        gt=0.0,
        description="Frequency of harmonic motion, and centre frequency of random motion; null: natural frequency of "
        "the calibrated mode without damper force.",
    )
    base_amplitude_m_s2: float | None = Field(
        None,
        gt=0.0,
        description="Amplitude of harmonic motion or sweep; random motion has the RMS value of this harmonic. null: "
        "adjusted so that vd gives `reference_rms_top_m` under harmonic motion.",
    )
    adjust_with: Literal["damper", "ideal"] = Field(
        "damper", description="Whether the amplitude is adjusted with the damper in the loop or with perfect tracking."
    )
    reference_rms_top_m: float | None = Field(
        None,
        gt=0.0,
        description="RMS top displacement of vd in the adjustment; null: the one at which the damper would move with "
        "the expected amplitude of the calibration in the mode without damper force.",
    )
    reference_c_n_s_m: float | None = Field(
        None, gt=0.0, description="Viscous gain of vd in the adjustment; null: as calibrated."
    )
    factor: float = Field(1.0, gt=0.0, description="Factor on the base acceleration of every kind.")
    cycles: int = Field(40, ge=2, description="Number of cycles of harmonic motion.")
    settling_cycles: int = Field(
        20, ge=1, description="Number of first cycles that are left out of the indices; one cycle is kept at least."
    )
    ramp_cycles: float = Field(2.0, ge=0.0, description="Number of cycles of the ramp at the start of harmonic motion.")
    decay_s: float = Field(8.0, ge=0.0, description="Duration of the free decay after harmonic motion stops.")
    release_top_m: float | None = Field(
        None,
        gt=0.0,
        description="Initial top displacement of kind free-decay, which begins in the mode of the calibration (of the "
        "first damper); null: the damper starts at the expected amplitude of the calibration.",
    )
    sweep_first_hz: float | None = Field(
        None,
        gt=0.0,
        description="First frequency of the sweep; null: 0.4 times the natural frequency without damper force.",
    )
    sweep_last_hz: float | None = Field(
        None,
        gt=0.0,
        description="Last frequency of the sweep; null: 2.4 times the natural frequency without damper force.",
    )
    sweep_s: float = Field(60.0, gt=0.0, description="Duration of the sweep.")
    random_s: float = Field(240.0, gt=0.0, description="Duration of random motion.")
    random_bandwidth: float = Field(
        0.1,
        gt=0.0,
        le=2.0,
        description="Width of the spectrum of random motion at half its height, over the centre frequency.",
    )
    random_seed: int = Field(1, ge=0, description="Seed of random motion, which is the same for all laws.")
    file: str = Field(
        "",
        description="Recorded motion: PEER AT2, COSMOS or CSMIP V2 (also V1 and RAW), SMC, GeoNet V2A, a zip of them, "
        "or text of time [s] and one column for each history. Two components act in the two directions of the "
        "structure (`structure.influence_y`).",
    )
    file_y: str = Field("", description="Record of the second direction, if each direction has a separate file.")
    file_unit: str = Field(
        "m/s^2", description="Unit of the histories in a text file, such as g, cm/s^2 or, for forces, kN."
    )
    file_channels: tuple[str | int, ...] = Field(
        (),
        description="Channels of the record that are used, by name or number; empty: all columns of a text file, and "
        "the horizontal channels of a record that has at most two.",
    )
    direction_deg: float = Field(
        0.0,
        description="Direction of the ground motion, from the first direction of the structure towards the second one; "
        "the two components of a record are rotated together.",
    )
    force_at: dict[str | int, float] = Field(
        {},
        description="Degrees of freedom on which a force acts instead of ground motion (shaker, wind), each with a "
        "factor. The histories of a file belong to them in this order; one history acts on all.",
    )
    force_amplitude_n: float | None = Field(
        None,
        gt=0.0,
        description="With `force_at`: amplitude of a harmonic force or sweep; random forces have the same RMS value.",
    )


class ExcitationSettings(SingleExcitationSettings):
    """What acts on the structure."""

    also: tuple[SingleExcitationSettings, ...] = Field(
        (),
        description="Further excitations that act at the same time, each with the settings of `simulate.excitation` "
        "and a separate amplitude, such as wind (`force_at`) during ground motion. The duration is that of "
        "`simulate.excitation`.",
    )


class SensorFaultSettings(Section):
    """Faulty readings of the sensors in the loop."""

    kind: Literal["none", "missing", "zero", "stuck"] = Field(
        "none",
        description="`missing`: the reading is not a number; `zero`: it is 0; `stuck`: the last reading is repeated, "
        "like late samples.",
    )
    sensor: Literal["displacement", "accelerometers", "velocity", "force", "all"] = Field(
        "all", description="Sensor with the fault."
    )
    share: float = Field(0.01, ge=0.0, le=1.0, description="Share of the samples at which a fault begins.")
    samples: int = Field(1, ge=1, description="Duration of a fault in samples of the controller.")


class SensorSettings(Section):
    """Noise of the sensors in the loop."""

    displacement_noise_m: float = Field(20e-6, ge=0.0, description="RMS noise of the damper displacement.")
    acceleration_noise_m_s2: float = Field(0.1, ge=0.0, description="RMS noise of each acceleration.")
    acceleration_bias_m_s2: float = Field(0.0, description="Constant bias of the acceleration of the damper.")
    fault: SensorFaultSettings = Field(SensorFaultSettings(), description="Faulty readings.")


class SimulateSettings(Section):
    """The closed loop."""

    frame: str = Field(
        "identified", description="Frame: `identified`, or a parameter set of configs/frames or its YAML file."
    )
    frame_amplitude_m: float = Field(
        0.0,
        ge=0.0,
        description="Amplitude of the motion [m] at which the identified frame is taken (equivalent linear frame), if "
        "identify-frame found modes that depend on the amplitude. 0: M, C and K of constant modes.",
    )
    damper: str = Field(
        "identified",
        description="Damper in the loop: `identified`; `traced`, the one with the base form and effects that "
        "close-loop found, under the controller of the identified one; a damper artifact (.h5) of another run; "
        "or a set of configs/dampers or its YAML file.",
    )
    tracking: Literal["damper", "ideal", "continuous", "unclipped"] = Field(
        "damper",
        description="How the desired force becomes the actual one. `damper`: the damper model gives the force. "
        "`ideal`: the sensors are perfect, and the clipped force of the controller is held from sample to sample. "
        "`continuous`: vd, vdps and vdns act at every instant, with clipping, so that they never feed energy into the "
        "structure. `unclipped`: the same without clipping, so that the loop is linear.",
    )
    plant_rate_hz: float = Field(2000.0, ge=100.0, description="Steps of the plant per second.")
    record_rate_hz: float | None = Field(
        None, gt=0.0, description="Rate of the histories; null: 1000 Hz, and every plant step with a perfect damper."
    )
    ideal_rounding_m_s: float | None = Field(
        None,
        ge=0.0,
        description="Speed over which the friction of a perfect damper changes its sign; 0: a jump; null: 1.5 times "
        "the calibrated one, because there is no yielding that would round it.",
    )
    driver_time_constant_s: float = Field(
        0.0, ge=0.0, description="Time constant of the current driver in addition to the lag of the damper."
    )
    accelerations: Literal["relative", "absolute"] = Field(
        "relative", description="Accelerations that `simulate --resonance` and `design` judge."
    )
    excitation: ExcitationSettings = Field(ExcitationSettings(), description="Excitation of the structure.")
    controller: ControllerSettings = Field(ControllerSettings(), description="The real-time controller.")
    sensors: SensorSettings = Field(SensorSettings(), description="Noise of the sensors.")


class ResonanceSettings(Section):
    """Response of the closed loop over the excitation frequency."""

    band_rad_s: tuple[float, float] | None = Field(
        None,
        description="Lowest and highest frequency; null: from 0.75 times the natural frequency of the calibrated mode "
        "without damper force to 1.2 times that with a locked damper.",
    )
    points: int = Field(19, ge=5, description="Number of frequencies of the grid; resonances are refined in addition.")
    amplitude_factors: tuple[PositiveFloat, ...] = Field(
        (1.0,),
        min_length=1,
        description="Amplitudes of the base acceleration in multiples of that of `simulate.excitation`.",
    )
    tolerance: float = Field(
        2e-3,
        gt=0.0,
        description="Largest relative change of the RMS values from window to window of a steady response.",
    )
    window_cycles: int = Field(6, ge=2, description="Number of cycles over which an RMS value is computed.")
    most_cycles: int = Field(
        160,
        ge=20,
        description="Largest number of cycles of a run at one frequency; only the largest values are averaged over "
        "more.",
    )
    standard_error: float = Field(
        1.5e-3,
        gt=0.0,
        description="Relative standard error of the largest values. A response that does not become periodic is "
        "averaged over further runs until its largest values have this accuracy.",
    )
    most_averaged_cycles: int = Field(
        200_000,
        ge=0,
        description="Largest number of cycles over which one of the largest values is averaged; 0: no further runs.",
    )
