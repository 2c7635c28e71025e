"""Settings of the virtual rig (`record`)."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from mrpipe.config.section import Section
from mrpipe.control.laws import known_law


class PlantedEffect(Section):
    """An effect of the true damper."""

    name: str = Field(
        description="Name of the effect, as the contract lists them; `unfamiliar` for shapes of no family."
    )
    form: str = Field("", description="Which functional form; empty for the first one.")
    strength_share: float | None = Field(
        None, gt=0.0, lt=2.0, description="RMS of the effect over RMS of the force; scales the form's first number."
    )
    parameters: dict[str, float] = Field(
        default_factory=dict, description="Numbers of the form in SI; those left out take the form's own."
    )


class CustomTest(Section):
    """One test of a plan of one's own."""

    name: str = Field(description="Name of the test.")
    role: Literal["training", "validation", "repeat"] = Field("training", description="What it is for.")
    motion: Literal["sine", "triangle", "random", "earthquake", "dwell", "hold"] = Field(
        "sine", description="Motion; `dwell` visits several positions, `hold` pauses in the middle."
    )
    amplitude_m: float = Field(0.010, gt=0.0, description="Amplitude or largest excursion [m].")
    middle_m: float = Field(0.0, description="Position about which it moves [m].")
    frequency_hz: float = Field(1.0, gt=0.0, description="Frequency, or upper end of the band of random motion [Hz].")
    current: Literal["constant", "half-sine", "steps", "random"] = Field("constant", description="Kind of current.")
    current_a: float = Field(0.0, ge=0.0, description="Level, amplitude or largest value of the current [A].")
    duration_s: float = Field(10.0, gt=0.0, description="Duration [s].")
    repeat_of: str = Field("", description="Test whose command is repeated.")
    later: bool = Field(
        False, description="Made after the others: the strength of effects given as shares is that of the others."
    )
    pause_s: float = Field(0.4, gt=0.0, description="Pause of `hold`, or time between steps of current [s].")


class BenchSensorSettings(Section):
    """Noise and constant offsets, as standard deviations."""

    displacement_noise_m: float = Field(10e-6, ge=0.0, description="Noise of the displacement sensor [m].")
    acceleration_noise_m_s2: float = Field(0.1, ge=0.0, description="Noise of the accelerometer [m/s2].")
    force_noise_n: float = Field(0.5, ge=0.0, description="Noise of the load cell [N].")
    current_noise_a: float = Field(5e-3, ge=0.0, description="Noise of the current measurement [A].")
    displacement_offset_m: float = Field(2e-4, ge=0.0, description="Offset of the displacement sensor [m].")
    acceleration_offset_m_s2: float = Field(0.05, ge=0.0, description="Offset of the accelerometer [m/s2].")
    force_offset_n: float = Field(2.0, ge=0.0, description="Offset of the load cell [N].")
    current_offset_a: float = Field(2e-3, ge=0.0, description="Offset of the current measurement [A].")
    colour: Literal["white", "coloured"] = Field("white", description="Spectrum of the noise.")


class ServoSettings(Section):
    """How the testing machine departs from its command."""

    amplitude_error: float = Field(0.005, ge=0.0, description="Standard deviation of the amplitude error [1].")
    harmonic_share: float = Field(
        0.004, ge=0.0, description="Standard deviation of second and third harmonic over the amplitude [1]."
    )
    smoothing_s: float = Field(0.004, gt=0.0, description="Width of the machine's own smoothing [s].")


class BenchSettings(Section):
    """The bench campaign."""

    plan: str = Field(
        "table-2.1",
        description="`table-2.1`, `compact` (44 short tests of unlike motions), `discriminating` (tests that tell "
        "alike effects apart), several joined by +, or `custom` (the tests listed alone).",
    )
    tests: tuple[CustomTest, ...] = Field((), description="Tests in addition to the plan.")
    cycles: int = Field(10, ge=2, description="Steady cycles of each test of Table 2.1.")
    short_test_s: float = Field(5.0, gt=1.0, description="Duration of a test of the compact plan [s].")
    sampling_rate_hz: float = Field(1000.0, ge=100.0, description="Rate of the recorder [Hz].")
    fine_steps: int = Field(4, ge=1, le=32, description="Integration steps a sample of the true damper.")
    current_phase_spread_rad: float = Field(
        1.5707963, ge=0.0, description="Half width of the draw of the half-sine current's phase about the velocity's."
    )
    sensors: BenchSensorSettings = Field(BenchSensorSettings(), description="Noise and offsets.")
    servo: ServoSettings = Field(ServoSettings(), description="The testing machine.")
    data_format: Literal["h5", "csv"] = Field("h5", description="Format of the data files.")


