"""Preparation of a recording: uniform times, working rate, filters, offsets, velocity, cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.signals.accelerometer import with_accelerometer
from mrpipe.signals.cycles import SteadyCycles, choose_cycles, find_steady_cycles, is_sine
from mrpipe.signals.differentiation import backward_difference, central_difference, savitzky_golay
from mrpipe.signals.faults import require_known
from mrpipe.signals.filters import (
    advance,
    butterworth_lowpass,
    even_clock,
    resample,
    samples_needed,
    usable_cutoff,
)
from mrpipe.signals.kalman import kinematic_kalman, kinematic_smoother
from mrpipe.signals.offsets import (
    balanced_extremes,
    drive_favours_a_side,
    force_intercept,
    mean_over_cycles,
)
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.prepared import PreparedTest
from mrpipe.signals.spectra import cutoff_by_criterion

VELOCITY_SHARE = 0.99
"""Share of the power of a random motion's velocity that the cut-off by criterion keeps."""


CONTROLLER_RATE_HZ = 200.0
"""Lowest working rate of a campaign with several rates [Hz], because the networks run at it (thesis 2.3.1)."""

LENT_OFFSET_SPREAD = 0.05
"""Ratio of the spread between tests to the deviation of the channel, up to which an offset is one of the sensor."""


@dataclass(frozen=True)
class Preparation:
    """Prepared test and the steps of its preparation.

    Attributes
    ----------
    test
        The prepared test.
    cutoffs_hz
        Channel -> cut-off used; a channel that was not filtered is missing.
    frequency_hz, amplitude_m
        Frequency [Hz] and amplitude [m] of the steady cycles; 0 for a random motion.
    before
        Channels on the working rate before filters and offsets, shape (n,) each, for spectra.
    findings
        Messages for the user, one line each.
    """

    test: PreparedTest
    cutoffs_hz: Mapping[str, float]
    frequency_hz: float
    amplitude_m: float
    before: Mapping[str, FloatArray]
    findings: tuple[str, ...] = ()


@dataclass(frozen=True)
class PreparedCampaign:
    """All prepared tests, and findings on the whole campaign, one line each."""

    tests: tuple[Preparation, ...]
    findings: tuple[str, ...] = ()


@dataclass
class _Work:
    """One segment while it is prepared."""

    name: str
    role: str
    rate: float
    time: FloatArray
    channels: dict[str, FloatArray]
    filtered: dict[str, FloatArray] = field(default_factory=dict)
    cutoffs: dict[str, float] = field(default_factory=dict)
    by_criterion: bool = False
    cycles: SteadyCycles = field(default_factory=lambda: SteadyCycles(np.zeros(0, dtype=np.int64)))
    offsets: dict[str, float] = field(default_factory=dict)
    trusted: set[str] = field(default_factory=set)
    findings: list[str] = field(default_factory=list)


def prepare_campaign(
    campaign: Campaign, options: PreparationOptions, progress: Progress = no_progress
) -> PreparedCampaign:
    """Prepare every test of a bench campaign; a test with several segments becomes several prepared tests.

    Raises
    ------
    UserError
        If the campaign is not one of a damper bench, or a test is too short for the filters.
    """
    source = str(campaign.directory)
    if campaign.rig != "damper-bench":
        raise UserError(source, "rig", f"is {campaign.rig}", "prepare works on a damper-bench campaign")
    _require_rate(options)
    rate = options.working_rate_hz or common_rate([test.sampling_rate_hz for test in campaign.recordings])
    works = []
    for count, recording in enumerate(campaign.recordings):
        progress(0.7 * count / len(campaign.recordings), recording.name)
        for index, (begin, end) in enumerate(recording.segments):
            name = recording.name if len(recording.segments) == 1 else f"{recording.name}-{index + 1}"
            work = _on_working_rate(recording, begin, end, name, rate)
            channels = work.channels
            channels["displacement"] = advance(channels["displacement"], options.displacement_late_s, rate)
            channels["force"] = options.faults.force(name, channels["force"], channels["drive"], rate)
            _require_length(work, options, str(recording.file or source))
            works.append(work)
    require_known(options.faults, [work.name for work in works])
    findings = with_accelerometer({work.name: work.channels for work in works}, rate, options.motion, source)
    for work in works:
        _filter(work, options)
        _measure_offsets(work)
    if options.offset == "campaign":
        _share_offsets(works)
    else:
        _lend_offsets(works)
    results = []
    for count, work in enumerate(works):
        progress(0.7 + 0.3 * count / len(works), work.name)
        results.append(_finish(work, options, campaign))
    return PreparedCampaign(tuple(results), tuple(findings))


def common_rate(rates_hz: Sequence[float]) -> float:
    """Return the lowest rate that is at least 200 Hz, the rate of the controller; without one, the highest rate."""
    enough = [rate for rate in rates_hz if rate >= CONTROLLER_RATE_HZ]
    return min(enough) if enough else max(rates_hz)


