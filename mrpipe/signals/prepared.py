"""Prepared test: filtered, without offsets, differentiated, as input of every estimator of the bench."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray, IntArray
from mrpipe.signals.channel_noise import displacement_cutoff, motion_frequency, resolution, steady_noise


@dataclass(frozen=True)
class PreparedTest:
    """Test after `prepare`; all channels have the same times, SI, shape (n,).

    Attributes
    ----------
    name, role
        As in campaign.yaml (training, validation, repeat).
    sampling_rate_hz
        Working rate.
    time_s
        Clock, shape (n,) [s].
    displacement_m
        Filtered, without offset, shape (n,).
    velocity_m_s
        Shape (n,).
    acceleration_m_s2
        Shape (n,).
    drive
        Coil current [A] or voltage [V], see `drive_unit`.
    force_n
        Filtered, without offset, shape (n,).
    force_raw_n, displacement_raw_m
        Offset-free but unfiltered, for estimators with a separate noise model.
    drive_raw
        The drive before the low-pass; empty: `drive` was not filtered.
    cycles
        Start indices of the steady cycles at upward zero crossings of displacement, with the end of the last one;
        empty where the motion is not periodic.
    drive_unit
        A or V.
    excitation
        `periodic` or `random`.
    drive_is_set_point
        Whether the drive is a set point instead of a recorded channel.
    displacement_offset_m, force_offset_n
        Static offsets that were removed from the channels; their sum with the channels is the measured record.
    displacement_noise_m, displacement_noise_band_hz
        Standard deviation and band of the displacement's noise where it was put together from several sensors, so that
        the channel itself does not show; 0 if it does. Not written to the artifact.
    displacement_noise_repeats
        Share of the variance of that noise which repeats where the motion repeats: rounding, and motion that a filter
        took away. Not written to the artifact.
    motion_band_hz
        Highest frequency of the motion if the noise was removed from the displacement (see
        :mod:`mrpipe.signals.shared_noise`); 0 if it was not. Not written to the artifact.
    recorded_step_m, recorded_dither_m
        Step of the displacement as recorded, and its noise before rounding, if the noise was removed since; 0 if it was
        not. Not written to the artifact.
    """

    name: str
    role: str
    sampling_rate_hz: float
    time_s: FloatArray
    displacement_m: FloatArray
    velocity_m_s: FloatArray
    acceleration_m_s2: FloatArray
    drive: FloatArray
    force_n: FloatArray
    displacement_raw_m: FloatArray
    force_raw_n: FloatArray
    cycles: IntArray
    drive_unit: str
    excitation: str = "periodic"
    drive_is_set_point: bool = False
    displacement_offset_m: float = 0.0
    force_offset_n: float = 0.0
    displacement_noise_m: float = 0.0
    displacement_noise_band_hz: float = 0.0
    displacement_noise_repeats: float = 0.0
    motion_band_hz: float = 0.0
    recorded_step_m: float = 0.0
    recorded_dither_m: float = 0.0
    drive_raw: FloatArray = field(default_factory=lambda: np.zeros(0))

    @property
    def dt(self) -> float:
        """Sampling interval [s]."""
        return 1.0 / self.sampling_rate_hz

    @property
    def recorded_drive(self) -> FloatArray:
        """The drive without a low-pass, which makes a jump several milliseconds long, shape (n,)."""
        return self.drive_raw if self.drive_raw.size else self.drive

    # spectra of whole records are cached, because an estimator that compares filters or rates reads them repeatedly

    @cached_property
    def force_noise_n(self) -> float:
        """Standard deviation of the noise of the unfiltered force [N]."""
        return steady_noise(self.force_raw_n, self.sampling_rate_hz)

    @cached_property
    def force_step_n(self) -> float:
        """Step of a quantised force [N]; 0 if it is not quantised."""
        return resolution(self.force_raw_n)

    @cached_property
    def channel_noise_m(self) -> float:
        """Standard deviation of the noise of the unfiltered displacement over its whole band [m]."""
        return steady_noise(self.displacement_raw_m, self.sampling_rate_hz)

    @cached_property
    def rounding_share(self) -> float:
        """Share of the variance of the displacement's noise that is rounding; 0 if it is not quantised."""
        rounding = self.displacement_step_m / np.sqrt(12.0)
        return float(min(1.0, (rounding / max(self.channel_noise_m, 1e-300)) ** 2))

    @cached_property
    def displacement_step_m(self) -> float:
        """Step of a quantised displacement [m]; 0 if it is not quantised."""
        return self.recorded_step_m or resolution(self.displacement_raw_m)

    @cached_property
    def displacement_dither_m(self) -> float:
        """Standard deviation of the noise in a quantised displacement before it was rounded [m]."""
        if self.recorded_step_m > 0.0:
            return self.recorded_dither_m
        return float(np.sqrt(max(self.channel_noise_m**2 - self.displacement_step_m**2 / 12.0, 0.0)))

    @cached_property
    def motion_frequency_hz(self) -> float:
        """Frequency of the motion [Hz]; 0 without motion."""
        return motion_frequency(self.displacement_m, self.velocity_m_s)

    @cached_property
    def displacement_cutoff_hz(self) -> float:
        """Frequency above which the displacement is below its noise, with a margin [Hz]."""
        return displacement_cutoff(self.displacement_raw_m, self.sampling_rate_hz, self.motion_frequency_hz)


