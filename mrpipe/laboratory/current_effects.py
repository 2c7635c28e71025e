"""Planted effects on the way from the drive to the field in the fluid."""

from __future__ import annotations

import math

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray

DELAY_DEAD_TIME, DELAY_SECOND_ORDER, SATURATION_DRIVER = 1, 2, 6
REMANENCE_RELAXING, REMANENCE_DOMAINS, SATURATION_KNEE = 3, 4, 5
RATED_CURRENT = 4.0


@njit(cache=True)
def _dead_time(numbers: FloatArray, own: FloatArray, ring: FloatArray, current: float, h: float) -> float:
    """Return the current of `numbers[0]` seconds ago (linear between the samples kept)."""
    size = ring.shape[0]
    head = int(own[0])
    ring[head] = current
    own[0] = float((head + 1) % size)
    lag = min(numbers[0] / h, size - 2.0)
    whole = int(lag)
    part = lag - whole
    return (1.0 - part) * ring[(head - whole) % size] + part * ring[(head - whole - 1) % size]


@njit(cache=True)
def _second_order(numbers: FloatArray, own: FloatArray, current: float, h: float) -> float:
    """Return the current behind a driver loop of second order with the low-frequency delay `numbers[0]`."""
    if numbers[0] <= 0.0:
        return current
    omega = 2.0 * numbers[1] / numbers[0]
    if own[2] < 0.5:
        own[0], own[1], own[2] = current, 0.0, 1.0
    parts = int(omega * h / 0.2) + 1
    for _ in range(parts):
        own[1] += h / parts * (omega * omega * (current - own[0]) - 2.0 * numbers[1] * omega * own[1])
        own[0] += h / parts * own[1]
    return own[0]


@njit(cache=True)
def _driver(numbers: FloatArray, own: FloatArray, current: float, h: float) -> float:
    """Return what a driver of limited current and limited rate gives."""
    limit = RATED_CURRENT / max(numbers[0], 1e-9)
    wanted = min(max(current, -limit), limit)
    if own[1] < 0.5:
        own[0], own[1] = wanted, 1.0
    change = numbers[1] * h
    own[0] += min(max(wanted - own[0], -change), change)
    return own[0]


@njit(cache=True)
def _relaxing(numbers: FloatArray, own: FloatArray, u: float, v: float, h: float) -> float:
    """Return the field's current with a remanence that saturates, charges fast and fades by time and by slip."""
    # the field that stays is always less than the one that was
    level = min(numbers[0] * u / (1.0 + u / numbers[1]), 0.97 * u)
    kept = own[0]
    if level > kept:
        kept += (level - kept) * (1.0 - math.exp(-h / numbers[2]))
    else:
        fade = 1.0 / numbers[3] + abs(v) / numbers[4]
        excess = (kept - level) / numbers[1]
        # faster from high excess: a power law and no exponential
        kept -= (kept - level) * (1.0 - math.exp(-h * fade * (0.3 + 2.0 * excess)))
    own[0] = kept
    size = max(u, 1e-12)
    return float((size**8 + kept**8) ** 0.125)


@njit(cache=True)
def _domains(numbers: FloatArray, own: FloatArray, u: float) -> float:
    """Return the field's current behind three plays of the current: domains that turn at their own threshold."""
    total = 0.0
    for k in range(3):
        width = numbers[1] * (0.4 + 0.6 * k)
        own[k] = min(max(own[k], u), u + width)
        total += (own[k] - u) / 3.0
    return u + numbers[0] * total


@njit(cache=True)
def effective_current(
    codes: IntArray,
    values: FloatArray,
    memory: FloatArray,
    ring: FloatArray,
    current: float,
    v: float,
    h: float,
    place: int,
) -> float:
    """Return the current after the effects before (`place` 0) or after (1) the lag (2.4)."""
    for k in range(codes.shape[0]):
        code = codes[k]
        if place == 0:
            if code == DELAY_DEAD_TIME:
                current = _dead_time(values[k], memory[k], ring[k], current, h)
            elif code == DELAY_SECOND_ORDER:
                current = _second_order(values[k], memory[k], current, h)
            elif code == SATURATION_DRIVER:
                current = _driver(values[k], memory[k], current, h)
        elif code == REMANENCE_RELAXING:
            current = _relaxing(values[k], memory[k], max(current, 0.0), v, h)
        elif code == REMANENCE_DOMAINS:
            current = _domains(values[k], memory[k], max(current, 0.0))
        elif code == SATURATION_KNEE:
            knee = RATED_CURRENT / max(values[k, 0], 1e-9)
            size = abs(current) / knee
            current = current / (1.0 + size ** values[k, 1]) ** (1.0 / values[k, 1])
    return current
