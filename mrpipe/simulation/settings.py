"""Settings of the closed loop: a section of the configuration, and the options of :mod:`mrpipe.simulation.rig`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.control.settings import ControllerSettings
from mrpipe.options import Section


class SingleExcitationSettings(Section):
    """One excitation."""

    kind: Literal["harmonic", "sweep", "random", "recorded", "free-decay"] = Field(
        "harmonic",
        description="Harmonic with a free decay after its stop, sweep, narrow-band random motion, recorded motion, or "
        "release from a shape.",
    )
    frequency_rad_s: float | None = Field(
        None,
        gt=0.0,
        description="Of the harmonic, and centre of random motion; null: the free frequency of the calibrated mode.",
    )
    base_amplitude_m_s2: float | None = Field(
        None,
        gt=0.0,
        description="Of harmonic or sweep; random motion has the RMS of this harmonic. null: adjusted so that vd gives "
        "`reference_rms_top_m` under the harmonic.",
    )
    adjust_with: Literal["damper", "ideal"] = Field(
        "damper", description="Whether the amplitude is adjusted with the damper in the loop or with perfect tracking."
    )
    reference_rms_top_m: float | None = Field(
        None,
        gt=0.0,
        description="RMS top displacement of vd in the adjustment; null: that at which the damper would move with the "
        "expected amplitude of the calibration in the free mode.",
    )
    reference_c_n_s_m: float | None = Field(
        None, gt=0.0, description="Viscous gain of vd in the adjustment; null: as calibrated."
    )
    factor: float = Field(1.0, gt=0.0, description="Factor on the base acceleration, whatever its kind.")
    cycles: int = Field(40, ge=2, description="Cycles of the harmonic.")
    settling_cycles: int = Field(20, ge=1, description="Cycles left out of the indices.")
    ramp_cycles: float = Field(2.0, ge=0.0, description="Cycles over which the harmonic is eased in.")
    decay_s: float = Field(8.0, ge=0.0, description="Free decay after the harmonic stops.")
    release_top_m: float | None = Field(
        None,
        gt=0.0,
        description="Top displacement from which kind free-decay is released; null: the damper starts at the expected "
        "amplitude of the calibration.",
    )
    sweep_first_hz: float | None = Field(
        None, gt=0.0, description="First frequency of the sweep; null: 0.4 of the free frequency."
    )
    sweep_last_hz: float | None = Field(
        None, gt=0.0, description="Last frequency of the sweep; null: 2.4 times the free frequency."
    )
    sweep_s: float = Field(60.0, gt=0.0, description="Length of the sweep.")
    random_s: float = Field(240.0, gt=0.0, description="Length of random motion.")
    random_bandwidth: float = Field(
        0.1,
        gt=0.0,
        le=2.0,
        description="Width of the spectrum of random motion at half its height, over the centre frequency.",
    )
    random_seed: int = Field(1, ge=0, description="Seed of random motion; all laws meet the same motion.")
    file: str = Field(
        "",
        description="Recorded motion: PEER AT2, COSMOS or CSMIP V2 (also V1 and RAW), SMC, GeoNet V2A, a zip of them, "
        "or text of time [s] and one column for each history. Two components act in the two directions of the "
        "structure (`structure.influence_y`).",
    )
    file_y: str = Field("", description="Record of the second direction, where each direction has its own file.")
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
        "a record of two components is turned as a whole.",
    )
    force_at: dict[str | int, float] = Field(
        {},
        description="Degrees of freedom on which a force acts in place of ground motion (shaker, wind), each with a "
        "factor. The histories of a file belong to them in this order; one history acts on all.",
    )
    force_amplitude_n: float | None = Field(
        None, gt=0.0, description="With `force_at`: amplitude of a harmonic force or sweep; random forces have its RMS."
    )


class ExcitationSettings(SingleExcitationSettings):
    """What acts on the structure."""

    also: tuple[SingleExcitationSettings, ...] = Field(
        (),
        description="What acts at the same time, each like `simulate.excitation` with its own amplitude, such as wind "
        "(`force_at`) during motion of the ground. The duration is that of `simulate.excitation`.",
    )


class SensorFaultSettings(Section):
    """Faulty readings of the sensors in the loop."""

    kind: Literal["none", "missing", "zero", "stuck"] = Field(
        "none",
        description="`missing`: the reading is not a number; `zero`: it is 0; `stuck`: the last reading is repeated, "
        "as with samples that come late.",
    )
    sensor: Literal["displacement", "accelerometers", "velocity", "force", "all"] = Field(
        "all", description="Which sensor."
    )
    share: float = Field(0.01, ge=0.0, le=1.0, description="Share of the samples that begin a fault.")
    samples: int = Field(1, ge=1, description="Length of a fault in samples of the controller.")


class SensorSettings(Section):
    """Noise of the sensors in the loop."""

    displacement_noise_m: float = Field(20e-6, ge=0.0, description="RMS noise of the damper displacement.")
    acceleration_noise_m_s2: float = Field(0.1, ge=0.0, description="RMS noise of each acceleration.")
    acceleration_bias_m_s2: float = Field(0.0, description="Constant bias of the damper's acceleration.")
    fault: SensorFaultSettings = Field(SensorFaultSettings(), description="Faulty readings.")


class SimulateSettings(Section):
    """The closed loop."""

    frame: str = Field("identified", description="Frame: `identified`, or a set of configs/frames or its YAML file.")
    frame_amplitude_m: float = Field(
        0.0,
        ge=0.0,
        description="Where identify-frame found modes that depend on amplitude: amplitude of the motion [m] at which "
        "the identified frame is taken (equivalent linear frame). 0 takes M, C and K of constant modes.",
    )
    damper: str = Field(
        "identified",
        description="Damper in the loop: `identified`; `traced`, the one with the base form and effects that "
        "close-loop found, under the controller of the identified one; a damper artifact (.h5) of another run; "
        "or a set of configs/dampers or its YAML file.",
    )
    tracking: Literal["damper", "ideal", "continuous", "unclipped"] = Field(
        "damper",
        description="The damper gives the force; `ideal`: the controller has perfect sensors and its clipped force is "
        "held from sample to sample; `continuous`: vd, vdps, vdns act at every instant and are never active; "
        "`unclipped`: the same, but the force may be active, so that the loop is linear.",
    )
    plant_rate_hz: float = Field(2000.0, ge=100.0, description="Steps of the plant a second.")
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
        0.0, ge=0.0, description="Lag of the current driver in addition to the damper's own."
    )
    accelerations: Literal["relative", "absolute"] = Field(
        "relative", description="Which accelerations `simulate --resonance` and `design` judge."
    )
    excitation: ExcitationSettings = Field(ExcitationSettings(), description="What shakes the base.")
    controller: ControllerSettings = Field(ControllerSettings(), description="The real-time controller.")
    sensors: SensorSettings = Field(SensorSettings(), description="Noise of the sensors.")


class ResonanceSettings(Section):
    """Response of the closed loop over the excitation frequency."""

    band_rad_s: tuple[float, float] | None = Field(
        None,
        description="Lowest and highest frequency; null: from 0.75 times the free frequency of the calibrated mode to "
        "1.2 times its frequency with a locked damper.",
    )
    points: int = Field(19, ge=5, description="Frequencies of the grid; the resonances are refined in addition.")
    amplitude_factors: tuple[float, ...] = Field(
        (1.0,),
        min_length=1,
        description="Amplitudes of the base acceleration in multiples of that of `simulate.excitation`.",
    )
    tolerance: float = Field(
        2e-3, gt=0.0, description="Relative change of the RMS values from window to window that counts as steady."
    )
    window_cycles: int = Field(6, ge=2, description="Cycles over which an RMS value is taken.")
    most_cycles: int = Field(
        160, ge=20, description="Longest run at one frequency; only the largest values are averaged over more."
    )
    standard_error: float = Field(
        1.5e-3,
        gt=0.0,
        description="Relative standard error of the largest values. A response that does not become periodic is "
        "averaged over further runs until the largest values are known so accurately.",
    )
    most_averaged_cycles: int = Field(
        200_000, ge=0, description="Most cycles over which one of the largest values is averaged; 0: no further runs."
    )
