"""A case as a campaign on disk, recorded as a user's bench would, and its truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

from benchmarks.rigs.cases import Case
from benchmarks.rigs.damper import Rig, draw_rig, offset_draws, respond, scaled, share_of
from benchmarks.rigs.motion import Motion, motion_of, plan
from benchmarks.rigs.sensors import Sensors, draw_sensors, measured
from benchmarks.rigs.types import Array, Table

TEST_S = 3.0
FINE_HZ = 20_000.0
EDGE_S = 0.2
CUTOFFS_HZ = (10.0, 20.0, 40.0, 80.0, 160.0)
"""Cut-offs among which the true model's error takes the best one for each test."""


@dataclass(frozen=True)
class Record:
    """What a test recorded, shape (n,) each, SI; `exact` is the force without noise."""

    motion: Motion
    displacement: Array
    drive: Array
    force: Array
    exact: Array


@dataclass(frozen=True)
class Campaign:
    """A recorded case and its truth."""

    case: Case
    rig: Rig
    records: list[Record]
    truth: Table


def motions_of(rig: Rig, case: Case, *, fine_hz: float = FINE_HZ) -> list[Motion]:
    """Return what the machine does in all tests of a case."""
    return [
        motion_of(
            test, number, case.seed, stroke=rig.scales.stroke, speed=rig.scales.speed, frequency=rig.frequency_hz,
            drive=rig.scales.drive, duration_s=TEST_S, step_s=1.0 / fine_hz,
        )
        for number, test in enumerate(plan(case.training, case.validation, case.repeats))
    ]  # fmt: skip


def calibrated(rig: Rig, case: Case, motions: Sequence[Motion], draws: Array) -> tuple[Rig, list[float]]:
    """Return the rig whose effects have the wanted share of the force, and the shares they reach, in training."""
    training = [k for k, motion in enumerate(motions) if motion.test.role == "training"]
    used = [motions[k] for k in training]
    for place in range(len(rig.planted)):
        rig = scaled(rig, place, case.share, used, draws[training])
    return rig, [share_of(rig, place, used, draws[training]) for place in range(len(rig.planted))]


def _recorded(
    motion: Motion, exact: Array, sensors: Sensors, rate_hz: float, fine_hz: float, rng: np.random.Generator
) -> Record:
    every = round(fine_hz / rate_hz)

    def channel(values: Array, name: str) -> Array:
        return measured(values[::every], getattr(sensors, name), sensors.corner_hz, rate_hz, rng)

    return Record(
        motion, channel(motion.x, "displacement"), channel(motion.drive, "drive"), channel(exact, "force"),
        exact[::every],
    )  # fmt: skip


def record(case: Case, *, fine_hz: float = FINE_HZ) -> Campaign:
    """Record a case."""
    rng = np.random.default_rng([case.seed, 2])
    rig = draw_rig(case.base, case.planted, rng, TEST_S)
    motions = motions_of(rig, case, fine_hz=fine_hz)
    draws = offset_draws(len(motions), case.seed)
    rig, shares = calibrated(rig, case, motions, draws)
    forces = [respond(rig, motion, draw) for motion, draw in zip(motions, draws, strict=True)]
    force_rms = float(np.sqrt(np.mean(np.concatenate(forces) ** 2)))
    sensors = draw_sensors(case.noise, rng, stroke=rig.scales.stroke, force_rms=force_rms, drive=rig.scales.drive)
    records = [
        _recorded(motion, force, sensors, case.rate_hz, fine_hz, np.random.default_rng([case.seed, 3, number]))
        for number, (motion, force) in enumerate(zip(motions, forces, strict=True))
    ]
    force_floor, true_floor = floors(rig, case, records, draws, sensors)
    truth: Table = {
        "planted": list(case.planted),
        "forms": [item.form for item in rig.planted],
        "numbers": [item.comparable() for item in rig.planted],
        "shares": shares,
        "force_rms_n": force_rms,
        "force_noise_nrmse": force_floor,
        "true_model_nrmse": true_floor,
        "rig": rig.described(),
    }
    return Campaign(case, rig, records, truth)


def floors(rig: Rig, case: Case, records: Sequence[Record], draws: Array, sensors: Sensors) -> tuple[float, float]:
    """Return two NRMSE on the validation tests: of the force's noise alone, and of the true model.

    The true model is the rig itself, driven by the measured displacement (behind the best zero-phase filter of each
    test) and the measured drive: no model of the damper can be expected to do better.
    """
    noise, error, total = 0.0, 0.0, 0.0
    for found, draw in zip(records, draws, strict=True):
        if found.motion.test.role != "validation":
            continue
        # both ends of a record are left out, because a zero-phase filter does not know what lies beyond
        inside = slice(round(EDGE_S * case.rate_hz), -round(EDGE_S * case.rate_hz))
        force = (found.force - sensors.force.offset)[inside]
        noise += float(np.sum((force - found.exact[inside]) ** 2))
        total += float(np.sum(force**2))
        error += min(
            float(np.sum((_answer_to_measured(rig, case, found, draw, sensors, cutoff)[inside] - force) ** 2))
            for cutoff in CUTOFFS_HZ
        )
    return float(np.sqrt(noise / total)), float(np.sqrt(error / total))


def _answer_to_measured(rig: Rig, case: Case, found: Record, draw: float, sensors: Sensors, cutoff_hz: float) -> Array:
    fine_s = found.motion.step_s
    time = np.arange(found.displacement.size) / case.rate_hz
    fine = np.arange(found.motion.x.size) * fine_s
    low_pass = signal.butter(4, cutoff_hz, fs=case.rate_hz, output="sos")
    smooth = CubicSpline(time, signal.sosfiltfilt(low_pass, found.displacement - sensors.displacement.offset))
    inside = np.minimum(fine, time[-1])
    drive = np.interp(inside, time, found.drive)
    motion = replace(found.motion, x=smooth(inside), v=smooth(inside, 1), a=smooth(inside, 2), drive=drive)
    every = round(1.0 / (case.rate_hz * fine_s))
    return respond(rig, motion, draw)[::every]


def write(campaign: Campaign, directory: Path) -> Path:
    """Write the campaign directory as a user has it, without any truth, and return it."""
    from mrpipe.campaigns import TestFile, write_campaign

    scale = 1e3 if campaign.rig.scales.force > 5e3 else 1.0
    names = [found.motion.test.name for found in campaign.records]
    tests = []
    for found in campaign.records:
        test = found.motion.test
        columns = {"x": 1e3 * found.displacement, "i": found.drive, "F": found.force / scale}
        details = {"repeat_of": names[test.repeat_of]} if test.repeat_of >= 0 else {}
        tests.append(TestFile(test.name, test.role, columns, details))
    write_campaign(
        directory, campaign=f"rig-{campaign.case.seed}", rig="damper-bench",
        sampling_rate_hz=campaign.case.rate_hz, tests=tests,
        channels={"displacement": ("x", "mm"), "drive": ("i", "A"), "force": ("F", "kN" if scale > 1.0 else "N")},
    )  # fmt: skip
    return directory