def _on_working_rate(recording: Recording, begin: int, end: int, name: str, rate: float) -> _Work:
    time = recording.time_s[begin:end]
    native = recording.sampling_rate_hz
    even = time[0] + np.arange(int(np.floor((time[-1] - time[0]) * native + 1e-3)) + 1) / native
    channels = {
        key: resample(even_clock(time, values[begin:end], native, even), native, rate)
        for key, values in recording.channels.items()
    }
    # an anti-aliasing filter overshoots at steps; a drive stays within what was recorded
    channels["drive"] = np.clip(
        channels["drive"], recording.channels["drive"][begin:end].min(), recording.channels["drive"][begin:end].max()
    )
    samples = channels["displacement"].size
    return _Work(name, recording.role, rate, time[0] + np.arange(samples) / rate, channels)


def _require_rate(options: PreparationOptions) -> None:
    """Refuse a requested rate that is too low for the band of the velocity; a recorded rate may be too low."""
    asked, cutoff = options.working_rate_hz, options.velocity_cutoff_hz
    if 0.0 < asked < 2.5 * cutoff:
        problem = f"is {asked:g}, too slow for a velocity cut-off of {cutoff:g} Hz"
        raise UserError("prepare", "working_rate_hz", problem, f"give {2.5 * cutoff:g} Hz at least")


def length_needed(options: PreparationOptions, rate: float) -> int:
    """Return the smallest number of samples at a working rate [Hz] for the filters of these options."""
    return max(samples_needed(min(options.cutoff_hz, options.velocity_cutoff_hz), rate), 20)


def _require_length(work: _Work, options: PreparationOptions, source: str) -> None:
    needed = length_needed(options, work.rate)
    if work.time.size < needed:
        raise UserError(
            source,
            f"test {work.name}",
            f"has {work.time.size} samples at {work.rate:g} Hz, its filters need {needed}",
            f"give a test of {needed / work.rate:.3g} s at least",
        )


def _filter(work: _Work, options: PreparationOptions) -> None:
    """Low-pass every channel; the drive keeps its range."""
    displacement = work.channels["displacement"]
    rough = butterworth_lowpass(displacement, options.cutoff_hz, work.rate, order=options.order)
    cycles = find_steady_cycles(rough, work.rate)
    work.by_criterion = options.cutoff_choice == "criterion" or (
        options.cutoff_choice == "by-motion" and not is_sine(rough, cycles)
    )
    for name, values in work.channels.items():
        cutoff = options.cutoff_hz
        if work.by_criterion and np.ptp(values) > 0.0:
            share = VELOCITY_SHARE if name == "displacement" and not cycles.periodic else None
            cutoff = cutoff_by_criterion(values, work.rate, velocity_share=share)
        if np.ptp(values) == 0.0 or usable_cutoff(cutoff, work.rate) is None:
            work.filtered[name] = values
            continue
        work.cutoffs[name] = cutoff
        smooth = butterworth_lowpass(values, cutoff, work.rate, order=options.order, phase=options.phase)
        work.filtered[name] = np.clip(smooth, values.min(), values.max()) if name == "drive" else smooth
    if not work.by_criterion and usable_cutoff(options.cutoff_hz, work.rate) is None:
        work.findings.append(
            f"no low-pass at {options.cutoff_hz:g} Hz, because data at {work.rate:g} Hz hold almost nothing above it"
        )
    work.cycles = find_steady_cycles(work.filtered["displacement"], work.rate)


def _measure_offsets(work: _Work) -> None:
    signals = work.filtered
    displacement = signals["displacement"]
    if work.cycles.periodic:
        starts = work.cycles.starts
        work.offsets = {name: balanced_extremes(signals[name], starts) for name in ("displacement", "force")}
        if "acceleration" in signals:
            work.offsets["acceleration"] = mean_over_cycles(signals["acceleration"], starts)
        work.trusted = set(work.offsets)
        if not drive_favours_a_side(signals["drive"], starts):
            return
        work.trusted.remove("force")
    velocity = central_difference(butterworth_lowpass(displacement, 50.0, work.rate), 1.0 / work.rate)
    work.offsets["force"] = force_intercept(displacement, velocity, signals["drive"], signals["force"])
    for name in ("displacement", "acceleration"):
        if name in signals:
            work.offsets.setdefault(name, float(np.mean(signals[name])))


def _campaign_offset(works: Sequence[_Work], name: str) -> tuple[float, float]:
    """Return the offset of a sensor over the campaign, and its spread between the tests that determine it.

    Without such a test, the offset is the mean of all tests weighted by length, and there is no spread.
    """
    values = np.array([work.offsets[name] for work in works if name in work.trusted])
    if values.size:
        middle = float(np.median(values))
        return middle, 1.48 * float(np.median(np.abs(values - middle)))
    measured = [work for work in works if name in work.offsets]
    lengths = [work.time.size for work in measured]
    return float(np.average([work.offsets[name] for work in measured], weights=lengths)), 0.0


