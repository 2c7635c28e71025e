"""Channels that repeat one value for a while although the rig moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray, IntArray

CHANCE = 1e-9
"""Largest expected number of runs of equal samples that may occur by chance before a channel is called stuck."""

SHORTEST = 10
"""Shortest stretch in samples that is looked at."""

DEVIATION, SHARE = 0.1, 0.3
"""A force is stuck if it is off by more than DEVIATION of its range in more than SHARE of the stretch.

Twice the share is required where the motion does not turn back, because a force of friction rests there.
"""

TURN = 0.05
"""A motion turns back if it goes up and down by this share of its range."""

NEIGHBOURS = 7
"""Number of samples at the same motion and drive with which a force is compared."""

POINTS = 4000
"""Largest number of samples with which a force is compared."""


MOST = 12
"""So many of the longest stretches of a test are looked at."""


@dataclass(frozen=True)
class Stuck:
    """A stretch of equal samples: first index, number of samples, and how many such stretches there are."""

    first: int
    samples: int
    count: int


def find_stuck_displacement(displacement: FloatArray, force: FloatArray) -> Stuck | None:
    """Return the longest stretch in which the displacement repeats one value while the force keeps changing.

    The number of equal neighbours outside the stretch gives the probability of a repeated sample; a stretch counts
    where chance would produce fewer than :data:`CHANCE` of its length. A piston moves continuously, and a turning point
    of a coarsely resolved motion dwells for a while too, so a stretch must end in a jump beyond the usual steps.

    Parameters
    ----------
    displacement, force
        Shape (n,) each. Where the force rests as well, the rig was at rest.
    """
    steps = np.abs(np.diff(displacement))
    begins, lengths = _stretches(steps)
    if not begins.size:
        return None
    usual_step = float(np.quantile(steps[steps > 0.0], 0.99))
    pace = float(np.median(np.abs(np.diff(force))))
    found = []
    for begin, length in zip(begins.tolist(), lengths.tolist(), strict=True):
        end = begin + length
        repeats = (int(np.count_nonzero(steps == 0.0)) - length) / max(steps.size - length, 1)
        by_chance = steps.size * max(repeats, 1e-6) ** float(length)
        jumps = max(float(steps[begin - 1]), float(steps[end])) > 2.0 * usual_step
        rests = np.median(np.abs(np.diff(force[begin : end + 1]))) < 0.1 * pace
        if by_chance < CHANCE and jumps and not rests:
            found.append((begin, length + 1))
    return _longest(found)


def find_stuck_force(force: FloatArray, displacement: FloatArray, drive: FloatArray) -> Stuck | None:
    """Return the longest stretch in which the force repeats one value although the motion calls for other values.

    A coarsely resolved force repeats one value on every plateau of a friction force. It is stuck only where it differs
    from every force that the same test shows elsewhere at nearly the same displacement, velocity and drive. Stretches
    shorter than a tenth of a cycle are left out, because they harm no fit.

    Parameters
    ----------
    force, displacement, drive
        Shape (n,) each.
    """
    begins, lengths = _stretches(np.abs(np.diff(force)))
    if not begins.size or np.ptp(displacement) == 0.0:
        # a displacement that does not change is reported as such: it calls for no other force
        return None
    state, cycle = _states(displacement, drive)
    long = lengths >= max(SHORTEST, 0.1 * cycle)
    begins, lengths = begins[long], lengths[long]
    if not begins.size:
        return None
    limit = max(DEVIATION * float(np.ptp(force)), 3.0 * _quantum(force))
    held = np.zeros(force.size, dtype=bool)
    found = []
    longest = sorted(zip(begins.tolist(), lengths.tolist(), strict=True), key=lambda item: -item[1])
    for begin, length in longest[:MOST]:
        distances = _distances(force, state, begin, begin + length, held)
        share = SHARE if _turns_back(displacement[begin : begin + length + 1], displacement) else 2.0 * SHARE
        if distances is None or np.mean(distances > limit) <= share:
            continue
        held[begin : begin + length + 1] = True
        found.append((begin, length + 1))
    return _longest(found)


def _stretches(steps: FloatArray) -> tuple[IntArray, IntArray]:
    """Return begin and number of zero steps of each stretch inside a record, at least :data:`SHORTEST` long."""
    empty = np.zeros(0, dtype=np.int64)
    if steps.size < 50 or not steps.any():
        return empty, empty
    edges = np.diff(np.concatenate(([0], (steps == 0.0).astype(np.int8), [0])))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    chosen = (begins > 0) & (ends < steps.size) & (ends - begins >= SHORTEST)
    return begins[chosen], (ends - begins)[chosen]


def _quantum(values: FloatArray) -> float:
    steps = np.abs(np.diff(np.unique(values)))
    return float(np.median(steps)) if steps.size else 0.0


def _states(displacement: FloatArray, drive: FloatArray) -> tuple[FloatArray, float]:
    """Return displacement, velocity and drive over their spread, shape (n, 3), and the samples of a mean cycle."""
    from scipy.ndimage import uniform_filter1d

    centred = displacement - np.mean(displacement)
    width = max(1, centred.size // 200)
    signs = uniform_filter1d(centred, width) > 0.0
    cycle = 2.0 * centred.size / max(int(np.count_nonzero(np.diff(signs))), 1)
    velocity = uniform_filter1d(np.gradient(centred), max(3, int(cycle / 60.0)))
    columns = [centred, velocity, drive - np.mean(drive)]
    spreads = [float(np.std(column)) for column in columns]
    # the noise of a constant drive is not a state
    spreads[2] = max(spreads[2], 0.1 * float(np.abs(drive).max()))
    scaled = [column / spread for column, spread in zip(columns, spreads, strict=True) if spread > 0.0]
    return np.stack(scaled, axis=1), cycle


def _turns_back(part: FloatArray, whole: FloatArray) -> bool:
    least = TURN * float(np.ptp(whole))
    rise = float(np.max(part - np.minimum.accumulate(part)))
    fall = float(np.max(np.maximum.accumulate(part) - part))
    return rise > least and fall > least


def _distances(force: FloatArray, state: FloatArray, begin: int, end: int, held: BoolArray) -> FloatArray | None:
    """Return how far the force of a stretch is from that of other samples at the same states; None for too few others.

    The nearest value of :data:`NEIGHBOURS` samples counts, because the force of friction has both signs at velocities
    near zero. Samples of the stretch itself and of stretches that were found to be stuck are not compared with.
    """
    from scipy.spatial import cKDTree

    usable = ~held
    usable[begin : end + 1] = False
    others = np.flatnonzero(usable)
    others = others[:: max(1, others.size // POINTS)]
    if others.size < 50:
        return None
    places = np.arange(begin, end + 1)[:: max(1, (end - begin) // 100)]
    nearest = cKDTree(state[others]).query(state[places], k=NEIGHBOURS)[1]
    return np.asarray(np.min(np.abs(force[others][nearest] - force[begin]), axis=1))


def _longest(found: list[tuple[int, int]]) -> Stuck | None:
    if not found:
        return None
    first, samples = max(found, key=lambda item: item[1])
    return Stuck(first, samples, len(found))
