"""Which effects a campaign can show at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Effect, Needs
from mrpipe.fitting.recordings import Recordings

DRIVE_CHANGE_SHARE = 0.05
"""The drive varies where its range within a test exceeds this share of the campaign's largest drive."""
FREQUENCY_RATIO = 1.15
"""Tests have several frequencies where the highest is this much above the lowest."""
SPEED_RATIO = 1.5
"""Speeds vary where nine tenths of the samples stay below a speed this much above that of the slowest quarter: a sine
has 2.6, a triangle of one amplitude and frequency 1."""
TURNING_SHARE = 0.1
"""Motions turn round at several positions where these spread by more than this share of the stroke."""
LONG_CYCLES = 20.0
"""A long test has at least so many cycles of motion: far more than the hysteresis needs to settle."""


def untestable(recordings: Recordings, effects: Mapping[str, Effect]) -> tuple[dict[str, Effect], dict[str, str]]:
    """Return the effects that the tests can show, and for the others why they cannot."""
    lacks = missing(recordings)
    able, reasons = {}, {}
    for name, effect in effects.items():
        unmet = [lacks[need] for need in effect.needs if need in lacks]
        if unmet:
            reasons[name] = f"untestable: {'; '.join(unmet)}"
        else:
            able[name] = effect
    return able, reasons


def missing(recordings: Recordings) -> dict[Needs, str]:
    """Return which needs of effects the tests do not meet -> why that makes effects invisible, and what to record."""
    pieces = [
        slice(int(a), int(b)) for a, b in zip(recordings.starts[:-1], recordings.starts[1:], strict=True) if b > a
    ]
    met: dict[Needs, tuple[bool, str]] = {
        "varying-drive": (
            _drive_varies(recordings, pieces),
            "the drive is constant within every test: record steps or half-sines of current",
        ),
        "varying-speed": (
            _speed_varies(recordings),
            "all tests move at one speed: record triangles at log-spaced speeds, or sines",
        ),
        "several-frequencies": (
            _several_frequencies(recordings, pieces),
            "all tests move at one frequency: record another",
        ),
        "several-positions": (
            _several_positions(recordings, pieces),
            "all motions turn round at the same positions: record another amplitude or another middle",
        ),
        "long-tests": (
            _longest_cycles(recordings, pieces) >= LONG_CYCLES,
            f"no test has {LONG_CYCLES:.0f} cycles of motion: record a long one",
        ),
    }
    return {need: reason for need, (fulfilled, reason) in met.items() if not fulfilled}


def _drive_varies(recordings: Recordings, pieces: Sequence[slice]) -> bool:
    largest = max(float(np.max(np.abs(recordings.drive))), 1e-12)
    return any(float(np.ptp(recordings.drive[piece])) > DRIVE_CHANGE_SHARE * largest for piece in pieces)


def _speed_varies(recordings: Recordings) -> bool:
    speeds = np.abs(recordings.velocity[recordings.used])
    if not speeds.size:
        return False
    slow, fast = np.quantile(speeds, [0.25, 0.9])
    return bool(fast > SPEED_RATIO * slow)


def _several_frequencies(recordings: Recordings, pieces: Sequence[slice]) -> bool:
    if not bool(np.all(recordings.period_s > 0.0)):
        return True
    speeds = np.array([float(np.sqrt(np.mean(recordings.velocity[piece] ** 2))) for piece in pieces])
    bends = np.array([float(np.sqrt(np.mean(recordings.acceleration[piece] ** 2))) for piece in pieces])
    rates = bends / np.maximum(speeds, 1e-12)
    return float(np.max(rates)) >= FREQUENCY_RATIO * float(np.min(rates))


def _turns(velocity: FloatArray) -> np.ndarray:
    """Return the samples after which the motion turns round, shape (turns,)."""
    moving = np.flatnonzero(velocity)
    signs = np.sign(velocity[moving])
    return moving[1:][signs[1:] != signs[:-1]]


def _several_positions(recordings: Recordings, pieces: Sequence[slice]) -> bool:
    stroke = recordings.scales().stroke
    upper, lower = [], []
    for piece in pieces:
        x, v = recordings.displacement[piece], recordings.velocity[piece]
        at = _turns(np.where(recordings.used[piece], v, 0.0))
        # after an upper turn the velocity is negative
        upper.append(x[at[v[at] < 0.0]])
        lower.append(x[at[v[at] > 0.0]])
    spreads = [
        float(np.ptp(np.quantile(places, [0.05, 0.95])))
        for places in (np.concatenate(upper), np.concatenate(lower))
        if places.size
    ]
    return max(spreads, default=0.0) > TURNING_SHARE * stroke


def _longest_cycles(recordings: Recordings, pieces: Sequence[slice]) -> float:
    return max((0.5 * len(_turns(recordings.velocity[piece])) for piece in pieces), default=0.0)