def _share_offsets(works: Sequence[_Work]) -> None:
    for name in ("displacement", "force", "acceleration"):
        for work in works:
            if name in work.offsets:
                work.offsets[name] = _campaign_offset(works, name)[0]


def _lend_offsets(works: Sequence[_Work]) -> None:
    """Use the offset of the other tests, if they agree, for a test whose motion or drive does not determine it."""
    for name in ("displacement", "force", "acceleration"):
        if not any(name in work.offsets for work in works):
            continue
        middle, spread = _campaign_offset(works, name)
        for work in works:
            if name not in work.offsets or name in work.trusted:
                continue
            if spread <= LENT_OFFSET_SPREAD * float(np.std(work.filtered[name])):
                work.offsets[name] = middle


def _finish(work: _Work, options: PreparationOptions, campaign: Campaign) -> Preparation:
    if options.offset == "off":
        work.offsets = dict.fromkeys(work.offsets, 0.0)
    displacement, velocity, acceleration = _motion(work, options)
    cycles = choose_cycles(work.cycles, options.cycles, options.settle_cycles)
    force_offset, displacement_offset = work.offsets["force"], work.offsets["displacement"]
    test = PreparedTest(
        name=work.name,
        role=work.role,
        sampling_rate_hz=work.rate,
        time_s=work.time,
        displacement_m=displacement,
        velocity_m_s=velocity,
        acceleration_m_s2=acceleration,
        drive=work.filtered["drive"],
        force_n=work.filtered["force"] - force_offset,
        displacement_raw_m=work.channels["displacement"] - displacement_offset,
        force_raw_n=work.channels["force"] - force_offset,
        drive_raw=work.channels["drive"],
        cycles=cycles,
        drive_unit=campaign.drive_unit,
        excitation="periodic" if work.cycles.periodic else "random",
        drive_is_set_point=campaign.drive_is_set_point,
        displacement_offset_m=displacement_offset,
        force_offset_n=force_offset,
    )
    return Preparation(
        test=test,
        cutoffs_hz=work.cutoffs,
        frequency_hz=work.cycles.frequency_hz,
        amplitude_m=work.cycles.amplitude,
        before=work.channels,
        findings=tuple(work.findings),
    )


def _motion(work: _Work, options: PreparationOptions) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return displacement, velocity and acceleration without offsets."""
    dt = 1.0 / work.rate
    displacement = work.filtered["displacement"] - work.offsets["displacement"]
    measured = None
    if "acceleration" in work.filtered:
        measured = work.filtered["acceleration"] - work.offsets["acceleration"]
    method = options.differentiation
    if method == "kalman" and measured is None:
        work.findings.append("no acceleration for the Kalman filter: the velocity is a central difference")
        method = "central"
    if method == "kalman" and measured is not None:
        # the Kalman filter takes the noise into account, so that its inputs are the unfiltered measurements
        raw = work.channels["displacement"] - work.offsets["displacement"]
        raw_acceleration = work.channels["acceleration"] - work.offsets["acceleration"]
        estimate = kinematic_smoother if options.phase == "zero" else kinematic_kalman
        _, velocity, _ = estimate(raw, raw_acceleration, dt, options.gains(raw, raw_acceleration, work.rate))
        return displacement, velocity, measured
    velocity = _differentiate(displacement, dt, options, method)
    cutoff = options.velocity_cutoff_hz
    # by criterion the displacement has been filtered where its velocity needs it
    if not work.by_criterion and usable_cutoff(cutoff, work.rate) is not None:
        work.cutoffs["velocity"] = cutoff
        if work.cycles.frequency_hz > 0.3 * cutoff:
            work.findings.append(
                f"the velocity is filtered at {cutoff:g} Hz, only {cutoff / work.cycles.frequency_hz:.2g} times the "
                "frequency of the motion, which weakens the velocity; set prepare.velocity_cutoff_hz to "
                f"{5.0 * work.cycles.frequency_hz:.2g} or more"
            )
        velocity = butterworth_lowpass(velocity, cutoff, work.rate, order=options.order, phase=options.phase)
    if measured is None:
        measured = _differentiate(velocity, dt, options, "central")
    return displacement, velocity, measured


def _differentiate(values: FloatArray, dt: float, options: PreparationOptions, method: str) -> FloatArray:
    if method == "savitzky-golay":
        return savitzky_golay(values, dt, window_s=options.savitzky_golay_window_s)
    if method == "central":
        return central_difference(values, dt)
    velocity = backward_difference(values, dt)
    if options.phase == "causal":
        return velocity
    # (2.5) is the velocity at the middle between two samples: interpolate it to the clock of the other channels
    velocity[0] = velocity[1]
    return np.concatenate((0.5 * (velocity[:-1] + velocity[1:]), velocity[-1:]))
