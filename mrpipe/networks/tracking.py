"""Uses of an inverse network: the round trip force to drive to force, and emulated viscous damping (thesis 2.4.3)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.networks.assembly import History, samples
from mrpipe.networks.evaluation import ErrorFigures, by_regime, error_figures, regimes_of
from mrpipe.networks.network import Network
from mrpipe.networks.options import ViscousEmulationOptions
from mrpipe.words import in_percent


@dataclass(frozen=True)
class Tracking:
    """A desired force, the drive that the inverse network computes, and the force that results.

    Attributes
    ----------
    sample
        Index of each entry in the history, shape (n,).
    desired_n, drive, drive_raw, force_n
        Arrays of shape (n,): desired force [N], drive within its limits and as the network computed it [A or V], and
        force [N].
    """

    sample: IntArray
    desired_n: FloatArray
    drive: FloatArray
    drive_raw: FloatArray
    force_n: FloatArray


def round_trip(inverse: Network, forward: Network, history: History, drive_limit: float) -> Tracking:
    """Compute the drive from force and motion (inverse network), and the force of this drive (forward network).

    Parameters
    ----------
    inverse, forward
        Networks of one sampling rate.
    history
        History whose `force` is the desired force; its `drive` is not used.
    drive_limit
        Largest drive [A or V]; the computed drive is limited to the range from 0 to this value.
    """
    rows = samples(history, inverse.features)
    estimate = inverse.predict(rows.features)
    limited = np.clip(estimate, 0.0, drive_limit)
    kept = [int(np.sum(rows.test == index)) for index in range(len(history.names))]
    driven = replace(
        history,
        channels={name: values[rows.sample] for name, values in history.channels.items()} | {"drive": limited},
        starts=np.cumsum([0, *kept], dtype=np.int64),
    )
    answer = samples(driven, forward.features)
    return Tracking(
        sample=rows.sample[answer.sample],
        desired_n=driven.channels["force"][answer.sample],
        drive=limited[answer.sample],
        drive_raw=estimate[answer.sample],
        force_n=forward.predict(answer.features),
    )


def sinusoidal_motion(
    amplitude_m: float,
    frequency_hz: float,
    damping_n_s_m: float,
    sampling_rate_hz: float,
    drive_unit: str,
    periods: int = 4,
) -> History:
    """Return sinusoidal motion with the force c v of a viscous damper as the desired one (2.4.3)."""
    time = np.arange(round(periods / frequency_hz * sampling_rate_hz) + 1) / sampling_rate_hz
    rate = 2.0 * np.pi * frequency_hz
    velocity = amplitude_m * rate * np.cos(rate * time)
    channels = {
        "displacement": amplitude_m * np.sin(rate * time),
        "velocity": velocity,
        "acceleration": -amplitude_m * rate**2 * np.sin(rate * time),
        "drive": np.zeros(len(time)),
        "force": damping_n_s_m * velocity,
    }
    starts = np.array([0, len(time)], dtype=np.int64)
    return History(("viscous",), channels, starts, (True,), sampling_rate_hz, drive_unit)


@dataclass(frozen=True)
class ViscousEmulation:
    """Viscous damper emulated by the inverse and the forward network.

    Attributes
    ----------
    time_s, displacement_m, velocity_m_s
        Shape (n,).
    tracking
        Desired force, drive, and obtained force.
    damping_n_s_m, frequency_hz, amplitude_m
        Requested viscous coefficient [N s/m], frequency [Hz], and amplitude [m].
    figures, fast
        Errors of the force: of all samples, and of samples with more than half the peak velocity.
    negative_share
        Share of time in which the inverse network computes a negative drive.
    outside_training_range
        Share of the inputs of the inverse network outside the training range.
    """

    time_s: FloatArray
    displacement_m: FloatArray
    velocity_m_s: FloatArray
    tracking: Tracking
    damping_n_s_m: float
    frequency_hz: float
    amplitude_m: float
    figures: ErrorFigures
    fast: ErrorFigures
    negative_share: float
    outside_training_range: float


def emulate_viscous(
    inverse: Network,
    forward: Network,
    training: History,
    drive_limit: float,
    frequency_hz: float,
    amplitude_m: float | None = None,
    damping_n_s_m: float | None = None,
) -> ViscousEmulation:
    """Emulate pure viscous damping in sinusoidal motion (thesis 2.4.3).

    Parameters
    ----------
    inverse, forward
        The networks.
    training
        The training history, for the defaults.
    drive_limit
        Largest drive, A or V.
    frequency_hz, amplitude_m
        Frequency [Hz] and amplitude [m] of the motion; the default amplitude is the 95th percentile of the training
        displacement.
    damping_n_s_m
        Viscous coefficient [N s/m]; by default its peak force is half the 99th percentile of the training force.
    """
    amplitude = amplitude_m or float(np.percentile(np.abs(training.channels["displacement"]), 95))
    peak = amplitude * 2.0 * np.pi * frequency_hz
    damping = damping_n_s_m or 0.5 * float(np.percentile(np.abs(training.channels["force"]), 99)) / peak
    motion = sinusoidal_motion(amplitude, frequency_hz, damping, inverse.features.sampling_rate_hz, training.drive_unit)
    tracking = round_trip(inverse, forward, motion, drive_limit)
    place = tracking.sample
    velocity = motion.channels["velocity"][place]
    fast = np.abs(velocity) > 0.5 * peak
    return ViscousEmulation(
        time_s=place / inverse.features.sampling_rate_hz,
        displacement_m=motion.channels["displacement"][place],
        velocity_m_s=velocity,
        tracking=tracking,
        damping_n_s_m=damping,
        frequency_hz=frequency_hz,
        amplitude_m=amplitude,
        figures=error_figures(tracking.desired_n, tracking.force_n),
        fast=error_figures(tracking.desired_n[fast], tracking.force_n[fast]),
        negative_share=float(np.mean(tracking.drive_raw < -0.01 * drive_limit)),
        outside_training_range=inverse.outside_training_range(samples(motion, inverse.features).features),
    )


@dataclass(frozen=True)
class TrackingJudgement:
    """Force tracking of a controller with an inverse network.

    Attributes
    ----------
    pooled, regimes
        Error of the force of the round trip on the validation tests: of all samples, and by regime.
    viscous
        Emulation of viscous damping.
    """

    pooled: ErrorFigures
    regimes: dict[str, ErrorFigures]
    viscous: ViscousEmulation

    @property
    def finding(self) -> str:
        """Message for the user; empty if there is none."""
        share = self.viscous.outside_training_range
        if share <= 0.01:
            return ""
        return (
            f"the viscous damping to be emulated lies {in_percent(share, 1)} of the time outside the training range: "
            "lower train_inverse.viscous.amplitude_m, frequency_hz or damping_n_s_m"
        )

    def summary(self) -> dict[str, Any]:
        """Return the numbers by name."""
        viscous = self.viscous
        return {
            "round_trip_nrmse": self.pooled.nrmse,
            "round_trip_regime_nrmse": {name: item.nrmse for name, item in self.regimes.items()},
            "viscous_nrmse": viscous.figures.nrmse,
            "viscous_fast_nrmse": viscous.fast.nrmse,
            "viscous_damping_n_s_m": viscous.damping_n_s_m,
            "viscous_negative_drive_share": viscous.negative_share,
            "viscous_outside_training_range_share": viscous.outside_training_range,
        }


def judge_tracking(
    inverse: Network,
    forward: Network,
    training: History,
    validation: History,
    options: ViscousEmulationOptions,
    yield_travel_m: float,
) -> TrackingJudgement:
    """Assess the round trip on the validation tests and emulate a viscous damper.

    Parameters
    ----------
    inverse, forward
        Networks of one sampling rate.
    training, validation
        Histories; the largest drive of the training tests limits the drive.
    options
        Motion and damping of the emulation.
    yield_travel_m
        Travel at the end of the pre-yield regime [m].
    """
    limit = float(training.channels["drive"].max())
    trip = round_trip(inverse, forward, validation, limit)
    regimes = regimes_of(validation, yield_travel_m)[trip.sample]
    viscous = emulate_viscous(
        inverse, forward, training, limit, options.frequency_hz, options.amplitude_m, options.damping_n_s_m
    )
    return TrackingJudgement(
        error_figures(trip.desired_n, trip.force_n), by_regime(trip.desired_n, trip.force_n, regimes), viscous
    )
