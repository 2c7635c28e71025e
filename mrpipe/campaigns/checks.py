"""Checks of measured samples: errors that refuse a campaign, and findings for the user."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.words import counted, in_percent

LARGEST_SAMPLE = 1e30
"""Largest plausible sample [SI]; larger numbers are not measurements of any quantity."""


def require_finite(file: DataFile, values: FloatArray, first: int, channel: str, where: str) -> None:
    """Refuse NaN, infinite and impossibly large samples; `first` is the index of the first one used.

    Instruments write numbers such as 9.9e37 where a channel was overloaded.

    Raises
    ------
    UserError
        If a sample is bad; the message names the first bad row.
    """
    bad = np.flatnonzero(~(np.abs(values) < LARGEST_SAMPLE))
    if bad.size:
        row = file.line_of(first + int(bad[0]))
        value = values[bad[0]]
        if bad.size == 1 and bad[0] == values.size - 1 and np.isnan(value):
            raise UserError(
                file.path,
                f"{where}, {channel}, row {row}",
                "is missing in the last row, as if the recording was interrupted",
                "delete this row, or end the test before it with segments_s",
            )
        if bad.size == values.size and np.isnan(values).all():
            problem = f"holds no number in any of {values.size} samples"
            raise UserError(file.path, f"{where}, {channel}", problem, "name another column, or correct the file")
        kind = (
            "NaN (no number)" if np.isnan(value) else "infinite" if np.isinf(value) else f"{value:.3g}, no measurement"
        )
        raise UserError(
            file.path,
            f"{where}, {channel}, row {row}",
            f"is {kind}, {counted(bad.size, 'such sample')} in all",
            "leave them out with segments_s, or correct the file",
        )


WIDEST_NOISE = 14.0
"""Range of a record of white noise, over its standard deviation, that no record of practical length exceeds."""

WIDEST_LEVELS = 8.0
"""The same for the means of its twentieths, over their standard deviation."""


def clipped_share(values: FloatArray) -> float:
    """Return the share of samples at an extreme of a clipped channel; 0 if the channel is not clipped.

    A peak with coarse resolution stays at its top level for at most a few times as long as at the level below it, and a
    rig approaches its rest slowly. A clipped channel has flat tops that it reaches at speed, with hardly a sample just
    below.
    """
    share = 0.0
    span = float(np.ptp(values))
    if values.size < 20 or span == 0.0:
        return 0.0
    speed = float(np.sqrt(np.mean(np.diff(values) ** 2)))
    for signed in (values, -values):
        at_top = signed >= float(signed.max()) - 1e-9 * span
        edges = np.diff(np.concatenate(([0], at_top.astype(np.int8), [0])))
        begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        inside = (begins > 0) & (ends < values.size) & (ends - begins >= 4)
        begins, ends = begins[inside], ends[inside]
        entered = signed[begins] - signed[begins - 1] > 0.2 * speed
        held = int(np.sum((ends - begins)[entered]))
        if held < 8:
            continue
        below = signed[~at_top]
        near = np.count_nonzero(below >= float(below.max()) - 1e-9 * span)
        if near < 0.2 * at_top.sum():
            share += held / values.size
    return share


def find_clipping(test: Recording) -> list[str]:
    """Return a line for each measured channel that looks clipped, except the drive, which may stay at its limit."""
    lines = []
    for channel in test.channels:
        if "drive" in channel or "desired" in channel:
            continue
        values = test.used(channel)
        share = clipped_share(values)
        if share > 0.0:
            lines.append(
                f"{channel} looks clipped: {in_percent(share, digits=2)} of the samples sit exactly at "
                f"{values.min():.4g} or {values.max():.4g}"
            )
    return lines


def find_dropouts(test: Recording) -> list[str]:
    """Return a line for each measured channel that repeats a value and then jumps, or falls to exactly 0 in motion.

    A channel with coarse resolution repeats values too, but its next step is not larger than the others.
    """
    lines = []
    for channel in test.channels:
        if "drive" in channel or "desired" in channel:
            continue
        values = test.used(channel)
        times = test.used_time()
        still = _longest_freeze(values)
        if still is not None:
            begin, length = still
            lines.append(f"{channel} repeats one value for {length} samples at {times[begin]:.4g} s and then jumps")
        lost = _falls_to_zero(values)
        if lost.size:
            lines.append(f"{channel} falls to exactly 0 in {lost.size} samples, the first at {times[lost[0]]:.4g} s")
    return lines


def _longest_freeze(values: FloatArray) -> tuple[int, int] | None:
    """Return start and length of the longest freeze that ends in a jump of at least half of the missed motion."""
    steps = np.abs(np.diff(values))
    speed = float(np.sqrt(np.mean(steps**2))) if steps.size else 0.0
    edges = np.diff(np.concatenate(([0], (steps == 0.0).astype(np.int8), [0])))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    inside = ends < steps.size
    begins, ends = begins[inside], ends[inside]
    lengths = ends - begins
    frozen = np.flatnonzero((lengths >= 8) & (steps[ends] > 0.5 * lengths * speed))
    if frozen.size == 0:
        return None
    longest = frozen[np.argmax(lengths[frozen])]
    return int(begins[longest]), int(lengths[longest]) + 1


def _falls_to_zero(values: FloatArray) -> IntArray:
    """Return the samples that are exactly 0 while the last one before and the next one after are far from it."""
    zeros = values == 0.0
    known = np.flatnonzero(~zeros)
    if known.size < 2 or not zeros.any():
        return np.zeros(0, dtype=np.int64)
    lost = np.flatnonzero(zeros)
    place = np.searchsorted(known, lost)
    within = (place > 0) & (place < known.size)
    lost, place = lost[within], place[within]
    near = np.minimum(np.abs(values[known[place - 1]]), np.abs(values[known[place]]))
    same_side = np.sign(values[known[place - 1]]) == np.sign(values[known[place]])
    # in noise around zero, a sample of exactly 0 is not further from its neighbours than others are
    usual = 1.48 * float(np.median(np.abs(np.diff(values))))
    far = near > max(0.2 * float(np.max(np.abs(values))), 4.0 * usual)
    return np.asarray(lost[same_side & far], dtype=np.int64)


def force_sign(recordings: Sequence[Recording]) -> float:
    """Return the mean correlation of force with velocity over tests; it is positive with the correct sign of the force.

    A damper dissipates energy, so a force that is positive in extension does positive work on the displacement of the
    rod. A negative value means that compression was taken as positive. It is 0 if nothing moves.
    """
    figures = []
    for test in recordings:
        for begin, end in test.segments:
            displacement = test.channels["displacement"][begin:end]
            force = test.channels["force"][begin:end]
            step = np.diff(displacement)
            # velocity over a fiftieth of the record's cycles at least, so that noise does not drown it
            width = max(1, int(0.01 * test.sampling_rate_hz))
            if step.size <= 2 * width:
                continue
            velocity = displacement[width:] - displacement[:-width]
            middle = force[width // 2 : width // 2 + velocity.size]
            middle, velocity = middle - middle.mean(), velocity - velocity.mean()
            scale = float(np.sqrt(np.sum(middle**2) * np.sum(velocity**2)))
            if scale > 0.0:
                figures.append(float(np.sum(middle * velocity)) / scale)
    return float(np.mean(figures)) if figures else 0.0


def require_varying(drives: Mapping[str, FloatArray], source: str) -> None:
    """Refuse drives (test -> samples) that are all the same constant, because they do not determine an inverse model.

    Raises
    ------
    UserError
        If the range over all tests is below 1 % of the largest drive or that of white noise, or there is no drive.
    """
    if not drives:
        raise UserError(source, "drive", "is not recorded in any training test", "an inverse model needs a drive")
    if not drive_varies(drives.values()):
        levels = levels_of(drives.values())
        raise UserError(
            source,
            "drive",
            f"never changes in the training tests ({levels.mean():.4g})",
            "an inverse model needs training tests at two or more drives; without them, leave train-inverse and the "
            "stages that use it out of `stages` in the configuration",
        )


def drive_varies(drives: Iterable[FloatArray]) -> bool:
    """Whether drives, shape (n,) for each test, determine an inverse model (:func:`require_varying`)."""
    drives = list(drives)
    levels = levels_of(drives)
    least = max(0.01 * float(np.abs(levels).max()), noise_of_levels(drives))
    return float(np.ptp(levels)) > least


def levels_of(drives: Iterable[FloatArray]) -> FloatArray:
    """Return the mean drive of each twentieth of each record, which separates a level from the noise on it."""
    means = [block.mean() for item in drives for block in np.array_split(item, 20) if block.size]
    return np.array(means, dtype=np.float64)


def noise_of_levels(drives: Sequence[FloatArray]) -> float:
    """Return the largest difference of :func:`levels_of` that white noise explains; 0 where a drive holds more.

    The noise follows from the steps between samples. Its range within a test is limited, so that a drive that changes
    within a test is not taken for noise.
    """
    steps = np.concatenate([np.diff(item) for item in drives])
    sigma = float(np.sqrt(0.5 * np.mean(steps**2))) if steps.size else 0.0
    if any(float(np.ptp(item)) > WIDEST_NOISE * sigma for item in drives):
        return 0.0
    shortest = max(min(item.size for item in drives) // 20, 1)
    return WIDEST_LEVELS * sigma / float(np.sqrt(shortest))


def require_roles(campaign: Campaign, source: str) -> None:
    """Refuse a bench campaign without training or validation tests.

    Raises
    ------
    UserError
        If a role is missing; the message names it.
    """
    if campaign.rig != "damper-bench":
        return
    for role in ("training", "validation"):
        if not campaign.with_role(role):
            raise UserError(source, "tests", f"no {role} test", f"give at least one test the role {role}")
