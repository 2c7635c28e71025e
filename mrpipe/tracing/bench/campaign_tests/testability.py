"""Which effects the tests of a campaign can show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Effect, Needs
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.rules import TestabilityRules


def effects_by_testability(
    recordings: Recordings, effects: Mapping[str, Effect], rules: TestabilityRules | None = None
) -> tuple[dict[str, Effect], dict[str, str]]:
    """Return the effects that the tests can show, and for the others the reason why they cannot."""
    lacks = unmet_needs(recordings, rules)
    able, reasons = {}, {}
    for name, effect in effects.items():
        unmet = [lacks[need] for need in effect.needs if need in lacks]
        if unmet:
            reasons[name] = f"untestable: {'; '.join(unmet)}"
        else:
            able[name] = effect
    return able, reasons


def unmet_needs(recordings: Recordings, rules: TestabilityRules | None = None) -> dict[Needs, str]:
    """Return the needs of effects that the tests do not meet: need -> reason, and the tests that should be recorded."""
    rules = rules or TestabilityRules()
    pieces = [
        slice(int(a), int(b)) for a, b in zip(recordings.starts[:-1], recordings.starts[1:], strict=True) if b > a
    ]
    met: dict[Needs, tuple[bool, str]] = {
        "varying-drive": (
            _drive_varies(recordings, pieces, rules.drive_change),
            "the drive is constant within every test: record steps or half-sines of current",
        ),
        "varying-speed": (
            _speed_varies(recordings, rules.speed_ratio),
            "all tests have one speed: record triangles at log-spaced speeds, or sines",
        ),
        "several-frequencies": (
            _several_frequencies(recordings, pieces, rules.frequency_ratio),
            "all tests have one frequency: record tests at another one",
        ),
        "several-positions": (
            _several_positions(recordings, pieces, rules.turning),
            "all motions reverse at the same positions: record another amplitude or another mean position",
        ),
        "long-tests": (
            _longest_cycles(recordings, pieces) >= rules.long_cycles,
            f"no test has {rules.long_cycles:.0f} cycles of motion: record a long test",
        ),
    }
    return {need: reason for need, (fulfilled, reason) in met.items() if not fulfilled}


def _drive_varies(recordings: Recordings, pieces: Sequence[slice], share: float) -> bool:
    largest = max(float(np.max(np.abs(recordings.drive))), 1e-12)
    return any(float(np.ptp(recordings.drive[piece])) > share * largest for piece in pieces)


def _speed_varies(recordings: Recordings, ratio: float) -> bool:
    speeds = np.abs(recordings.velocity[recordings.used])
    if not speeds.size:
        return False
    slow, fast = np.quantile(speeds, [0.25, 0.9])
    return bool(fast > ratio * slow)


def _several_frequencies(recordings: Recordings, pieces: Sequence[slice], ratio: float) -> bool:
    if not bool(np.all(recordings.period_s > 0.0)):
        return True
    speeds = np.array([float(np.sqrt(np.mean(recordings.velocity[piece] ** 2))) for piece in pieces])
    bends = np.array([float(np.sqrt(np.mean(recordings.acceleration[piece] ** 2))) for piece in pieces])
    rates = bends / np.maximum(speeds, 1e-12)
    return float(np.max(rates)) >= ratio * float(np.min(rates))


def _turns(velocity: FloatArray) -> np.ndarray:
    """Return the samples after which the motion reverses, shape (turns,)."""
    moving = np.flatnonzero(velocity)
    signs = np.sign(velocity[moving])
    return moving[1:][signs[1:] != signs[:-1]]


def _several_positions(recordings: Recordings, pieces: Sequence[slice], share: float) -> bool:
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
    return max(spreads, default=0.0) > share * stroke


def _longest_cycles(recordings: Recordings, pieces: Sequence[slice]) -> float:
    return max((0.5 * len(_turns(recordings.velocity[piece])) for piece in pieces), default=0.0)