_CHANNELS = {
    "time": ("time_s", "s"),
    "displacement": ("displacement_m", "m"),
    "velocity": ("velocity_m_s", "m/s"),
    "acceleration": ("acceleration_m_s2", "m/s^2"),
    "drive": ("drive", ""),
    "force": ("force_n", "N"),
    "displacement_raw": ("displacement_raw_m", "m"),
    "force_raw": ("force_raw_n", "N"),
    "drive_raw": ("drive_raw", ""),
}


def write_prepared(artifact: ArtifactWriter, tests: list[PreparedTest]) -> None:
    """Write tests to `tests/<name>/...` of an artifact."""
    for test in tests:
        for channel, (attribute, unit) in _CHANNELS.items():
            artifact.put(
                f"tests/{test.name}/{channel}", getattr(test, attribute), unit=unit or test.drive_unit, dims=("time",)
            )
        artifact.put(f"tests/{test.name}/cycles", test.cycles.astype(np.int64), unit="1", dims=("cycle",))
        artifact.attributes(
            f"tests/{test.name}",
            role=test.role,
            sampling_rate_hz=test.sampling_rate_hz,
            drive_unit=test.drive_unit,
            excitation=test.excitation,
            drive_is_set_point=test.drive_is_set_point,
            displacement_offset_m=test.displacement_offset_m,
            force_offset_n=test.force_offset_n,
        )


def read_prepared(artifact: Artifact) -> list[PreparedTest]:
    """Read the tests that :func:`write_prepared` wrote, in the order of writing."""
    tests = []
    for name in artifact.members("tests"):
        group = f"tests/{name}"
        notes = artifact.attributes(group)
        present = set(artifact.members(group))
        channels = {
            attribute: artifact.array(f"{group}/{key}")
            for key, (attribute, _) in _CHANNELS.items()
            # a run of an earlier version holds no unfiltered drive
            if key in present or key != "drive_raw"
        }
        tests.append(
            PreparedTest(
                name=name,
                role=str(notes["role"]),
                sampling_rate_hz=float(notes["sampling_rate_hz"]),
                cycles=artifact.array(f"{group}/cycles").astype(np.int64),
                drive_unit=str(notes["drive_unit"]),
                excitation=str(notes["excitation"]),
                drive_is_set_point=bool(notes["drive_is_set_point"]),
                displacement_offset_m=float(notes["displacement_offset_m"]),
                force_offset_n=float(notes["force_offset_n"]),
                displacement_noise_m=0.0,
                displacement_noise_band_hz=0.0,
                displacement_noise_repeats=0.0,
                recorded_step_m=0.0,
                recorded_dither_m=0.0,
                motion_band_hz=0.0,
                **channels,
            )
        )
    return tests
