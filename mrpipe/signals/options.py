"""Options of the preparation of bench tests; the section `prepare`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field, model_validator

from mrpipe.artifacts import FloatArray
from mrpipe.options import Section
from mrpipe.signals.faults import KnownFaults

if TYPE_CHECKING:
    from mrpipe.signals.kalman import KalmanGains

Motion = Literal["displacement", "displacement-and-acceleration"]

_NO_FAULTS = KnownFaults()


class SensorCorrections(Section):
    """Faults of sensors and time base, taken out before all else; `close-loop` writes them to corrections.yaml."""

    force_late_s: float = Field(
        _NO_FAULTS.force_late_s,
        ge=-0.1,
        le=0.1,
        description="Time by which the force is recorded later than displacement and drive.",
    )
    force_offset_n: dict[str, float] = Field(
        default_factory=dict,
        description="Offset of the load cell in a test (name: N), in addition to that of all tests.",
    )
    force_per_drive_n: float = Field(
        _NO_FAULTS.force_per_drive_n, description="Offset of the load cell for each A or V of drive [N]."
    )
    force_per_drive_squared_n: float = Field(
        _NO_FAULTS.force_per_drive_squared_n, description="The same for the square of the drive."
    )
    drive_lag_s: float = Field(
        _NO_FAULTS.drive_lag_s, ge=0.0, le=1.0, description="First-order lag of the drive in these two offsets."
    )
    force_drift_n_s: float = Field(
        _NO_FAULTS.force_drift_n_s, description="Drift of the load cell from the beginning of each test [N/s]."
    )


class PreparationOptions(Section):
    """Options for filtering measured tests, removing offsets, and differentiation."""

    motion: Motion = Field(
        "displacement",
        description="Sensors that give the motion. displacement-and-acceleration: the motion that agrees best with "
        "both, which follows the displacement at low frequencies and the acceleration at high ones; delay and gain of "
        "the accelerometer are estimated. It lowers the noise of the velocity if the displacement sensor is noisy.",
    )
    working_rate_hz: float = Field(
        0.0,
        ge=0.0,
        description="Sampling rate to which all tests are converted; 0: the lowest rate of the campaign that is at "
        "least 200 Hz, so that no test is interpolated to a higher rate.",
    )
    cutoff_hz: float = Field(
        100.0,
        gt=0.0,
        description="Cut-off of the low-pass on displacement, acceleration, drive and force (thesis 2.3.1).",
    )
    velocity_cutoff_hz: float = Field(
        20.0, gt=0.0, description="Cut-off of the second low-pass, on the differentiated velocity (thesis 2.3.1)."
    )
    order: int = Field(2, ge=1, le=8, description="Order of the Butterworth filters.")
    phase: Literal["zero", "causal"] = Field(
        "zero",
        description="zero: forward and backward filters without delay; causal: as in a real-time controller, with a "
        "delay of the velocity of 11 ms.",
    )
    cutoff_choice: Literal["by-motion", "fixed", "criterion"] = Field(
        "by-motion",
        description="fixed: the cut-offs above; criterion: for each test and channel the frequency above which noise "
        "exceeds the signal; by-motion: fixed for sines, criterion for every other motion.",
    )
    differentiation: Literal["backward", "central", "savitzky-golay", "kalman"] = Field(
        "backward",
        description="Velocity from displacement: backward difference (2.5; centred if phase is zero), central "
        "difference, Savitzky-Golay, or the kinematic Kalman filter (5.1 to 5.3), which needs an acceleration.",
    )
    savitzky_golay_window_s: float = Field(0.03, gt=0.0, description="Window of the Savitzky-Golay differentiation.")
    kalman_displacement_noise_m: float = Field(
        20e-6,
        ge=0.0,
        description="Noise of the displacement sensor (standard deviation) for the Kalman filter; 0 estimates it from "
        "the spectrum of each test.",
    )
    kalman_acceleration_noise_m_s2: float = Field(
        0.1,
        ge=0.0,
        description="Noise of the accelerometer (standard deviation) for the Kalman filter; 0 estimates it as above.",
    )
    kalman_bias_drift_m_s2: float = Field(
        0.0,
        ge=0.0,
        description="Drift of the bias of the accelerometer that the Kalman filter follows: standard deviation of its "
        "change in one second [m/s^2]; 0: no bias state.",
    )
    offset: Literal["test", "campaign", "off"] = Field(
        "test",
        description="Sensor offsets that are removed: one for each test, one for the whole campaign (median over the "
        "tests), or none.",
    )
    displacement_late_s: float = Field(
        0.0,
        ge=-0.1,
        le=0.1,
        description="Time by which the displacement is recorded later than the other channels (value of the effect "
        "channel-skew); it is corrected.",
    )
    cycles: int = Field(10, ge=0, description="Number of steady cycles that are kept of each periodic test; 0: all.")
    settle_cycles: int = Field(
        1, ge=0, description="Number of steady cycles that are left out at the beginning, if there are enough."
    )
    corrections: SensorCorrections = Field(
        SensorCorrections(), description="Known faults of sensors, which are corrected."
    )

    @model_validator(mode="after")
    def _check_motion(self) -> PreparationOptions:
        if self.motion == "displacement-and-acceleration" and self.phase == "causal":
            raise ValueError("motion: displacement-and-acceleration uses later samples; set phase to zero")
        return self

    @property
    def faults(self) -> KnownFaults:
        """The known faults, as the preparation takes them out."""
        return KnownFaults(**self.corrections.model_dump())

    def gains(self, displacement: FloatArray, acceleration: FloatArray, rate: float) -> KalmanGains:
        """Return the gains of the kinematic Kalman filter; noise levels of 0 are estimated from the channels."""
        # the configuration needs this module without numba
        from mrpipe.signals.kalman import continuous_kalman_gains
        from mrpipe.signals.spectra import noise_level

        return continuous_kalman_gains(
            self.kalman_displacement_noise_m or max(noise_level(displacement, rate), 1e-9),
            self.kalman_acceleration_noise_m_s2 or max(noise_level(acceleration, rate), 1e-6),
            self.kalman_bias_drift_m_s2,
            rate,
        )