class FrameSettings(Section):
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
    sampling_rate_hz: float = Field(200.0, ge=50.0, description="Rate of the recorder [Hz].")
    fine_steps: int = Field(5, ge=1, le=64, description="Integration steps a sample of the true frame.")
    acceleration_noise_m_s2: float = Field(0.01, ge=0.0, description="Noise of the accelerometers [m/s2].")
    displacement_noise_m: float = Field(20e-6, ge=0.0, description="Noise of the lasers [m].")
    acceleration_offset_m_s2: float = Field(0.05, ge=0.0, description="Offset of the accelerometers [m/s2].")
    displacement_offset_m: float = Field(5e-4, ge=0.0, description="Offset of the lasers [m].")
    laser_floors: tuple[int, ...] = Field((1, 2, 5), description="Floors whose displacement is measured.")
    sweep_s: float = Field(300.0, gt=10.0, description="Duration of a sweep, a fifth of it rest [s].")
    sweeps: int = Field(2, ge=1, description="Number of sweeps; the second runs down.")
    random_s: float = Field(240.0, ge=0.0, description="Duration of the random test [s]; 0 leaves it out.")
    sweep_acceleration_m_s2: float = Field(
        0.06, gt=0.0, description="Amplitude of the sweep at the first frequency, rising with its root [m/s2]."
    )
    random_acceleration_m_s2: float = Field(0.15, gt=0.0, description="RMS of the random test [m/s2].")
    decay_acceleration_m_s2: float = Field(
        1.5, gt=0.0, description="Largest floor acceleration when a decay test lets go [m/s2]."
    )
    sensitivity_error: float = Field(
        0.0, ge=0.0, description="Standard deviation of the conversion factors' error [1]."
    )
    support_share: float = Field(
        0.06, ge=0.0, description="Participation of a flexible-support mode above the band [1]; 0 leaves it out."
    )


class ClosedLoopSettings(Section):
    """The closed-loop campaign on the shaking table."""

    laws: tuple[str, ...] = Field(
        ("vd", "vdps", "vdns", "fdns", "passive-off", "passive-on"), min_length=1, description="Control laws recorded."
    )

    @field_validator("laws")
    @classmethod
    def _known(cls, laws: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(known_law(law) for law in laws)

    frequency_rad_s: float = Field(8.0, gt=0.0, description="Frequency of the base [rad/s].")
    base_amplitude_m_s2: float = Field(
        0.788, gt=0.0, description="Amplitude of the base's acceleration [m/s2]; 0.788 gives vd about 24 mm on top."
    )
    rest_s: float = Field(1.0, ge=0.0, description="Rest before the motion [s].")
    shaking_s: float = Field(32.0, gt=5.0, description="Harmonic motion of the base [s].")
    decay_s: float = Field(10.0, ge=0.0, description="Free decay after it stops [s].")
    validation_factor: float = Field(
        0.85, gt=0.0, description="Amplitude of the validation test of each law over that of the training test."
    )
    sampling_rate_hz: float = Field(500.0, ge=50.0, description="Rate of the recorder [Hz].")
    fine_steps: int = Field(16, ge=4, le=64, description="Integration steps a sample of the true rig.")
    acceleration_noise_m_s2: float = Field(0.05, ge=0.0, description="Noise of the accelerometers [m/s2].")
    displacement_noise_m: float = Field(20e-6, ge=0.0, description="Noise of the lasers [m].")
    force_noise_n: float = Field(0.5, ge=0.0, description="Noise of the load cell [N].")
    current_noise_a: float = Field(5e-3, ge=0.0, description="Noise of the current measurement [A].")
    acceleration_offset_m_s2: float = Field(0.01, ge=0.0, description="Offset of the accelerometers [m/s2].")
    force_offset_n: float = Field(0.5, ge=0.0, description="Offset of the load cell [N].")
    laser_floors: tuple[int, ...] = Field((1, 2, 5), description="Floors whose displacement is measured.")


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
        description="Effects of the true damper that campaign.yaml keeps back; the truth lies sealed beside it.",
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
