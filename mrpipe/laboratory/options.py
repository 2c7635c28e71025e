"""Options of the virtual rigs: bench, shaking table, closed loop. They do not contain the hidden effects."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class BenchSensors(Section):
    """Noise and constant offsets of each channel of the bench, as standard deviations.

    Coloured noise has a first-order spectrum with its corner at 8 Hz and the same standard deviation.
    """

    displacement_noise_m: float = Field(10e-6, ge=0.0, description="Noise of the displacement sensor [m].")
    acceleration_noise_m_s2: float = Field(0.1, ge=0.0, description="Noise of the accelerometer [m/s2].")
    force_noise_n: float = Field(0.5, ge=0.0, description="Noise of the load cell [N].")
    current_noise_a: float = Field(5e-3, ge=0.0, description="Noise of the current measurement [A].")
    displacement_offset_m: float = Field(2e-4, ge=0.0, description="Offset of the displacement sensor [m].")
    acceleration_offset_m_s2: float = Field(0.05, ge=0.0, description="Offset of the accelerometer [m/s2].")
    force_offset_n: float = Field(2.0, ge=0.0, description="Offset of the load cell [N].")
    current_offset_a: float = Field(2e-3, ge=0.0, description="Offset of the current measurement [A].")
    colour: Literal["white", "coloured"] = Field("white", description="Spectrum of the noise.")


class Servo(Section):
    """Deviations of the testing machine from its command."""

    amplitude_error: float = Field(0.005, ge=0.0, description="Standard deviation of the amplitude error [1].")
    harmonic_share: float = Field(
        0.004, ge=0.0, description="Standard deviation of second and third harmonic over the amplitude [1]."
    )
    smoothing_s: float = Field(0.004, gt=0.0, description="Width of the smoothing by the machine [s].")


class BenchRig(Section):
    """Testing machine and recorder of the damper tests."""

    sampling_rate_hz: float = Field(1000.0, ge=100.0, description="Rate of the recorder [Hz].")
    fine_steps: int = Field(4, ge=1, le=32, description="Number of integration steps per sample of the true damper.")
    current_phase_spread_rad: float = Field(
        1.5707963,
        ge=0.0,
        description="Half width of the random phase of the half-sine current relative to the velocity [rad].",
    )
    sensors: BenchSensors = Field(BenchSensors(), description="Noise and offsets.")
    servo: Servo = Field(Servo(), description="The testing machine.")


class FrameRig(Section):
    """Shaking table, its sensors and the tests of the frame."""

    sampling_rate_hz: float = Field(200.0, ge=50.0, description="Rate of the recorder [Hz].")
    fine_steps: int = Field(5, ge=1, le=64, description="Number of integration steps per sample of the true frame.")
    acceleration_noise_m_s2: float = Field(0.01, ge=0.0, description="Noise of the accelerometers [m/s2].")
    displacement_noise_m: float = Field(20e-6, ge=0.0, description="Noise of the lasers [m].")
    acceleration_offset_m_s2: float = Field(0.05, ge=0.0, description="Offset of the accelerometers [m/s2].")
    displacement_offset_m: float = Field(5e-4, ge=0.0, description="Offset of the lasers [m].")
    laser_floors: tuple[int, ...] = Field((1, 2, 5), description="Floors whose displacement is measured.")
    sweep_s: float = Field(300.0, gt=10.0, description="Duration of a sweep, a fifth of it rest [s].")
    sweeps: int = Field(2, ge=1, description="Number of sweeps; the second one has a falling frequency.")
    random_s: float = Field(240.0, ge=0.0, description="Duration of the random test [s]; 0 leaves it out.")
    sweep_acceleration_m_s2: float = Field(
        0.06,
        gt=0.0,
        description="Amplitude of the sweep at the first frequency; it rises with the square root of the frequency "
        "[m/s2].",
    )
    random_acceleration_m_s2: float = Field(0.15, gt=0.0, description="RMS of the random test [m/s2].")
    decay_acceleration_m_s2: float = Field(
        1.5, gt=0.0, description="Largest floor acceleration at the release of a decay test [m/s2]."
    )
    sensitivity_error: float = Field(
        0.0, ge=0.0, description="Standard deviation of the error of the conversion factors [1]."
    )
    support_share: float = Field(
        0.06, ge=0.0, description="Participation of a mode of the flexible support above the band [1]; 0: no such mode."
    )

    @property
    def step_s(self) -> float:
        """Integration step [s]."""
        return 1.0 / (self.sampling_rate_hz * self.fine_steps)


class LoopRig(Section):
    """Shaking table, its sensors and the base motion of the closed-loop tests."""

    frequency_rad_s: float = Field(8.0, gt=0.0, description="Frequency of the base [rad/s].")
    base_amplitude_m_s2: float = Field(
        0.788,
        gt=0.0,
        description="Amplitude of the base acceleration [m/s2]; with 0.788 the RMS top displacement of vd is about 24 "
        "mm.",
    )
    rest_s: float = Field(1.0, ge=0.0, description="Rest before the motion [s].")
    shaking_s: float = Field(32.0, gt=5.0, description="Harmonic motion of the base [s].")
    decay_s: float = Field(10.0, ge=0.0, description="Free decay after it stops [s].")
    validation_factor: float = Field(
        0.85, gt=0.0, description="Amplitude of the validation test of each law over that of the training test."
    )
    sampling_rate_hz: float = Field(500.0, ge=50.0, description="Rate of the recorder [Hz].")
    fine_steps: int = Field(16, ge=4, le=64, description="Number of integration steps per sample of the true rig.")
    acceleration_noise_m_s2: float = Field(0.05, ge=0.0, description="Noise of the accelerometers [m/s2].")
    displacement_noise_m: float = Field(20e-6, ge=0.0, description="Noise of the lasers [m].")
    force_noise_n: float = Field(0.5, ge=0.0, description="Noise of the load cell [N].")
    current_noise_a: float = Field(5e-3, ge=0.0, description="Noise of the current measurement [A].")
    acceleration_offset_m_s2: float = Field(0.01, ge=0.0, description="Offset of the accelerometers [m/s2].")
    force_offset_n: float = Field(0.5, ge=0.0, description="Offset of the load cell [N].")
    laser_floors: tuple[int, ...] = Field((1, 2, 5), description="Floors whose displacement is measured.")

    @property
    def step_s(self) -> float:
        """Integration step [s]."""
        return 1.0 / (self.sampling_rate_hz * self.fine_steps)


class CustomTest(Section):
    """Test of a custom plan."""

    name: str = Field(description="Name of the test.")
    role: Literal["training", "validation", "repeat"] = Field("training", description="Role of the test.")
    motion: Literal["sine", "triangle", "random", "earthquake", "dwell", "hold"] = Field(
        "sine", description="Motion; `dwell` visits several positions, `hold` pauses in the middle."
    )
    amplitude_m: float = Field(0.010, gt=0.0, description="Amplitude or largest excursion [m].")
    middle_m: float = Field(0.0, description="Mean position of the motion [m].")
    frequency_hz: float = Field(1.0, gt=0.0, description="Frequency, or upper end of the band of random motion [Hz].")
    current: Literal["constant", "half-sine", "steps", "random"] = Field("constant", description="Kind of current.")
    current_a: float = Field(0.0, ge=0.0, description="Level, amplitude or largest value of the current [A].")
    duration_s: float = Field(10.0, gt=0.0, description="Duration [s].")
    repeat_of: str = Field("", description="Test whose command is repeated.")
    later: bool = Field(
        False,
        description="Whether the test is made after the others; effects given as shares then have the strength of the "
        "other tests.",
    )
    pause_s: float = Field(0.4, gt=0.0, description="Pause of `hold`, or time between steps of current [s].")
