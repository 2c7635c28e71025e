"""Settings of the controller: a section of the configuration, and the options of :mod:`mrpipe.control.assembly`."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class ControllerSettings(Section):
    """The real-time controller of Figure 5.3."""

    rate_hz: float | None = Field(
        None,
        gt=0.0,
        description="Sampling rate; null: the values of the thesis, 200 Hz, and 500 Hz for a perfect damper.",
    )
    delay_s: float = Field(0.0, ge=0.0, description="Delay from sampling to output.")
    velocity: Literal["kalman", "difference", "measured"] = Field(
        "kalman", description="Kinematic Kalman filter, backward difference, or a perfect velocity sensor."
    )
    kalman_displacement_noise_m: float = Field(
        20e-6, gt=0.0, description="Displacement noise that the filter assumes [m]."
    )
    kalman_acceleration_noise_m_s2: float = Field(
        0.1, gt=0.0, description="Acceleration noise that the filter assumes [m/s^2]."
    )
    kalman_bias_drift_m_s2: float = Field(
        0.0,
        ge=0.0,
        description="Drift of the bias of the accelerometer that the filter follows: standard deviation of its change "
        "in one second [m/s^2]; 0: no bias state.",
    )
    inverse: Literal["network", "model"] = Field(
        "network",
        description="Inverse of the damper: the trained network, or the inverse of the post-yield force of the "
        "identified model.",
    )
    inverse_request: Literal["steady", "history"] = Field(
        "steady",
        description="Past values for an inverse network. `steady`: the present values. `history`: the past desired "
        "forces, as in (2.9); at a reversal no measured force has such a history, so that the network answers with "
        "spikes.",
    )
    observer_force: Literal["measured", "desired"] = Field(
        "measured",
        description="Force that the observer of `lqg` takes for that of the damper. `measured`: the reading of a load "
        "cell. `desired`: the last desired force, for a damper without a load cell; the estimate is wrong where the "
        "damper cannot give this force.",
    )
    residual_force_n: float | None = Field(
        None,
        ge=0.0,
        description="Switch force: below this desired force the drive is 0, P2 (24); null: residual force of the "
        "damper.",
    )
    low_pass_hz: float | None = Field(60.0, gt=0.0, description="Butterworth low-pass on the drive; null: none.")
    low_pass_delay_s: float | None = Field(
        None,
        gt=0.0,
        description="Delay of the low-pass at low frequencies, which determines its cut-off instead of `low_pass_hz`; "
        "paper P5 filters the current with 0.05 s.",
    )
    drive_limit: float | None = Field(None, gt=0.0, description="Largest drive; null: that of the damper.")
    dead_band_m_s: float = Field(0.0, ge=0.0, description="Speed below which the direction of motion is kept.")
    friction_rounding_m_s: float | None = Field(
        None,
        ge=0.0,
        description="Speed over which friction of fdns changes its sign; 0: the jump of (4.18); null: as calibrated.",
    )
    extremum_memory_periods: float = Field(
        0.75,
        gt=0.0,
        description="Time, in natural periods without damper force, after which an extremum counts although the "
        "displacement has not returned from it.",
    )
    extremum_step_m: float | None = Field(
        None,
        gt=0.0,
        description="Distance by which the displacement must return before an extremum counts (X of fdns); null: five "
        "times the noise of the displacement.",
    )
    extremum_share: float = Field(0.1, ge=0.0, lt=1.0, description="The same as a share of the last amplitude.")
    largest_displacement_m: float | None = Field(
        None,
        gt=0.0,
        description="Largest plausible displacement; larger readings are refused. null: 100 dB above the noise.",
    )
    largest_velocity_m_s: float | None = Field(
        None, gt=0.0, description="The same for a measured velocity; null: from displacement and acceleration."
    )
    largest_acceleration_m_s2: float | None = Field(
        None, gt=0.0, description="The same for accelerations; null: 100 dB above the noise."
    )
    largest_force_n: float | None = Field(
        None, gt=0.0, description="The same for a measured force; null: ten times the largest force of the damper."
    )
    fault_hold_s: float = Field(
        0.02,
        ge=0.0,
        description="Time for which the last good reading replaces a refused one; then the drive is `safe_drive`.",
    )
    safe_drive: float = Field(0.0, ge=0.0, description="Drive after that time, while readings are refused.")

    @property
    def cutoff_hz(self) -> float | None:
        """Cut-off of the second-order Butterworth low-pass on the drive [Hz]; None: no filter.

        Its delay at low frequencies is sqrt(2) over the angular cut-off.
        """
        if self.low_pass_delay_s is None:
            return self.low_pass_hz
        return math.sqrt(2.0) / (2.0 * math.pi * self.low_pass_delay_s)
