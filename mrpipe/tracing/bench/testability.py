"""Which effects a campaign can show at all."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrpipe.effects.contract import Effect
from mrpipe.fitting.recordings import Recordings


def untestable(recordings: Recordings, effects: Mapping[str, Effect]) -> tuple[dict[str, Effect], dict[str, str]]:
    """Return the effects that the tests can show, and for the others why they cannot."""
    lacks = missing(recordings)
    able, reasons = {}, {}
    for name, effect in effects.items():
        reason = next((lacks[need] for need in effect.needs if need in lacks), "")
        if reason:
            reasons[name] = f"untestable: {reason}"
        else:
            able[name] = effect
    return able, reasons


def missing(recordings: Recordings) -> dict[str, str]:
    """Return what a campaign does not hold -> why that makes effects invisible."""
    found = {}
    pieces = [slice(int(a), int(b)) for a, b in zip(recordings.starts[:-1], recordings.starts[1:], strict=True)]
    largest = max(float(np.max(np.abs(recordings.drive))), 1e-12)
    if not any(float(np.ptp(recordings.drive[piece])) > 0.05 * largest for piece in pieces):
        found["varying-drive"] = "the drive is constant within every test: record steps or half-sines of current"
    speeds = np.array([float(np.sqrt(np.mean(recordings.velocity[piece] ** 2))) for piece in pieces])
    bends = np.array([float(np.sqrt(np.mean(recordings.acceleration[piece] ** 2))) for piece in pieces])
    rates = bends / np.maximum(speeds, 1e-12)
    if bool(np.all(recordings.period_s > 0.0)) and float(np.max(rates)) < 1.15 * float(np.min(rates)):
        found["several-frequencies"] = "all tests move at one frequency: record another"
    return found
