"""Options of a controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mrpipe.control.settings import ControllerSettings

DYNAMIC_RANGE = 1e5
"""Largest reading of a sensor over its noise, where the settings give none: 100 dB, more than 16 bits can hold."""

_SETTINGS = ControllerSettings()
"""Source of the defaults, so that options and settings have the same ones."""


@dataclass(frozen=True)
class ControllerOptions:
    """Options of the controller.

    Attributes
    ----------
    rate_hz
        Sampling rate [Hz] (200 and 500 in the thesis).
    velocity
        `kalman` (5.1 to 5.3), `measured` (a perfect velocity sensor) or `difference` (backward difference).
    displacement_noise_m, acceleration_noise_m_s2
        RMS noise that the Kalman filter assumes.
    bias_drift_m_s2
        Drift of the bias of the accelerometer per second that the filter follows [m/s^2]; 0: no bias state.
    inverse_request
        Past values of an inverse network. `steady`: the present values, so that the network gives the drive that would
        hold this force at this speed. `history`: the forces that were desired before. A network was trained on measured
        forces, which build up over the yield displacement after a reversal, whereas a desired force jumps at a
        reversal.
    observer_force
        Force that the observer of `lqg` takes for that of the damper: `measured` by a load cell, or `desired`.
    residual_force_n
        Switch P2 (24): below this desired force [N] the drive is 0; 0: no switch.
    low_pass_hz
        Cut-off of the second-order Butterworth low-pass on the drive [Hz]; None: no low-pass.
    drive_limit
        Largest drive [A or V]; None: that of the inverse or of the damper.
    dead_band_m_s
        Speed below which the direction of motion is kept [m/s].
    friction_rounding_m_s
        Speed v0 over which the friction of fdns changes its sign, tanh(v/v0) [m/s]; 0: the jump of (4.18), with which
        the noise of the velocity makes the force chatter.
    extremum_step_m, extremum_share
        Distance by which the displacement must return from an extremum before it counts: in metres, or as share of the
        amplitude.
    extremum_memory_s
        Time after which a pending extremum is confirmed even if the displacement does not return [s]; three quarters of
        a period is suitable.
    largest_displacement_m, largest_velocity_m_s, largest_acceleration_m_s2, largest_force_n
        Largest plausible readings; larger ones and those that are not finite are refused. None: what a sensor of
        :data:`DYNAMIC_RANGE` can read.
    saturation_force_n
        Largest force of the damper [N]; None: not known.
    fault_hold_s
        Time [s] for which a refused reading is replaced by the last good one before the drive is set to `safe_drive`.
    safe_drive
        Drive while the readings cannot be used [A or V].
    """

    rate_hz: float = 200.0
    velocity: Literal["kalman", "measured", "difference"] = _SETTINGS.velocity
    displacement_noise_m: float = _SETTINGS.kalman_displacement_noise_m
    acceleration_noise_m_s2: float = _SETTINGS.kalman_acceleration_noise_m_s2
    bias_drift_m_s2: float = _SETTINGS.kalman_bias_drift_m_s2
    inverse_request: Literal["steady", "history"] = _SETTINGS.inverse_request
    observer_force: Literal["measured", "desired"] = _SETTINGS.observer_force
    residual_force_n: float = 0.0
    low_pass_hz: float | None = _SETTINGS.low_pass_hz
    drive_limit: float | None = None
    dead_band_m_s: float = _SETTINGS.dead_band_m_s
    friction_rounding_m_s: float = 0.0
    extremum_step_m: float = 1e-4
    extremum_share: float = _SETTINGS.extremum_share
    extremum_memory_s: float = 0.6
    largest_displacement_m: float | None = None
    largest_velocity_m_s: float | None = None
    largest_acceleration_m_s2: float | None = None
    largest_force_n: float | None = None
    saturation_force_n: float | None = None
    fault_hold_s: float = _SETTINGS.fault_hold_s
    safe_drive: float = _SETTINGS.safe_drive
