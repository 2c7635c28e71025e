"""Tests whether a residual contains more than noise, and on which states it depends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.kernel import CURRENT_AT, HYSTERESIS_AT, WORK_AT, run_recordings
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.solution import chain_of
from mrpipe.signals.reversals import last_reversal, path_since_reversal
from mrpipe.tracing.rules import LocationRules
from mrpipe.tracing.step_function import explained_share

BLOCK = 0.6
"""Numerical technique: length of the blocks whose sums are taken as independent, in periods of the motion."""

LAGS_FIT = 4
"""Numerical technique: autocorrelations are tested on records with at least this number of samples per lag."""

ELASTIC_SHARE = 0.1
"""Numerical technique: yield displacement that is assumed for a form without such a parameter, as share of the stroke.
"""

THIRD = 1.0 / 3.0
"""Numerical technique: a test is divided into three parts of equal length."""


@dataclass(frozen=True)
class States:
    """States of a recording that a residual may depend on.

    Attributes
    ----------
    values
        Name of the state, such as `velocity` -> its value at each sample, shape (n,), in SI.
    block
        Index of the block of each sample, shape (n,).
    """

    values: dict[str, FloatArray]
    block: IntArray


def states_of(found: Fit, recordings: Recordings) -> States:
    """Return the states of the simulated damper: motion, drive, their past, and memory variables."""
    wires = run_recordings(chain_of(found.problem, found.theta)[0], recordings)
    x, v, u = recordings.displacement, recordings.velocity, wires[CURRENT_AT]
    slip, since, past, drive_rate = memory_of(recordings)
    values = {
        "displacement": x,
        "velocity": v,
        "drive": u,
        "acceleration": recordings.acceleration,
        "direction": np.sign(v),
        "hysteresis": wires[HYSTERESIS_AT],
        "past of displacement": slip,
        "past of velocity": since,
        "past of drive": past - np.abs(u),
        "rate of drive": drive_rate,
        "time in test": recordings.time,
        "work": wires[WORK_AT],
    }
    return States(values, recordings.blocks(BLOCK))


def memory_of(recordings: Recordings) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return slip and time since the last reversal, the largest drive so far, the rate of the drive; shape (n,)."""
    slip, since = np.zeros(len(recordings.force)), np.zeros(len(recordings.force))
    past, rate = np.zeros(len(recordings.force)), np.zeros(len(recordings.force))
    for test in range(recordings.tests):
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        v, dt = recordings.velocity[piece], recordings.dt[test]
        time = np.arange(len(v)) * dt
        slip[piece] = path_since_reversal(v, dt)
        since[piece] = time - time[last_reversal(np.sign(v))]
        past[piece] = np.maximum.accumulate(np.abs(recordings.drive[piece]))
        rate[piece] = np.gradient(recordings.drive[piece]) / dt
    return slip, since, past, rate


def structure_p_value(residual: FloatArray, states: States) -> float:
    """Return the probability that noise alone correlates with the states as strongly as this residual does.

    For each state and its product with direction, the covariance with the residual is summed in blocks. Blocks are
    independent although samples are not, so the result allows for autocorrelation. It is corrected for the number of
    states.
    """
    used = residual != 0.0
    blocks, index = np.unique(states.block[used], return_inverse=True)
    r = residual[used]
    direction = np.sign(states.values["velocity"][used])
    best, count = 1.0, 0
    for name, values in states.values.items():
        feature = values[used]
        spread = float(np.std(feature))
        if spread <= 0.0:
            continue
        standard = (feature - np.mean(feature)) / spread
        for column in (standard, standard * direction, standard**2 * direction) if name != "direction" else (standard,):
            sums = np.bincount(index, weights=r * column, minlength=len(blocks))
            deviation = float(np.std(sums, ddof=1)) / np.sqrt(len(sums))
            if deviation > 0.0:
                t = abs(float(np.mean(sums))) / deviation
                best = min(best, float(2.0 * stats.t.sf(t, len(sums) - 1)))
            count += 1
    return float(max(min(1.0, best * count), 1e-300))


def correlation_p_value(residual: FloatArray, recordings: Recordings, lags: int = 20) -> float:
    """Return the probability that white noise has autocorrelations as large as this residual.

    Portmanteau test of Ljung and Box (1978), for each test separately, corrected for the number of tests.

    Parameters
    ----------
    residual
        Shape (n,); samples that are not compared are left out.
    recordings
        Tests of the residual.
    lags
        Number of lags that are tested.
    """
    best, count = 1.0, 0
    for test in range(recordings.tests):
        values = residual[recordings.used & (recordings.test == test)]
        size = len(values)
        if size < LAGS_FIT * lags:
            continue
        centred = values - np.mean(values)
        power = float(centred @ centred)
        if power <= 0.0:
            continue
        own = [float(centred[k:] @ centred[:-k]) / power for k in range(1, lags + 1)]
        statistic = size * (size + 2.0) * sum(r * r / (size - k) for k, r in enumerate(own, 1))
        best, count = min(best, float(stats.chi2.sf(statistic, lags))), count + 1
    return float(max(min(1.0, best * max(count, 1)), 1e-300))


def dependence(residual: FloatArray, states: States) -> list[tuple[str, float]]:
    """Return (state, share of the variance of the residual that this state alone explains), the largest first.

    The share is that of a step function of the state, separate for both directions of motion, judged on blocks left
    out.
    """
    used = residual != 0.0
    r = residual[used]
    half = (np.unique(states.block[used], return_inverse=True)[1] % 2).astype(np.bool_)
    positive = states.values["velocity"][used] > 0.0
    both = np.zeros_like(positive)
    found = [
        (name, explained_share(r, values[used], both if name == "direction" else positive, half))
        for name, values in states.values.items()
    ]
    return sorted(found, key=lambda item: -item[1])


def location(
    residual: FloatArray, found: Fit, recordings: Recordings, states: States, rules: LocationRules | None = None
) -> dict[str, dict[str, float]]:
    """Return how the squared residual is divided over parts of the cycle, drive, direction and time, as shares."""
    rules = rules or LocationRules()
    squares = residual**2
    total = max(float(np.sum(squares)), 1e-300)
    z, v = states.values["hysteresis"], states.values["velocity"]
    y = np.sign(v) * z
    length = found.base_values.get("yield_displacement", ELASTIC_SHARE * found.problem.scales.stroke)
    reversal = (y < 0.0) | (states.values["past of displacement"] < 0.5 * length)
    post = (y > rules.post_yield) & ~reversal
    rate = states.values["rate of drive"]
    scale = max(float(np.max(np.abs(recordings.drive))), 1e-12)
    rising, falling = rate > rules.drive_rate * scale, rate < -rules.drive_rate * scale
    thirds = recordings.time / np.maximum(np.diff(recordings.starts) * recordings.dt, 1e-12)[recordings.test]

    def shares(parts: dict[str, BoolArray]) -> dict[str, float]:
        return {name: float(np.sum(squares[mask])) / total for name, mask in parts.items()}

    return {
        "cycle": shares({"pre_yield": ~reversal & ~post, "post_yield": post, "reversal": reversal}),
        "drive": shares({"rising": rising, "falling": falling, "constant": ~rising & ~falling}),
        "direction": shares({"positive": v > 0.0, "negative": v <= 0.0}),
        "time": shares(
            {
                "first": thirds < THIRD,
                "second": (thirds >= THIRD) & (thirds < 2.0 * THIRD),
                "third": thirds >= 2.0 * THIRD,
            }
        ),
    }
