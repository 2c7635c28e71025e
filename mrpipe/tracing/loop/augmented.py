"""The damper with its effects as a plant: its force under a controller, its inverse, and its residual force."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.control.inverse import InverseTable
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.plant import FORCE, Chain, run_chain
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.recordings import Recordings
from mrpipe.networks.assembly import History, join, samples
from mrpipe.networks.network import Network
from mrpipe.networks.options import TrainingOptions
from mrpipe.networks.training import train
from mrpipe.signals.error_size import nrmse
from mrpipe.signals.prepared import PreparedTest

SPEEDS = (0.025, 0.075, 0.2, 0.5, 1.0)
"""Numerical technique: speeds at which the force is tabulated, as shares of the highest speed."""

DRIVES = 11
"""Numerical technique: number of drives at which the force is tabulated, from 0 to the limit."""

STEPS = (80.0, 40.0)
"""Numerical technique: least number of time steps in half a period of the motion and in half a cycle of a triangle."""

SETTLING_SHARE = 0.2
"""Numerical technique: share of a half period after a change of drive that is left out, so that its lag has decayed."""

MIDDLE = 0.3
"""Numerical technique: the force is averaged over this share of the stroke on both sides of its middle."""

MOST_MOTIONS = 40
"""Numerical technique: largest number of motions that are simulated for the inverse."""

CYCLES = 4
"""Numerical technique: steady cycles of each motion."""

RAMPS = (0.1, 0.8)
"""Numerical technique: shortest and longest ramp between two drives, in mean periods of the motion."""

OFF = 0.33
"""Numerical technique: share of the levels of the drive that are 0, as under a switching controller."""


def plant_chain(found: Fit) -> Chain:
    """Return the chain for the closed loop, without faults of sensors and without a lag that no test determines."""
    # a chain holds numbers in SI and no units
    return traced_damper(found, "drive").chain()


def traced_damper(found: Fit, drive_unit: str, *, effect_files: Mapping[str, str] | None = None) -> DamperModel:
    """Return the damper of a fit with its effects; a lag that no test determines is left out.

    Parameters
    ----------
    found
        The fit.
    drive_unit
        `A` or `V`.
    effect_files
        Name of an effect -> the user's file that defines it.
    """
    return damper_model(found, drive_unit, effects=True, assumed_eta=math.inf, effect_files=effect_files)


def tested_range(recordings: Recordings) -> dict[str, float]:
    """Return the largest |displacement| [m] and |velocity| [m/s] of the tests that a damper was fitted to."""
    return {
        "displacement": float(np.max(np.abs(recordings.displacement))),
        "velocity": float(np.max(np.abs(recordings.velocity))),
    }


@dataclass(frozen=True)
class ForceInUse:
    """The force of a damper under a controller.

    Attributes
    ----------
    speeds_m_s, drives
        Shape (s,) and (d,).
    force_n
        Post-yield force at constant speed, shape (s, d) [N]. It is the mean over both directions of motion and over
        two histories of the drive, from 0 and from the working drive, so that a memory of the drive counts as in the
        loop.
    from_above_n
        The same, for a drive that falls from the working drive.
    """

    speeds_m_s: FloatArray
    drives: FloatArray
    force_n: FloatArray
    from_above_n: FloatArray

    def residual_n(self, speed_m_s: float) -> float:
        """Return the force [N] at drive 0 after the damper has worked."""
        return float(np.interp(speed_m_s, self.speeds_m_s, self.from_above_n[:, 0]))

    def smallest_n(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the least force [N] in use, of the shape of `speed_m_s`."""
        return np.interp(speed_m_s, self.speeds_m_s, self.from_above_n[:, 0])

    def largest_n(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the largest force [N], of the shape of `speed_m_s`."""
        return np.interp(speed_m_s, self.speeds_m_s, self.force_n[:, -1])

    def table(self, speeds: int = 101, drives: int = 81) -> InverseTable:
        """Return the inverse of the force for controllers that invert the model."""
        speed = np.linspace(0.0, float(self.speeds_m_s[-1]), speeds)
        drive = np.linspace(0.0, float(self.drives[-1]), drives)
        over_drive = np.array([np.interp(drive, self.drives, row) for row in self.force_n])
        forces = np.array([np.interp(speed, self.speeds_m_s, column) for column in over_drive.T]).T
        return InverseTable(np.maximum.accumulate(forces, axis=1), float(speed[-1]), float(drive[-1]))


def force_in_use(
    chain: Chain, drive_limit: float, *, stroke_m: float, speed_m_s: float, omega: float, working_drive: float
) -> ForceInUse:
    """Tabulate the force of a chain at constant speeds and drives, with histories of the drive as in a closed loop.

    Parameters
    ----------
    chain
        The damper.
    drive_limit
        Largest drive.
    stroke_m, speed_m_s
        Largest displacement [m] of the motions, and highest speed [m/s]: those of the campaign.
    omega
        Angular frequency of the motion to be damped [rad/s]; a drive is held for half a period before the force is
        taken.
    working_drive
        Earlier drive [A or V], for the table with a falling drive.
    """
    speeds, drives = speed_m_s * np.array(SPEEDS), np.linspace(0.0, drive_limit, DRIVES)
    branches = np.empty((2, len(speeds), len(drives)))
    for row, speed in enumerate(speeds):
        for column, drive in enumerate(drives):
            for branch, before in enumerate((0.0, working_drive)):
                branches[branch, row, column] = _held(chain, float(speed), float(drive), before, stroke_m, omega)
    return ForceInUse(speeds, drives, branches.mean(axis=0), branches[1])


def _held(chain: Chain, speed: float, drive: float, before: float, stroke: float, omega: float) -> float:
    """Return the mean post-yield force over two half periods at constant speed, after the drive has changed."""
    whole = np.pi / omega
    half = min(whole, 2.0 * stroke / speed)
    dt = min(whole / STEPS[0], half / STEPS[1])
    # the drive changes at a reversal, after two half periods in which a memory of it can build up
    change = 2.0 * np.ceil(whole / half) * half
    time = np.arange(0.0, change + 2.0 * whole + half, dt)
    turns = time / half
    ramp = np.abs(np.mod(turns, 2.0) - 1.0)
    out = np.mod(turns, 2.0) < 1.0
    x, v = speed * half * (0.5 - ramp), np.where(out, speed, -speed)
    force = run_chain(chain, x, v, np.zeros_like(x), np.where(time < change, before, drive), dt)[:, FORCE]
    # springs cancel around the middle of the stroke, and the lag of the drive has decayed there
    part = (time > change + SETTLING_SHARE * whole) & (time < change + 2.0 * whole) & (np.abs(ramp - 0.5) < MIDDLE)
    moved = force * np.sign(v)
    return 0.5 * float(np.mean(moved[part & out]) + np.mean(moved[part & ~out]))


def changed_share(base: Chain, augmented: Chain, tests: Sequence[PreparedTest]) -> float:
    """Return the change of the force over the motions of tests (RMS of the change over RMS of the force)."""
    difference, size = 0.0, 0.0
    for test in spread(tests):
        first, second = force_over(base, test, test.drive), force_over(augmented, test, test.drive)
        difference += float(np.sum((second - first) ** 2))
        size += float(np.sum(first**2))
    return float(np.sqrt(difference / max(size, 1e-30)))


def spread(tests: Sequence[PreparedTest]) -> list[PreparedTest]:
    """Return at most :data:`MOST_MOTIONS` of the tests, evenly picked."""
    return list(tests[:: max(1, -(-len(tests) // MOST_MOTIONS))])


def force_over(chain: Chain, test: PreparedTest, drive: FloatArray) -> FloatArray:
    """Return the force [N] of a chain over the motion of a test, shape (n,)."""
    return run_chain(chain, test.displacement_m, test.velocity_m_s, test.acceleration_m_s2, drive, test.dt)[:, FORCE]


def simulated_history(
    chain: Chain, tests: Sequence[PreparedTest], drive_limit: float, rate_hz: float, rng: np.random.Generator
) -> History:
    """Return training data for an inverse network: the damper simulated over the motions of tests, twice.

    Each motion is simulated with its recorded drive, and again with a drive that varies between 0 and its limit like
    that of a controller, because campaigns have few such tests.
    """
    made = []
    for test in spread(tests):
        for name, drive in (("", test.drive), ("-worked", worked_drive(test, drive_limit, rng))):
            force = force_over(chain, test, drive)
            # the recorded drive is not that of the simulation
            made.append(replace(test, name=f"{test.name}{name}", drive=drive, drive_raw=np.zeros(0), force_n=force))
    return join(made, cycles=CYCLES, sampling_rate_hz=rate_hz)


def worked_drive(test: PreparedTest, limit: float, rng: np.random.Generator) -> FloatArray:
    """Return a drive like that of a controller, shape (n,): ramps between random levels, a third of which are 0."""
    time = test.time_s
    period = 2.0 * np.pi * float(np.std(test.displacement_m)) / max(float(np.std(test.velocity_m_s)), 1e-12)
    shortest, longest = RAMPS[0] * period, RAMPS[1] * period
    count = int((time[-1] - time[0]) / shortest) + 2
    edges = time[0] + np.cumsum(rng.uniform(shortest, longest, count)) - shortest
    levels = limit * rng.uniform(0.0, 1.0, count) * (rng.uniform(size=count) > OFF)
    return np.asarray(np.interp(time, edges, levels), dtype=np.float64)


@dataclass(frozen=True)
class Retrained:
    """An inverse network for the augmented damper.

    Attributes
    ----------
    network
        The better of the old and the retrained network.
    before_nrmse, after_nrmse
        RMS error of the drive over its RMS value, for the old and the retrained network, on simulated validation
        motions.
    seconds
        Duration of the training.
    """

    network: Network
    before_nrmse: float
    after_nrmse: float
    seconds: float

    @property
    def replaced(self) -> bool:
        """Whether the retrained network is better than the old one."""
        return self.after_nrmse < self.before_nrmse


def retrain_inverse(
    old: Network,
    chain: Chain,
    training: Sequence[PreparedTest],
    validation: Sequence[PreparedTest],
    drive_limit: float,
    rng: np.random.Generator,
    *,
    options: TrainingOptions | None = None,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Retrained:
    """Train an inverse network of the old architecture on the damper with its effects, and compare both networks.

    Parameters
    ----------
    old
        Inverse network of the controller, trained on measured data.
    chain
        Damper with its effects.
    training, validation
        Prepared tests whose motions are used; of validation tests the motions only.
    drive_limit
        Largest drive [A or V].
    rng
        Source of randomness.
    options
        Options of the training; the default is a few starts on a part of the samples, which takes seconds.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share done and a text.
    """
    rate = old.features.sampling_rate_hz
    history = simulated_history(chain, training, drive_limit, rate, rng)
    options = options or TrainingOptions(
        architecture=old.hidden_of_members,
        biases=old.has_biases,
        starts=3,
        refined_starts=min(3, old.members),
        averaged=min(3, old.members),
        subsample_rows=12_000,
        subsample_iterations=100,
        iterations=20,
        refined_rows=40_000,
    )
    trained = train(history, old.features, options, rng, jobs=jobs, progress=progress)
    judged = samples(simulated_history(chain, validation or training, drive_limit, rate, rng), old.features)
    errors = [nrmse(item.predict(judged.features) - judged.target, judged.target) for item in (old, trained.network)]
    better = trained.network if errors[1] < errors[0] else old
    return Retrained(better, errors[0], errors[1], trained.seconds)
